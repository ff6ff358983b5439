"""Writes scripts/lock/*.txt: every package of an environment with its version and the SHA-256 of its files.

`make lock` runs it, with network. It keeps the versions of the present lock files unless they no longer fit; to take
newer ones, delete a file first. `scripts/lock/torch.txt` is written by hand, see there.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LOCK = ROOT / "scripts" / "lock"
#: The resolver; it writes one file for all versions of Python and all platforms.
UV = "uv==0.13.9"
#: Name of a lock file and what it is made of.
INPUTS = {
    # the same versions as in "dev", on top of which the tools of the developers come
    "demo": (
        "pyproject.toml",
        "--extra",
        "sim",
        "scripts/lock/demo.in",
        "--constraint",
        "scripts/lock/dev.txt",
    ),
    "dev": ("pyproject.toml", "--extra", "dev", "scripts/lock/dev.in"),
    "ros2": ("scripts/ros2_requirements.txt",),
    "ros1": ("scripts/lock/ros1.in",),
    "numpy": ("scripts/lock/numpy.in",),
}
HEADER = "# Written by `make lock`. Installed with: pip install --require-hashes --no-deps -r scripts/lock/{name}.txt\n"


def main() -> int:
    """Writes all lock files, or the named ones."""
    parser = argparse.ArgumentParser(description="Write the lock files.")
    parser.add_argument("names", nargs="*", choices=[[], *INPUTS], help="which; default: all")
    names = parser.parse_args().names or list(INPUTS)
    folder = ROOT / "build" / "lock"
    if not folder.exists():
        venv.create(folder, with_pip=True)
    python = folder / ("Scripts" if sys.platform == "win32" else "bin") / "python"
    subprocess.run([python, "-m", "pip", "install", "-q", UV], check=True)
    for name in names:
        file = LOCK / f"{name}.txt"
        command: list[str | Path] = [python, "-m", "uv", "pip", "compile", *INPUTS[name], "-o", file, "-q"]
        command += ["--universal", "--python-version", "3.10", "--generate-hashes"]
        # torch comes from its own lock file, and without the CUDA libraries that PyPI's build for Linux needs
        command += ["--override", LOCK / "overrides.in", "--no-header", "--no-annotate"]
        subprocess.run(command, check=True, cwd=ROOT)
        file.write_text(HEADER.format(name=name) + file.read_text(encoding="utf-8"), encoding="utf-8")
        print(file.relative_to(ROOT))
    return 0


if __name__ == "__main__":
    sys.exit(main())
