#!/usr/bin/env bash
# Installs rclpy from PyPI into a virtual environment of its own, with what its tests need, and lets it see the checkout.
# No registry has ackermann_msgs and tf2_msgs: tests/support/ros2_messages has both, and a real one would come first.
set -euo pipefail
python="$1"
venv="$2"
common=5.3.6
packages=(
    'ros-rclpy[fastrtps]==7.1.6'
    ros-sensor-msgs==$common ros-nav-msgs==$common ros-std-msgs==$common ros-diagnostic-msgs==$common
    ros-visualization-msgs==$common
    "$(grep -o 'cyclonedds[^"]*' pyproject.toml | head -1)" mcap lz4 zstandard rosbags pytest hypothesis
)
"$python" -c 'import sys; assert sys.version_info[:2] == (3, 11)' 2>/dev/null || {
    echo "$python is no CPython 3.11, for which PyPI has rclpy 7.1.6 (Jazzy): name one with make ros2 ROS2_PYTHON=..." >&2
    exit 1
}
[ -x "$venv/bin/python" ] || "$python" -m venv "$venv"
"$venv/bin/python" -m pip install --quiet --no-compile "${packages[@]}"
site="$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')"
printf '%s\n' "$PWD/python" "$PWD/tests/support/ros2_messages" > "$site/ttc_fast.pth"
"$venv/bin/python" -c 'import rclpy, ttc_fast, ackermann_msgs.msg, tf2_msgs.msg' || {
    echo "the rclpy of PyPI does not run here; it needs glibc 2.28 or later" >&2
    exit 1
}
