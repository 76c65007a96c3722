"""How colcon installs the package in ROS 2; the node itself comes with ttc_fast."""

from setuptools import setup

NAME = "ttc_fast_ros"
SHARE = f"share/{NAME}"

setup(
    name=NAME,
    version="0.1.0",
    description="Brakes on time-to-collision: the node of ttc_fast",
    license="MIT OR Apache-2.0",
    packages=[],
    py_modules=[],
    install_requires=["setuptools"],
    zip_safe=True,
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (SHARE, ["package.xml"]),
        (f"{SHARE}/launch", ["launch/brake.launch.py"]),
        (f"{SHARE}/config", ["config/brake.yaml"]),
    ],
    entry_points={"console_scripts": ["brake_node = ttc_fast.ros.rclpy_node:main"]},
)
