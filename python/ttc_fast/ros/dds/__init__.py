"""A participant in a ROS 2 graph without a ROS installation, over Cyclone DDS: the extra ``ttc-fast[dds]``.

A received message is viewed in its bytes (``ttc_fast.ros_messages``); a sent message is an object that Cyclone
serialises. A message that is cut short or damaged is dropped and counted.
"""
