#!/bin/sh
# Makes .venv with heptarm (editable) and its tools. Usage: scripts/setup.sh [extras], for example "sim,viz" or "all".
set -eu
cd "$(dirname "$0")/.."
extras=${1:-all}
venv=.venv

as_root_apt() { # installs Debian packages when that is possible
    command -v apt-get >/dev/null && [ "$(id -u)" = 0 ] || return 1
    apt-get -q update && DEBIAN_FRONTEND=noninteractive apt-get -q install -y --no-install-recommends "$@"
}

python=${PYTHON:-}
if [ -z "$python" ]; then
    for candidate in python3 python3.13 python3.12 python3.11 python3.10; do
        if command -v "$candidate" >/dev/null && "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 10))'; then
            python=$candidate
            break
        fi
    done
fi
if [ -z "$python" ]; then
    as_root_apt python3 python3-venv || { echo "heptarm needs Python 3.10 or later: install python3 and python3-venv" >&2; exit 1; }
    python=python3
fi
if [ ! -x $venv/bin/python ]; then
    if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
        as_root_apt python3-venv || { echo "Python's venv is missing; type: sudo apt-get install -y python3-venv" >&2; exit 1; }
    fi
    "$python" -m venv $venv
fi
# Old versions of pip can search for a long time for a set of versions that fit.
$venv/bin/python -m pip install -q --disable-pip-version-check -U "pip>=24"
case ",$extras," in
*,all,* | *,dev,* | *,rl,*)
    # A version for which there is a build without CUDA here; any newer one would bring gigabytes that no test needs.
    $venv/bin/python -m pip install -q --disable-pip-version-check "torch==2.13.0" ||
        echo "torch 2.13.0 is not to be had here; another version will be taken" >&2
    ;;
esac
$venv/bin/python -m pip install -q --disable-pip-version-check -e ".[$extras]"
