"""The brake as a ROS node: one core that knows no transport, and a thin adapter for each of rospy, DDS and rclpy."""
