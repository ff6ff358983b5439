#!/bin/sh
# Makes sure that there is a C compiler, which builds the extension heptarm._native. As root on Debian and Ubuntu it installs one.
set -eu
for compiler in "${CC:-cc}" gcc clang; do
    if command -v "$compiler" >/dev/null; then exit 0; fi
done
if command -v apt-get >/dev/null && [ "$(id -u)" = 0 ]; then
    apt-get -q update && DEBIAN_FRONTEND=noninteractive apt-get -q install -y --no-install-recommends gcc libc6-dev
    exit 0
fi
echo "the extension heptarm._native needs a C compiler; type: sudo apt-get install -y gcc libc6-dev" >&2
exit 1
