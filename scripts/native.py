"""Builds the extension into src/heptarm, as `make native` does.

A build that is up to date takes a tenth of a second.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def _tool(name: str) -> str:
    """A tool of this virtual environment, or else of the system."""
    own = Path(sys.executable).with_name(name)
    found = str(own) if own.exists() else shutil.which(name)
    if found is None:
        sys.exit(f"{name} is missing: install it with `pip install {name}`")
    return found


def main() -> int:
    """Configures once, then compiles what has changed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--sanitize", action="store_true", help="a copy under ASan and UBSan, in build/sanitized"
    )
    sanitize = parser.parse_args().sanitize
    cmake = _tool("cmake")
    folder = ROOT / "build" / ("sanitized" if sanitize else "native")
    stamp = folder / "build.ninja"
    if not stamp.exists() or stamp.stat().st_mtime < (ROOT / "native" / "CMakeLists.txt").stat().st_mtime:
        options = [f"-DPython_EXECUTABLE={sys.executable}", f"-DCMAKE_MAKE_PROGRAM={_tool('ninja')}"]
        options += ["-DHEPTARM_SANITIZE=ON"] if sanitize else []
        command = [cmake, "-S", str(ROOT / "native"), "-B", str(folder), "-G", "Ninja", *options]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    run = subprocess.run([cmake, "--build", folder], capture_output=True, text=True, check=False)
    if run.returncode:
        print(run.stdout + run.stderr, file=sys.stderr)
    return run.returncode


if __name__ == "__main__":
    sys.exit(main())
