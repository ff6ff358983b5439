"""`heptarm key`: make, store, list and forget the pre-shared keys of cabinets."""

from __future__ import annotations

import getpass
import sys
from typing import Annotated

from cyclopts import Parameter

from heptarm.arm.link.target import parse_target
from heptarm.cli.options import COMMON, Json, KeyFile
from heptarm.cli.output import emit
from heptarm.errors import CommandRejected
from heptarm.io.keys import (
    StoredKey,
    check_key,
    new_key,
    read_key_file,
    stored_key,
    stored_keys,
    write_key_file,
)

Address = Annotated[
    str,
    Parameter(name="--target", group=COMMON, help="Cabinet of the key: ADDRESS[:PORT] or sim://HOST:PORT."),
]
Replace = Annotated[
    bool, Parameter(name="--replace", negative="", help="Replace the key stored for this target.")
]


def new(*, target: Address = "", replace: Replace = False, as_json: Json = False) -> int:
    """Make a random key and print it; with --target, also store it for that cabinet.

    For example:

        heptarm key new --target 172.31.1.147
    """
    key = new_key()
    file = ""
    if target:
        place = locate(target)
        write_key_file(place.file, key, replace=replace)
        file = str(place.file)
    if as_json:
        emit({"key": key, "file": file})
        return 0
    print(key)
    if target:
        print(
            f"stored in {file}; set the same key in the cabinet's process data heptarm.key", file=sys.stderr
        )
    return 0


def store(
    *, target: Address, key_file: KeyFile = None, replace: Replace = False, as_json: Json = False
) -> int:
    """Store a key for a cabinet: typed, given on standard input, or taken from a file.

    For example:

        heptarm key set --target 172.31.1.147 --key-file ~/keys/lab1
    """
    place = locate(target)
    key = check_key(_typed(), "standard input") if key_file is None else read_key_file(key_file)
    write_key_file(place.file, key, replace=replace)
    emit({"file": str(place.file)}) if as_json else print(f"stored in {place.file}")
    return 0


def _typed() -> str:
    """Key from the terminal, not echoed, or from standard input."""
    return (getpass.getpass("key: ") if sys.stdin.isatty() else sys.stdin.readline()).strip()


def show(*, as_json: Json = False) -> int:
    """List the cabinets that have a stored key, and whether it can be used; keys are not shown."""
    keys = stored_keys()
    for key in keys:
        trouble = key.trouble
        if as_json:
            emit({"target": key.target, "file": str(key.file), "usable": not trouble, "trouble": trouble})
        else:
            print(f"{key.target:24} {trouble or key.file}")
    if not keys and not as_json:
        print("no keys are stored; `heptarm key new --target ADDRESS` makes one")
    return 1 if any(key.trouble for key in keys) else 0


def forget(*, target: Address, as_json: Json = False) -> int:
    """Delete the key stored for a cabinet."""
    place = locate(target)
    try:
        place.file.unlink()
    except FileNotFoundError:
        raise CommandRejected(
            f"no key is stored for {place.target}", parameter="target", hint="`heptarm key list` lists them"
        ) from None
    emit({"forgotten": place.target}) if as_json else print(f"the key for {place.target} is deleted")
    return 0


def locate(target: str) -> StoredKey:
    """Where the key of a target is stored.

    Raises:
        CommandRejected: it is a private simulator, which takes any key.
        ConnectFailed: it is no target.
    """
    parsed = parse_target(target)
    if parsed.is_private:
        raise CommandRejected(
            f"a key cannot be stored for {target}: each private simulator is a new cabinet",
            parameter="target",
            value=target,
            hint="name a cabinet as ADDRESS[:PORT], or a running simulator as sim://HOST:PORT",
        )
    return stored_key(parsed.host, parsed.port)
