"""ROS 2: ros2 launch ttc_fast_ros brake.launch.py scan:=/front/scan; with ns:=/car all topics are in /car."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

TOPICS = ("scan", "odom", "drive", "drive_in")


def generate_launch_description() -> LaunchDescription:
    """Describe the node, with a file of parameters and other names for its topics."""
    config = Path(get_package_share_directory("ttc_fast_ros")) / "config" / "brake.yaml"
    return LaunchDescription(
        [
            DeclareLaunchArgument("config", default_value=str(config), description="parameters of the node"),
            DeclareLaunchArgument("ns", default_value="/", description="namespace of the node and its topics"),
            *(DeclareLaunchArgument(topic, default_value=topic) for topic in TOPICS),
            Node(
                package="ttc_fast_ros",
                executable="brake_node",
                name="ttc_fast",
                namespace=LaunchConfiguration("ns"),
                output="screen",
                respawn=True,
                parameters=[LaunchConfiguration("config")],
                remappings=[(topic, LaunchConfiguration(topic)) for topic in TOPICS],
            ),
        ]
    )
