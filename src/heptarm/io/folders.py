"""Where heptarm keeps files of its own, and how their folders stay this user's alone.

Keys, saved targets, black boxes and plans for open panels: nobody else may read them, or put something into them that
heptarm then reads. Folders that a user names are the user's own matter.
"""

from __future__ import annotations

import errno
import os
import stat
import sys
import tempfile
from pathlib import Path

_OTHERS = 0o077


def settings_folder() -> Path:
    """Folder of the user's settings: heptarm in XDG_CONFIG_HOME (~/.config), on Windows in APPDATA."""
    base = os.environ.get("XDG_CONFIG_HOME", "")
    if not os.path.isabs(base):  # the specification: a relative path is to be ignored
        base = os.environ.get("APPDATA", "") if sys.platform == "win32" else ""
    return Path(base or Path.home() / ".config") / "heptarm"


def state_folder() -> Path:
    """Folder of what outlives a program: heptarm in XDG_STATE_HOME (~/.local/state), on Windows in LOCALAPPDATA."""
    base = os.environ.get("XDG_STATE_HOME") or os.environ.get("LOCALAPPDATA") or "~/.local/state"
    return Path(base).expanduser() / "heptarm"


def runtime_folder() -> Path:
    """Folder of what running programs have in common: heptarm in XDG_RUNTIME_DIR, otherwise in the temporary folder."""
    base = os.environ.get("XDG_RUNTIME_DIR", "")
    if base and os.path.isabs(base):
        return Path(base) / "heptarm"
    user = str(os.getuid()) if hasattr(os, "getuid") else os.environ.get("USERNAME", "user")
    return Path(tempfile.gettempdir()) / f"heptarm-{user}"


def private_folder(place: Path) -> Path:
    """Make a folder that only this user may enter; one that others may read is closed to them.

    Args:
        place: one of the folders above, or a folder in one of them. Those between are made private, too.

    Raises:
        OSError: it cannot be made; PermissionError: one of them is another user's, or anybody may write to it.
    """
    known = (settings_folder(), state_folder(), runtime_folder())
    root = next((folder for folder in known if folder == place or folder in place.parents), place)
    root.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    between = [parent for parent in place.parents if root in parent.parents or parent == root]
    for folder in (*reversed(between), place):
        folder.mkdir(mode=0o700, exist_ok=True)
        if is_private(folder):
            continue
        if not _is_ours(folder):
            text = "its folder is another user's: remove it, or make it yours with chown"
            raise PermissionError(errno.EACCES, text, str(folder))
        if folder.stat().st_mode & stat.S_IWOTH:
            text = "anybody can write to its folder: look what is in it, then chmod 700"
            raise PermissionError(errno.EACCES, text, str(folder))
        folder.chmod(stat.S_IMODE(folder.stat().st_mode) & ~_OTHERS)
    return place


def is_private(place: Path) -> bool:
    """Whether only this user may enter a folder."""
    return _is_ours(place) and (not hasattr(os, "getuid") or not place.stat().st_mode & _OTHERS)


def _is_ours(place: Path) -> bool:
    """Whether it is a folder of this user; a symbolic link has to be the user's as well."""
    if not hasattr(os, "getuid"):
        return place.is_dir()
    return place.is_dir() and {place.lstat().st_uid, place.stat().st_uid} == {os.getuid()}
