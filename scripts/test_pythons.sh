#!/bin/sh
# Tests the package with each Python that this machine has. Usage: scripts/test_pythons.sh [3.10 3.11 ... lowest]
#
# `lowest` is the first of them with the oldest packages that pyproject.toml allows, as far as there are wheels of them.
# Each gets a virtual environment in build/python with the package, its simulator, its recordings and pytest, and nothing else of
# the developers'.
set -eu
cd "$(dirname "$0")/.."
TESTS="tests/values tests/wire tests/model tests/schema/test_golden.py tests/arm/test_arm.py tests/arm/test_errors_advise.py
    tests/arm/test_requests.py tests/transports/test_exchange.py
    tests/cli/test_commands.py tests/cli/test_targets.py"

python_of() { # the path of a working Python of this version
    for candidate in "python$1" "$HOME"/.pyenv/versions/"$1".*/bin/python "$HOME"/.local/share/uv/python/cpython-"$1"*/bin/python; do
        if "$candidate" -c 'import sys; sys.exit(sys.version_info[:2] != tuple(map(int, sys.argv[1].split("."))))' "$1" 2>/dev/null; then
            echo "$candidate"
            return 0
        fi
    done
    return 1
}

first() { # the path of the oldest Python
    for version in 3.10 3.11 3.12 3.13; do
        python_of "$version" && return 0
    done
    return 1
}

found=0
for version in ${*:-3.10 3.11 3.12 3.13 lowest}; do
    if [ "$version" = lowest ]; then
        python=$(first) || continue
    elif ! python=$(python_of "$version"); then
        echo "Python $version: not on this machine"
        continue
    fi
    found=$((found + 1))
    venv=build/python/$version
    [ -x "$venv/bin/python" ] || "$python" -m venv "$venv"
    pip="$venv/bin/python -m pip install -q --disable-pip-version-check"
    if [ "$version" = lowest ]; then
        $pip uv
        pip="$venv/bin/uv pip install -q --python $venv/bin/python --resolution lowest-direct --only-binary :all:"
    fi
    $pip -e ".[sim,record]" "pytest>=8" "pytest-timeout>=2.3" "hypothesis>=6.100"
    echo "Python $version: $("$venv/bin/python" --version)"
    # shellcheck disable=SC2086
    "$venv/bin/python" -m pytest -q -m "not slow and not long and not alone and not browser" $TESTS
done
[ "$found" -gt 0 ]
