"""Makes sure that a JDK and the Eclipse compiler are there; they are needed only to compile the cabinet.

Installs them on Debian and Ubuntu when run as root, and otherwise ends with the command to type.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "cabinet"))

import toolchain


def _install() -> None:
    subprocess.run(["apt-get", "-q", "update"], check=True)
    known = subprocess.run(["apt-cache", "show", "openjdk-17-jdk-headless"], capture_output=True, check=False)
    jdk = "openjdk-17-jdk-headless" if known.returncode == 0 else "default-jdk-headless"
    command = ["apt-get", "-q", "install", "-y", "--no-install-recommends", jdk, "ecj"]
    subprocess.run(command, check=True, env=os.environ | {"DEBIAN_FRONTEND": "noninteractive"})


def main() -> int:
    """Looks, installs where that is possible, looks again."""
    for attempt in range(2):
        try:
            jdk = toolchain.find_jdk()
            toolchain.find_ecj(jdk)
        except toolchain.ToolMissing as missing:
            if attempt == 0 and shutil.which("apt-get") and hasattr(os, "geteuid") and os.geteuid() == 0:
                _install()
                continue
            print(missing, file=sys.stderr)
            return 1
        if not jdk.knows_java_7:
            print(f"note: JDK {jdk.version} no longer knows Java 7; library calls are checked against Java 8")
        return 0
    return 1


if __name__ == "__main__":
    sys.exit(main())
