#!/bin/sh
# Installs RViz, robot_state_publisher and a virtual display from Debian's packages, for tests/ros1/test_rviz.py. Without
# such packages it reports that and succeeds: the test is skipped then.
set -eu
packages="rviz xvfb libgl1-mesa-dri ros-robot-state-publisher"

no() {
    echo "no RViz here: $1; its test will be skipped"
    exit 0
}

complete() {
    command -v rviz >/dev/null && command -v Xvfb >/dev/null
}

if ! complete; then
    command -v apt-get >/dev/null && [ "$(id -u)" = 0 ] || no "it is missing; type: sudo apt-get install -y $packages"
    apt-cache show rviz >/dev/null 2>&1 || no "this system has no package of it"
    DEBIAN_FRONTEND=noninteractive apt-get -qq install -y --no-install-recommends $packages >/dev/null ||
        { echo "Debian's packages of RViz cannot be installed" >&2 && exit 1; }
fi
echo "$(command -v rviz) and $(command -v Xvfb) are installed"
