"""A participant in a ROS 2 graph without a ROS installation, over Cyclone DDS: the extra ``ttc-fast[dds]``.

A message is its serialised bytes on both sides: those received are viewed in place (``ttc_fast.ros_messages``), those
sent are packed by ``encode``. What is no message, because it is cut short or damaged, is dropped and counted.
"""
