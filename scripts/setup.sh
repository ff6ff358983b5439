#!/bin/sh
# Makes .venv with heptarm (editable). Usage: scripts/setup.sh demo (what the demo needs), dev (with all tools, the default), or
# extras, for example "sim,viz".
set -eu
cd "$(dirname "$0")/.."
extras=${1:-dev}
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
pip() { $venv/bin/python -m pip "$@"; }
export PIP_DISABLE_PIP_VERSION_CHECK=1

# Installs exactly the files whose SHA-256 a lock file names. If they are not to be had here, it reports that and fails; a file
# with another content ends the set-up.
locked() {
    name=$1
    shift
    if said=$(pip install -q --require-hashes --no-deps "$@" -r "scripts/lock/$name.txt" 2>&1); then
        return 0
    fi
    case $said in
    *"DO NOT MATCH THE HASHES"*)
        echo "$said" >&2
        echo "a downloaded file is not the one that scripts/lock/$name.txt names; nothing of it was installed" >&2
        exit 1
        ;;
    esac
    echo "$said" | grep ERROR >&2 || true
    return 1
}

torch() { # A version for which there is a build without CUDA here; any newer one would bring gigabytes that no test needs.
    pip install -q "torch==2.13.0" || {
        echo "torch 2.13.0 is not to be had here; another version will be taken" >&2
        return 1
    }
}

# Of CMake only the tool that builds is used here: its testing and packaging tools and its help are 55 MB.
lean() { rm -rf $venv/lib/python3*/site-packages/cmake/data/bin/ctest $venv/lib/python3*/site-packages/cmake/data/bin/cpack \
    $venv/lib/python3*/site-packages/cmake/data/share/cmake-*/Help; }

# Old versions of pip can search for a long time for a set of versions that fit.
"$venv/bin/python" -c 'import sys, pip; sys.exit(int(pip.__version__.split(".")[0]) < 24)' || pip install -q -U "pip>=24"
packages=".[$extras]"
case $extras in
dev | demo)
    # Half of the time would go into compiling modules that are never imported; Python compiles the others when they are.
    if [ "$extras" = dev ]; then export PIP_COMPILE=0; fi
    if [ "$extras" = dev ] && ! locked torch --no-index; then
        echo "the locked build of torch is not on this machine; another build is installed, without a checksum" >&2
        torch || true
    fi
    if locked "$extras"; then
        pip install -q --no-deps --no-build-isolation -e . && pip check && lean && exit 0
    fi
    echo "the locked versions are not all to be had here, or do not suffice; the newest are installed, without checksums" >&2
    if [ "$extras" = demo ]; then packages=".[sim] matplotlib"; fi
    ;;
*,rl,* | rl | rl,* | *,rl | dev,* | *,dev | *,dev,* | all) torch || true ;;
esac
# shellcheck disable=SC2086
pip install -q -e $packages
lean
