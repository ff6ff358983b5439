#!/bin/sh
# What the release workflow builds, on this machine: source distribution, a wheel from it, and both in fresh environments.
set -eu
cd "$(dirname "$0")/.."
py=.venv/bin/python
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

version=$($py -c 'import importlib.metadata as m; print(m.version("heptarm"))')
grep -q "^version: $version$" CITATION.cff || { echo "CITATION.cff is not of version $version" >&2; exit 1; }
grep -q "^## \[*$version" CHANGELOG.md || echo "CHANGELOG.md: rename Unreleased to $version before the tag v$version" >&2

# what is committed, with the jars of this machine; nothing else that lies about gets into it
mkdir "$out/tree"
git archive HEAD | tar -x -C "$out/tree"
cp -r src/heptarm/sim/jars "$out/tree/src/heptarm/sim/"
for kind in sdist wheel; do
    HEPTARM_JARS_ARE_BUILT=yes $py -m build --$kind --no-isolation --outdir "$out" "$out/tree"
done
# isolated from the developers' environment, as at a user's
for package in "$out"/*.whl "$out"/*.tar.gz; do
    python3 -m venv --clear "$out/fresh"
    "$out/fresh/bin/pip" install -q "heptarm @ file://$package"
    (
        cd "$out"
        unset PYTHONPATH
        fresh/bin/heptarm --version
        fresh/bin/python -c '
import heptarm.model as model
from heptarm.values.robot import robot
print(model.forward(robot("iiwa14"), [0.1] * 7)[:3, 3])'
    )
    echo "$(basename "$package"): installed, $(wc -c < "$package") bytes"
done
if [ "${DEMO:-}" ]; then
    python3 -m venv --clear "$out/fresh"
    "$out/fresh/bin/pip" install -q "heptarm[sim,viz] @ file://$(echo "$out"/*.whl)"
    (cd "$out" && unset PYTHONPATH && fresh/bin/heptarm demo)
fi
