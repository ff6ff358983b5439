#!/bin/sh
# Makes build/lerobot, an environment of Python 3.12 with LeRobot, this package and its plug-ins, for the long tests. Without
# such a Python it reports that and succeeds: the tests are skipped then. PYTHON=... names one.
set -eu
cd "$(dirname "$0")/.."
python=$(for name in ${PYTHON:-} python3.12 python3.13 "$HOME"/.pyenv/versions/3.12*/bin/python; do
    "$name" -c 'import sys; sys.exit(sys.version_info < (3, 12))' 2>/dev/null && command -v "$name" && break
done || true)
[ -n "$python" ] || { echo "no Python 3.12 here: the tests of LeRobot will be skipped" && exit 0; }
[ -x build/lerobot/bin/python ] || "$python" -m venv build/lerobot
build/lerobot/bin/pip install -q "lerobot[dataset,training]>=0.6,<0.7" "setuptools>=64" scikit-build-core
build/lerobot/bin/pip install -q --no-build-isolation ".[sim]"
for part in robot camera teleoperator env; do
    build/lerobot/bin/pip install -q --no-deps --no-build-isolation -e "lerobot/lerobot_${part}_heptarm"
done
build/lerobot/bin/lerobot-info >/dev/null 2>&1 || { echo "LeRobot does not start in build/lerobot" >&2 && exit 1; }
echo "LeRobot and heptarm's plug-ins are in build/lerobot"
