"""No file carries what an unfinished merge leaves behind."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
#: Three of the four lines of a conflict; the fourth, seven equals signs, also underlines headings.
MARKER = re.compile(rb"^(?:<{7}|\|{7}|>{7})(?:[ \t\r]|$)", re.M)


def marked(text: bytes) -> list[int]:
    """Numbers of the lines that are merge markers."""
    return [text.count(b"\n", 0, found.start()) + 1 for found in MARKER.finditer(text)]


def test_a_conflict_is_found() -> None:
    conflict = b"a\n<<<<<<< HEAD\nb\n=======\nc\n>>>>>>> main\nd\n"
    assert marked(conflict) == [2, 6]
    assert not marked(b">>> plot()\n<<<<<<<<<<<<\nHeading\n=======\n")


def test_no_file_has_merge_markers() -> None:
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False)
    if listed.returncode != 0:
        pytest.skip("no repository here")
    found = []
    for name in filter(None, listed.stdout.decode().split("\0")):
        file = ROOT / name
        if file.is_file() and (lines := marked(file.read_bytes())):
            found.append(f"{name}:{lines[0]}")
    assert not found, f"resolve the conflicts in {', '.join(found)}"
