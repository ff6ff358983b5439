"""Folders of heptarm's own files are this user's alone."""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import heptarm as ha
from heptarm.io import folders, keys, panel_box, targets
from heptarm.record import black_box

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has other permissions")


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("XDG_CONFIG_HOME", "XDG_STATE_HOME", "XDG_RUNTIME_DIR"):
        monkeypatch.setenv(name, str(tmp_path / name))
    monkeypatch.delenv("HEPTARM_BLACK_BOX", raising=False)
    return tmp_path


def mode(place: Path) -> int:
    return stat.S_IMODE(place.stat().st_mode)


def black_box_folder() -> Path:
    found = black_box.folder()
    assert found is not None
    return found


@pytest.mark.parametrize(
    "folder", [folders.settings_folder, keys.key_folder, panel_box.folder, black_box_folder]
)
def test_folders_are_made_private_also_those_that_were_open(folder: Callable[[], Path]) -> None:
    place = folder()
    assert folders.private_folder(place) == place and mode(place) == 0o700
    for one in (place, place.parent):
        one.chmod(0o775)
    folders.private_folder(place)
    assert mode(place) == 0o700
    if place != folders.settings_folder():
        assert mode(place.parent) == 0o700  # heptarm's own, too
    else:
        assert mode(place.parent) == 0o775  # the user's


def test_a_folder_that_the_user_names_is_left_as_it_is(tmp_path: Path) -> None:
    tmp_path.chmod(0o755)
    keys.write_key_file(tmp_path / "robot.key", "k" * 32)
    assert mode(tmp_path) == 0o755


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="needs users")
def test_a_folder_of_another_user_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    folders.private_folder(folders.settings_folder())
    monkeypatch.setattr(os, "getuid", lambda: os.geteuid() + 1)
    with pytest.raises(PermissionError, match="another user's"):
        folders.private_folder(folders.settings_folder())
    with pytest.raises(ha.CommandRejected, match="another user's: remove it, or make it yours"):
        targets.add_target(targets.SavedTarget("cell", "172.31.1.147"))
    with pytest.raises(ha.CommandRejected, match="another user's"):
        keys.write_key_file(keys.key_folder() / "cell.key", "k" * 32)
    assert list(folders.settings_folder().iterdir()) == []


def test_a_folder_to_which_anybody_can_write_is_not_used() -> None:
    place = folders.private_folder(keys.key_folder())
    place.chmod(0o777)
    with pytest.raises(PermissionError, match="chmod 700"):
        folders.private_folder(place)
    assert mode(place) == 0o777


def test_a_file_in_place_of_the_folder_is_refused() -> None:
    place = folders.settings_folder()
    place.parent.mkdir(parents=True)
    place.write_text("")
    with pytest.raises(OSError):
        folders.private_folder(place)
