#!/bin/sh
# Makes build/ros1: rospy from Debian's packages, our interfaces, our node. Without such packages it reports that and
# succeeds without build/ros1: the tests are skipped then. An error of the set-up itself is a failure.
set -eu
cd "$(dirname "$0")/.."
venv=build/ros1
python=/usr/bin/python3
packages="python3-rospy python3-actionlib python3-roslaunch python3-sensor-msgs python3-shape-msgs python3-trajectory-msgs python3-diagnostic-msgs
    python3-std-srvs python3-geometry-msgs python3-genpy python3-rostopic python3-rosservice ros-std-msgs ros-geometry-msgs
    ros-sensor-msgs ros-shape-msgs ros-trajectory-msgs ros-actionlib-msgs"

no() {
    echo "no ROS 1 here: $1; its tests will be skipped"
    rm -rf $venv
    exit 0
}

failed() {
    echo "setting up ROS 1 failed: $1" >&2
    exit 1
}

complete() {
    $python -c "import rospy, actionlib, roslaunch, sensor_msgs, shape_msgs, trajectory_msgs, diagnostic_msgs, std_srvs, genpy, rostopic, rosservice" 2>/dev/null &&
        [ -d /usr/share/trajectory_msgs/msg ] && [ -d /usr/share/sensor_msgs/msg ] && [ -d /usr/share/shape_msgs/msg ] && [ -d /usr/share/actionlib_msgs/msg ] && command -v roscore >/dev/null
}

[ -x $python ] || no "there is no $python"
$python -c 'import sys; sys.exit(sys.version_info < (3, 10))' || no "$($python -V) is too old for heptarm"
if ! complete; then
    command -v apt-get >/dev/null && [ "$(id -u)" = 0 ] || no "rospy is missing; type: sudo apt-get install -y $(echo $packages)"
    apt-get -qq update || failed "the package lists cannot be had"
    apt-cache show python3-rospy >/dev/null 2>&1 || no "this system has no packages of it"
    DEBIAN_FRONTEND=noninteractive apt-get -qq install -y --no-install-recommends python3-venv $packages >/dev/null ||
        failed "Debian's packages of ROS cannot be installed"
    complete || failed "Debian's packages of ROS are not complete"
fi
# Without pip of its own, which Debian keeps in a further package.
[ -x $venv/bin/python ] || $python -m venv --system-site-packages --without-pip $venv
packages() { # of one lock file, with its checksums; where they are not to be had, others without
    said=$(.venv/bin/python -m pip --python $venv/bin/python install -q --disable-pip-version-check \
        --require-hashes --no-deps -r "scripts/lock/$1.txt" 2>&1) && return 0
    echo "$said" >&2
    case $said in
    *"DO NOT MATCH THE HASHES"*) failed "a downloaded file is not the one that scripts/lock/$1.txt names" ;;
    esac
    echo "the locked versions are not to be had here; others are installed, without checksums" >&2
    .venv/bin/python -m pip --python $venv/bin/python install -q --disable-pip-version-check -r "scripts/lock/$1.in" ||
        failed "numpy, pytest and hypothesis cannot be installed for $($venv/bin/python -V)"
}
$venv/bin/python -c 'import numpy; assert (1, 22) <= tuple(map(int, numpy.__version__.split(".")[:2])) < (3, 0)' 2>/dev/null || packages numpy
packages ros1
site=$($venv/bin/python -c 'import sysconfig; print(sysconfig.get_paths()["purelib"])')
$venv/bin/python scripts/ros1_interfaces.py $venv/interfaces ros1/interfaces/*/ ros1/heptarm_msgs --site "$site"
printf '%s\n' "$PWD/src" "$PWD/ros1/heptarm_ros1/src" >"$site/heptarm_sources.pth"
echo "$venv/bin/python has ROS 1 and heptarm_ros1"
