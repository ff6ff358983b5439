"""Files that are written at the end of something: refused at its beginning where that cannot be."""

from __future__ import annotations

from pathlib import Path

import pytest

from heptarm.errors import CommandRejected
from heptarm.values.files import writable_file


def test_its_folder_is_made_and_nothing_is_left(tmp_path: Path) -> None:
    path = tmp_path / "new" / "folder" / "report.json"
    assert writable_file(path, overwrite=False) == path
    assert path.parent.is_dir() and not path.exists()


def test_what_is_there_stays_until_it_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    path.write_text("mine")
    with pytest.raises(CommandRejected, match=r"report\.json exists"):
        writable_file(path, overwrite=False)
    assert writable_file(path, overwrite=True).read_text() == "mine"
    assert writable_file(Path("/dev/stdout"), overwrite=True)


def test_what_cannot_be_written_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    for path, why in ((tmp_path / "file" / "report.json", "cannot be written"), (tmp_path, "is a directory")):
        with pytest.raises(CommandRejected, match=why):
            writable_file(path, overwrite=True, name="out")
    assert (tmp_path / "file").read_text() == "mine"
