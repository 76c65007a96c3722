"""ROS 2: ros2 launch ttc_fast_ros brake.launch.py scan:=/front/scan."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

TOPICS = ("/scan", "/odom", "/drive")


def generate_launch_description() -> LaunchDescription:
    """Describe the node, with a file of parameters and other names for its topics."""
    config = Path(get_package_share_directory("ttc_fast_ros")) / "config" / "brake.yaml"
    names = [topic.strip("/") for topic in TOPICS]
    return LaunchDescription(
        [
            DeclareLaunchArgument("config", default_value=str(config), description="parameters of the node"),
            *(DeclareLaunchArgument(name, default_value=topic) for name, topic in zip(names, TOPICS, strict=True)),
            Node(
                package="ttc_fast_ros",
                executable="brake_node",
                name="ttc_fast",
                output="screen",
                respawn=True,
                parameters=[LaunchConfiguration("config")],
                remappings=[(topic, LaunchConfiguration(name)) for name, topic in zip(names, TOPICS, strict=True)],
            ),
        ]
    )
