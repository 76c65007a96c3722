#!/usr/bin/env bash
# Installs rospy and what its tests need from Debian or Ubuntu, and lets a virtual environment see it.
# By a .pth file: with PYTHONPATH the distribution's numpy would come before the environment's own.
set -euo pipefail
python="$1"
packages=(
    python3-rospy python3-rosmaster rosout python3-rosbag
    python3-sensor-msgs python3-nav-msgs python3-diagnostic-msgs python3-visualization-msgs python3-numpy
)
command -v apt-get >/dev/null || { echo "ROS 1 is packaged for Debian and Ubuntu; here is no apt-get" >&2; exit 1; }
missing=()
for package in "${packages[@]}"; do
    dpkg-query --show --showformat '${db:Status-Status}' "$package" 2>/dev/null | grep -q '^installed$' || missing+=("$package")
done
if [ ${#missing[@]} -gt 0 ]; then
    [ "$(id -u)" = 0 ] || { echo "as root: apt-get install --no-install-recommends ${missing[*]}" >&2; exit 1; }
    export DEBIAN_FRONTEND=noninteractive
    apt-get update -qq
    apt-get install -qq --no-install-recommends "${missing[@]}" >/dev/null
fi
packages_of() { "$python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))'; }
echo /usr/lib/python3/dist-packages > "$(packages_of)/ros1.pth"
"$python" -c 'import rospy, rospy.numpy_msg, visualization_msgs.msg' || {
    echo "the distribution's rospy does not run under $("$python" --version): make clean, then make PYTHON=/usr/bin/python3" >&2
    exit 1
}
