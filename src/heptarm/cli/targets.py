"""`heptarm targets`: list, add and remove robots that have a name."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from heptarm.arm.link.target import parse_target
from heptarm.cli.options import Json
from heptarm.cli.output import emit
from heptarm.errors import CommandRejected
from heptarm.io.keys import read_key_file, stored_key
from heptarm.io.targets import SavedTarget, add_target, remove_target, saved_targets, targets_file

Name = Annotated[str, Parameter(help="Name of the target, such as lab1.")]


def show(*, as_json: Json = False) -> int:
    """List the saved targets: address, key, tool, speed, and when each was last used."""
    found = saved_targets()
    for target in found.values():
        used = (
            "never"
            if target.last_used is None
            else f"{datetime.fromtimestamp(target.last_used):%Y-%m-%d %H:%M}"
        )
        if as_json:
            emit(
                {"name": target.name, "address": target.address, "key": _key(target), "tool": target.tool}
                | {"speed": target.speed, "flange": target.flange}
                | {"last_used": None if target.last_used is None else used}
            )
            continue
        more = [f"key: {_key(target) or 'none'}"]
        more += [f"tool: {target.tool}"] if target.tool else []
        more += [f"speed: {target.speed:g}"] if target.speed is not None else []
        more += [f"flange: {target.flange}"] if target.flange else []
        print(f"{target.name:12} {target.address:24} {', '.join(more)}; last used: {used}")
    if not found and not as_json:
        print("no targets are saved; `heptarm targets add lab1 172.31.1.147` saves one")
    return 0


def _key(target: SavedTarget) -> str:
    """The file of its key; empty: there is none."""
    if target.key_file:
        return target.key_file
    parsed = parse_target(target.address)
    stored = None if parsed.is_private else stored_key(parsed.host, parsed.port)
    return str(stored.file) if stored is not None and stored.file.exists() else ""


def add(
    name: Name,
    address: Annotated[str, Parameter(help="ADDRESS[:PORT], sim://HOST:PORT or sim://iiwa14.")],
    /,
    *,
    key_file: Annotated[
        Path | None,
        Parameter(name="--key-file", help="File with its key. Default: the key stored for its address."),
    ] = None,
    tool: Annotated[str, Parameter(help="Tool that is attached when a client takes control.")] = "",
    speed: Annotated[
        float | None,
        Parameter(
            help="Ceiling of the speed of all motions, (0, 1]. Default: 0.25 of a real robot, 1 of a simulator."
        ),
    ] = None,
    flange: Annotated[
        str, Parameter(help="Media flange of the robot: plain, touch, or its height above a plain one [m].")
    ] = "",
    replace: Annotated[
        bool, Parameter(name="--replace", negative="", help="Replace the target of this name.")
    ] = False,
    as_json: Json = False,
) -> int:
    """Save a target under a name: from then on --target NAME, and heptarm.connect("NAME"), mean it.

    For example:

        heptarm targets add lab1 172.31.1.147 --key-file ~/keys/lab1 --speed 0.3
    """
    if parse_target(address).name:
        raise CommandRejected(
            f"{address} is the name of a saved target",
            parameter="address",
            value=address,
            hint="give its address",
        )
    place = ""
    if key_file is not None:
        read_key_file(key_file)
        place = str(key_file.expanduser().resolve())
    add_target(SavedTarget(name, address, place, tool, speed, flange), replace=replace)
    emit({"name": name, "file": str(targets_file())}) if as_json else print(
        f"{name} is {address} from now on"
    )
    return 0


def remove(name: Name, /, *, as_json: Json = False) -> int:
    """Remove a saved target; its key stays, see `heptarm key forget`."""
    remove_target(name)
    emit({"removed": name}) if as_json else print(f"{name} is removed")
    return 0
