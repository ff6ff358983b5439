#!/bin/sh
# The screenshot test of the viewer needs Chromium. Installed on Debian when root; otherwise that test is skipped, with a message.
for name in chromium chromium-browser google-chrome; do
    command -v "$name" >/dev/null && exit 0
done
if command -v apt-get >/dev/null && [ "$(id -u)" = 0 ] && grep -q '^ID=debian' /etc/os-release; then
    apt-get -q update && DEBIAN_FRONTEND=noninteractive apt-get -q install -y --no-install-recommends chromium chromium-driver ||
        echo "Chromium could not be installed: the viewer's screenshot test will be skipped"
else
    echo "no Chromium: the viewer's screenshot test will be skipped"
fi
exit 0
