"""ackermann_msgs, for the tests of ROS 2: no package registry has it."""
