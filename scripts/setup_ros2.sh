#!/bin/sh
# Makes build/ros2: rclpy from PyPI's wheels, our interfaces, our node, for machines without ROS. Without
# wheels it reports that and succeeds without build/ros2: the tests are skipped then. An error of the set-up is a failure.
set -eu
cd "$(dirname "$0")/.."
venv=build/ros2

no() {
    echo "no ROS 2 here: $1; its tests will be skipped"
    rm -rf $venv
    exit 0
}

failed() {
    echo "setting up ROS 2 failed: $1" >&2
    exit 1
}

[ "$(uname -s)-$(uname -m)" = Linux-x86_64 ] || no "there are wheels for Linux on x86_64 only"
for compiler in gcc g++; do
    command -v $compiler >/dev/null && continue
    if command -v apt-get >/dev/null && [ "$(id -u)" = 0 ]; then
        apt-get -q update && DEBIAN_FRONTEND=noninteractive apt-get -q install -y --no-install-recommends gcc g++
    fi
    command -v $compiler >/dev/null || no "$compiler is missing, which compiles the interfaces"
done
python=$(.venv/bin/python -c 'import sys; print(sys._base_executable)')
[ -x $venv/bin/python ] || "$python" -m venv $venv
wheels() { said=$($venv/bin/python -m pip install -q --disable-pip-version-check "$@" 2>&1); }
fetched=yes
wheels --require-hashes --no-deps -r scripts/lock/ros2.txt || fetched=no
case $fetched-$said in
no-*"No matching distribution"*)
    echo "the locked versions are not to be had here; others are installed, without checksums" >&2
    if wheels -r scripts/ros2_requirements.txt; then fetched=yes; fi
    ;;
esac
if [ $fetched = no ]; then
    echo "$said" >&2
    case $said in
    *"DO NOT MATCH THE HASHES"*) failed "a downloaded file is not the one that scripts/lock/ros2.txt names" ;;
    *onnection* | *imed\ out* | *resolution*) failed "the wheels cannot be fetched" ;;
    *"No matching distribution"*) no "there are no wheels for $($venv/bin/python -V)" ;;
    esac
    failed "the wheels cannot be installed"
fi
headers=$($venv/bin/python -c 'import sysconfig; print(sysconfig.get_paths()["include"])')
[ -e "$headers/Python.h" ] || no "Python's headers are missing (python3-dev)"
$venv/bin/python scripts/ros2_interfaces.py ros2/interfaces/*/ ros2/heptarm_msgs
site=$($venv/bin/python -c 'import sysconfig; print(sysconfig.get_paths()["purelib"])')
printf '%s\n' "$PWD/src" "$PWD/ros2/heptarm_ros2" >"$site/heptarm_sources.pth"
echo "$venv/bin/python has ROS 2 and heptarm_ros2"
