"""Pre-shared keys of cabinets: where they are looked up, how they are stored, and how strong they must be.

A key is a text that both sides know. It is never an argument of a process, and never a parameter of a ROS node. The
order of the search is the same for every command and every program: given explicitly (as text or as a file), the
environment variable HEPTARM_KEY, the file of the target in the folder of `key_folder`.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import stat
import sys
from dataclasses import dataclass
from math import log2
from pathlib import Path
from urllib.parse import quote, unquote

from heptarm.errors import CommandRejected
from heptarm.io.folders import private_folder, settings_folder
from heptarm.values.files import open_regular, path_of

#: Environment variable with a key.
VARIABLE = "HEPTARM_KEY"
#: Least strength of a key [bits]; see `strength`.
MIN_BITS = 80.0
#: Least number of different characters in a key.
MIN_DIFFERENT = 8

#: Letters and digits of a generated key; those that look alike (0 o, 1 l) are left out, since a person types them.
_ALPHABET = "abcdefghijkmnpqrstuvwxyz23456789"
_GROUPS, _GROUP = 7, 4
#: Longest key file that is read [bytes].
_MAX_FILE = 4096
_SUFFIX = ".key"
_LOCAL = {"localhost": "127.0.0.1", "0.0.0.0": "127.0.0.1", "::": "::1"}


def new_key() -> str:
    """Make a random key of 140 bits: seven groups of four letters and digits that a person can type."""
    groups = ("".join(secrets.choice(_ALPHABET) for _ in range(_GROUP)) for _ in range(_GROUPS))
    return "-".join(groups)


def strength(key: str) -> float:
    """Upper bound of a key's strength [bits]: its length times log2 of the number of different characters."""
    return len(key) * log2(max(1, len(set(key))))


def check_key(key: str, source: str) -> str:
    """Check that a key is strong enough, and that it can be typed.

    Args:
        key: the key; it never appears in an error.
        source: where it comes from, for the error.

    Returns:
        The key.

    Raises:
        CommandRejected: it is too weak, or has characters that cannot be printed.
    """
    if not key.isprintable() or key != key.strip():
        raise CommandRejected(
            f"the key of {source} must be one line of printable characters without blanks at its ends",
            parameter="key",
            hint="make one with `heptarm key new`",
        )
    if strength(key) < MIN_BITS or len(set(key)) < MIN_DIFFERENT:
        raise CommandRejected(
            f"the key of {source} must have at least {MIN_BITS:.0f} bits and {MIN_DIFFERENT} different characters, got "
            f"{strength(key):.0f} bits ({len(key)} characters, {len(set(key))} of them different)",
            parameter="key",
            allowed=f"at least {MIN_BITS:.0f} bits, such as 20 characters with 16 different ones",
            hint="make one with `heptarm key new`",
        )
    return key


def read_key_file(file: Path) -> str:
    """Read a key from a file: its only line, readable by its owner alone.

    Raises:
        CommandRejected: the file cannot be read, other users may read it, or its content is no usable key.
    """
    try:
        with open_regular(file, name="key_file") as opened:
            mode = stat.S_IMODE(os.fstat(opened.fileno()).st_mode)
            content = opened.read(_MAX_FILE + 1)
    except CommandRejected as error:
        raise CommandRejected(
            f"the key file {error.text}",
            parameter="key_file",
            value=str(file),
            hint="name a file with the key as its only line, or store the key with `heptarm key set --target ADDRESS`",
        ) from None
    if sys.platform != "win32" and mode & 0o077:
        raise CommandRejected(
            f"the key file {file} must have mode 0600, got {mode:04o}: other users of this machine can read it",
            parameter="key_file",
            value=f"{mode:04o}",
            allowed="0600 or 0400",
            hint=f"chmod 600 {file}, and make a new key if somebody may have read it",
        )
    try:
        text = content.decode().removeprefix("\ufeff").strip() if len(content) <= _MAX_FILE else ""
    except UnicodeDecodeError:
        text = ""
    if not text or len(text.splitlines()) != 1:
        raise CommandRejected(
            f"the key file {file} must contain the key as its only line",
            parameter="key_file",
            value=str(file),
            hint="make one with `heptarm key new --target ADDRESS`",
        )
    return check_key(text, f"the file {file}")


def write_key_file(file: Path, key: str, *, replace: bool = False) -> None:
    """Write a key to a file that only its owner can read; folders are made as needed.

    Raises:
        CommandRejected: the file exists and is not to be replaced, or it cannot be written.
    """
    try:
        if settings_folder() in file.parents:
            private_folder(file.parent)
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if file.exists() and not replace:
            raise CommandRejected(
                f"the key file {file} exists",
                parameter="key_file",
                value=str(file),
                hint="replace it with --replace",
            )
        # a new file takes the place of the old one at once, and is never readable by others
        part = file.with_name(f".{file.name}.{os.getpid()}")
        with contextlib.suppress(FileNotFoundError):
            part.unlink()
        with os.fdopen(
            os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8"
        ) as opened:
            opened.write(f"{key}\n")
        part.replace(file)
    except OSError as error:
        raise CommandRejected(
            f"the key file {file} cannot be written: {(error.strerror or str(error)).lower()}",
            parameter="key_file",
            value=str(file),
        ) from None


def key_folder() -> Path:
    """Folder of the stored keys."""
    return settings_folder() / "keys"


@dataclass(frozen=True, slots=True)
class StoredKey:
    """A key that is stored for a target.

    Attributes:
        host: name or address of the target.
        port: its TCP port.
        file: where the key is.
    """

    host: str
    port: int
    file: Path

    @property
    def target(self) -> str:
        """The target as text."""
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"

    @property
    def trouble(self) -> str:
        """Why the key cannot be used; empty: it can."""
        try:
            read_key_file(self.file)
        except CommandRejected as error:
            return str(error)
        return ""


def stored_key(host: str, port: int) -> StoredKey:
    """Locate the key of a target, whether it exists or not; localhost is 127.0.0.1."""
    name = _LOCAL.get(host.lower(), host.lower())
    return StoredKey(name, port, key_folder() / f"{quote(name, safe='')}_{port}{_SUFFIX}")


def stored_keys() -> tuple[StoredKey, ...]:
    """List the stored keys, by target."""
    found = []
    for file in sorted(key_folder().glob(f"*{_SUFFIX}")):
        host, _, port = file.name.removesuffix(_SUFFIX).rpartition("_")
        if host and port.isdecimal():
            found.append(StoredKey(unquote(host), int(port), file))
    return tuple(found)


def find_key(
    *, key: str | None = None, key_file: str | Path | None = None, host: str = "", port: int = 0
) -> str | None:
    """Find the key for a target.

    Args:
        key: given explicitly; "": no key, and nothing else is looked up.
        key_file: given explicitly: a file with the key.
        host: name or address of the target, for the stored keys; empty: none are looked up.
        port: its TCP port.

    Returns:
        The key; None: there is none.

    Raises:
        CommandRejected: key and key_file are both given, or the first key found cannot be used: it is too weak, or its
            file can be read by other users.
    """
    if key is not None and key_file is not None:
        raise CommandRejected(
            "key and key_file cannot be combined", parameter="key_file", hint="give one of them"
        )
    if key is not None:
        return check_key(key, "the argument `key`") if key else None
    if key_file is not None:
        return read_key_file(path_of(key_file, "key_file").expanduser())
    if value := os.environ.get(VARIABLE, ""):
        return check_key(value.strip(), f"the environment variable {VARIABLE}")
    if host and os.path.exists(
        (stored := stored_key(host, port)).file
    ):  # False, too, for names that no file can have
        return read_key_file(stored.file)
    return None


def environment(key: str | None) -> dict[str, str]:
    """Environment for a child process that uses this key, and no other; an environment is visible to its user only."""
    variables = {name: value for name, value in os.environ.items() if name != VARIABLE}
    return variables if key is None else variables | {VARIABLE: key}
