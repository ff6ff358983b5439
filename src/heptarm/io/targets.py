"""Saved targets: robots by name, in a file that a person can read and edit.

The file is heptarm/targets.toml in the folder of the user's settings, one table per target::

    [lab1]
    address = "172.31.1.147"
    key_file = "~/keys/lab1"     # otherwise the key is looked up as for any address
    tool = "gripper"             # attached when a client takes control
    speed = 0.3                  # ceiling of the speed; otherwise 0.25 of a real robot, 1 of a simulator
    flange = "touch"             # media flange of the robot

    [lab1.tools.gripper]         # a tool that was measured, see heptarm.calibration
    mass = 1.2
    com = [0.0, 0.0, 0.06]
    frames.tcp = [0.0, 0.0, 0.15, 0.0, 0.0, 0.0, 1.0]

    [lab1.cameras.wrist]         # a camera that was measured
    frame = "flange"
    pose = [0.06, 0.0, 0.04, 0.0, 0.0, 0.0, 1.0]
    matrix = [[600.0, 0.0, 320.0], [0.0, 600.0, 240.0], [0.0, 0.0, 1.0]]

When a target was last used is the time of a file of its name in the folder beside it.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from heptarm.errors import CommandRejected
from heptarm.io.folders import private_folder, settings_folder
from heptarm.values.camera import MountedCamera
from heptarm.values.checks import shown
from heptarm.values.files import read_text
from heptarm.values.pose import Pose
from heptarm.values.robot import flange
from heptarm.values.tool import Tool

try:
    import tomllib
except ModuleNotFoundError:  # Python 3.10
    import tomli as tomllib  # type: ignore[no-redef]

#: Names of targets: no name of a host that has a dot, and no address.
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
#: Longest name of a target [characters].
_LONGEST_NAME = 64
#: Names that mean something else.
_TAKEN = ("localhost", "sim")
_KEYS = ("address", "key_file", "tool", "speed", "flange")
#: The table of tools of a target, and what each of them may have: no shapes, which only a program knows.
_TOOLS = "tools"
_TOOL_KEYS = ("mass", "com", "inertia", "frames")
#: The table of cameras of a target, and what each of them may have.
_CAMERAS = "cameras"
_CAMERA_KEYS = ("frame", "pose", "matrix", "distortion")


@dataclass(frozen=True, slots=True)
class SavedTarget:
    """A target that has a name.

    Attributes:
        name: by which programs and commands call it.
        address: what to connect to, as in `heptarm.connect`.
        key_file: file with the key; "": the key is looked up elsewhere.
        tool: attached when a client takes control; "": none.
        speed: ceiling of the speed of all motions, (0, 1]; None: 0.25 of a real robot, 1 of a simulator.
        flange: media flange of the robot: "plain", "touch", or its height [m]; "": not stated.
        tools: tools that arms of this target know by name.
        cameras: cameras that were measured.
    """

    name: str
    address: str
    key_file: str = ""
    tool: str = ""
    speed: float | None = None
    flange: str = ""
    tools: tuple[Tool, ...] = ()
    cameras: tuple[MountedCamera, ...] = ()

    @property
    def last_used(self) -> float | None:
        """When a client last connected to it, in seconds since 1970; None: never."""
        try:
            return _mark(self.name).stat().st_mtime
        except OSError:
            return None

    def mark_used(self) -> None:
        """Note that a client has connected to it; where that cannot be written, nothing is noted."""
        with contextlib.suppress(OSError):
            private_folder(_mark(self.name).parent)
            _mark(self.name).touch()


def targets_file() -> Path:
    """File of the saved targets."""
    return settings_folder() / "targets.toml"


def _mark(name: str) -> Path:
    return settings_folder() / "targets.used" / name


def saved_targets() -> dict[str, SavedTarget]:
    """The saved targets by name, in the order of their file.

    Raises:
        CommandRejected: the file cannot be read, or an entry is not right; the text names it.
    """
    file = targets_file()
    try:
        tables = tomllib.loads(_content())
    except CommandRejected as error:
        raise CommandRejected(
            f"the file of saved targets {error.text}", parameter="target", hint=error.hint
        ) from None
    except (ValueError, RecursionError) as error:
        raise CommandRejected(
            f"the file of saved targets {file} cannot be read: {error}",
            parameter="target",
            hint="correct it with an editor",
        ) from None
    return {name: _read(name, table) for name, table in tables.items()}


def saved_target(name: str) -> SavedTarget | None:
    """The saved target of this name; None: there is none."""
    return saved_targets().get(name) if _NAME.fullmatch(name) else None


def _read(name: str, table: Any) -> SavedTarget:
    """An entry of the file."""
    where = f"[{name}] in {targets_file()}"
    if not isinstance(table, dict) or not isinstance(table.get("address"), str):
        raise CommandRejected(
            f"{where} must have an address",
            parameter=name,
            hint='write address = "172.31.1.147" below its name',
        )
    _refuse_unknown(table, (*_KEYS, _TOOLS, _CAMERAS), where, name)
    values = {key: table[key] for key in _KEYS if key in table}
    for kind, read in ((_TOOLS, _read_tool), (_CAMERAS, _read_camera)):
        entries = table.get(kind, {})
        if not isinstance(entries, dict):
            raise CommandRejected(
                f"{where}: {kind} must be tables", parameter=name, hint=f"write [{name}.{kind}.NAME]"
            )
        values[kind] = tuple(read(one, content, where) for one, content in entries.items())
    if isinstance(values.get("flange"), float):  # a height may be a number
        values["flange"] = f"{values['flange']:g}"
    return check_target(SavedTarget(name, **values), where)


def _refuse_unknown(table: dict[str, Any], allowed: tuple[str, ...], where: str, name: str) -> None:
    if unknown := sorted(set(table) - set(allowed)):
        raise CommandRejected(
            f"{where} has {', '.join(unknown)}, which no such entry has",
            parameter=name,
            allowed=", ".join(allowed),
            hint=f"it may have {', '.join(allowed)}",
        )


def _read_tool(name: str, table: Any, where: str) -> Tool:
    """A tool of an entry of the file."""
    where = f"tool {name} of {where}"
    if not isinstance(table, dict):
        raise CommandRejected(f"{where} must be a table", parameter=name)
    _refuse_unknown(table, _TOOL_KEYS, where, name)
    try:
        frames = table.get("frames", {})
        poses = {frame: Pose.of(numbers[:3], numbers[3:]) for frame, numbers in frames.items()}
        return Tool(name, **{key: value for key, value in table.items() if key != "frames"}, frames=poses)
    except (CommandRejected, AttributeError, TypeError) as error:
        raise CommandRejected(
            f"{where}: {error}", parameter=name, hint="a frame is x y z qx qy qz qw, in metres"
        ) from None


def _read_camera(name: str, table: Any, where: str) -> MountedCamera:
    """A camera of an entry of the file."""
    where = f"camera {name} of {where}"
    if not isinstance(table, dict):
        raise CommandRejected(f"{where} must be a table", parameter=name)
    _refuse_unknown(table, _CAMERA_KEYS, where, name)
    try:
        pose = Pose.of(table["pose"][:3], table["pose"][3:])
        return MountedCamera(name, **{**table, "pose": pose})
    except (CommandRejected, KeyError, TypeError) as error:
        raise CommandRejected(
            f"{where}: {error}",
            parameter=name,
            hint="it has frame, pose (x y z qx qy qz qw, in metres) and matrix",
        ) from None


def check_target(target: SavedTarget, where: str) -> SavedTarget:
    """Check a target.

    Args:
        target: the target; returned.
        where: where it comes from, for the error.

    Raises:
        CommandRejected: its name or a value is not allowed.
    """
    name, speed = target.name, target.speed
    if not _NAME.fullmatch(name) or name in _TAKEN or len(name) > _LONGEST_NAME:
        raise CommandRejected(
            f"the name of a target must begin with a letter and have up to {_LONGEST_NAME} letters, digits, - and _, "
            f"got {shown(name)}",
            parameter="name",
            value=name,
            hint=f"also {' and '.join(_TAKEN)} mean something else; choose a name such as lab1",
        )
    for key in ("address", "key_file", "tool", "flange"):
        if not isinstance(getattr(target, key), str):
            raise CommandRejected(f"{where}: {key} must be a text", parameter=key)
        if "\0" in getattr(target, key):
            raise CommandRejected(
                f"{where}: {key} must have no NUL, got {shown(getattr(target, key))}", parameter=key
            )
    if speed is not None and (
        isinstance(speed, bool) or not isinstance(speed, (int, float)) or not 0.0 < speed <= 1.0
    ):
        raise CommandRejected(
            f"{where}: speed must be in (0, 1], got {speed!r}",
            parameter="speed",
            value=speed,
            allowed="(0, 1]",
            hint="it is a fraction of the full speed",
        )
    if target.flange:
        try:
            flange(target.flange)
        except CommandRejected as error:
            raise CommandRejected(
                f"{where}: {error.text}", parameter="flange", value=target.flange, hint=error.hint
            ) from None
    return target


def add_target(target: SavedTarget, *, replace: bool = False) -> None:
    """Add a target to the file; what else is in the file stays as it is.

    Raises:
        CommandRejected: the target is not right, or there is one of this name and it is not to be replaced.
    """
    check_target(target, "the new target")
    if target.name in saved_targets():
        if not replace:
            raise CommandRejected(
                f"there is a target {target.name}", parameter="name", hint="replace it with --replace"
            )
        kept = saved_targets()[target.name]  # what was measured would be lost otherwise
        target = dataclasses.replace(
            target, tools=target.tools or kept.tools, cameras=target.cameras or kept.cameras
        )
        remove_target(target.name)
    lines = [f"[{target.name}]", f"address = {_text(target.address)}"]
    lines += [
        f"{key} = {_text(getattr(target, key))}"
        for key in ("key_file", "tool", "flange")
        if getattr(target, key)
    ]
    if target.speed is not None:
        lines.append(f"speed = {float(target.speed)!r}")
    for tool in target.tools:
        lines += ["", *_tool_lines(target.name, tool)]
    for camera in target.cameras:
        lines += ["", *_camera_lines(target.name, camera)]
    _write(_joined(_content(), lines))


def save_tool(target: str, tool: Tool) -> None:
    """Save a tool with a saved target, in place of one of its name; what else is in the file stays as it is.

    Its shapes are not saved.

    Raises:
        CommandRejected: there is no such target, or the file cannot be changed.
    """
    _save(target, _TOOLS, tool.name, _tool_lines(target, tool))


def save_camera(target: str, camera: MountedCamera) -> None:
    """Save a camera with a saved target, in place of one of its name; what else is in the file stays as it is.

    Raises:
        CommandRejected: there is no such target, or the file cannot be changed.
    """
    _save(target, _CAMERAS, camera.name, _camera_lines(target, camera))


def _save(target: str, kind: str, name: str, lines: list[str]) -> None:
    """Save a table of tools or cameras of a target.

    Raises:
        CommandRejected: there is no such target, or the file cannot be changed.
    """
    if target not in saved_targets():
        raise CommandRejected(
            f"there is no target {target}",
            parameter="target",
            value=target,
            hint="save it first: heptarm targets add NAME ADDRESS",
        )
    text = _joined(_without(target, kind, name), lines)
    try:
        tomllib.loads(text)
    except ValueError:  # such as one that a person has written as an inline table
        raise CommandRejected(
            f"{kind}.{name} of the target {target} in {targets_file()} cannot be replaced: it has no table of its own",
            parameter=kind.removesuffix("s"),
            hint=f"remove it with an editor, or write it as [{target}.{kind}.{name}]",
        ) from None
    _write(text)


def _camera_lines(target: str, camera: MountedCamera) -> list[str]:
    """A camera as lines of the file."""
    table = ".".join(map(_text, (target, _CAMERAS, camera.name)))
    numbers = {"pose": camera.pose.array, "matrix": camera.matrix, "distortion": camera.distortion}
    rows = (f"{key} = {value.tolist()}" for key, value in numbers.items())
    return [f"[{table}]", f"frame = {_text(camera.frame)}", *rows]


def _tool_lines(target: str, tool: Tool) -> list[str]:
    """A tool as lines of the file; its shapes are left out."""
    table = ".".join(map(_text, (target, _TOOLS, tool.name)))
    numbers = {"mass": tool.mass, "com": tool.com.tolist(), "inertia": tool.inertia.tolist()}
    numbers |= {f"frames.{_text(name)}": pose.array.tolist() for name, pose in tool.frames}
    return [f"[{table}]", *(f"{key} = {value}" for key, value in numbers.items())]


def _joined(text: str, lines: list[str]) -> str:
    before = text.rstrip("\n")
    return (f"{before}\n\n" if before else "") + "\n".join(lines) + "\n"


def _without(target: str, *entry: str) -> str:
    """The text of the file without the tables of a target, or without one of them: "tools" or "cameras", and a name."""
    kept, inside = [], False
    for line in _content().splitlines():
        if line.lstrip().startswith("["):
            path = _path(line)
            inside = path[: 1 + len(entry)] == [target, *entry]
        if not inside:
            kept.append(line)
    return "\n".join(kept).strip("\n") + "\n" if any(kept) else ""


def _path(line: str) -> list[str]:
    """Names of the table that a line of the file begins: [lab1.tools."my gripper"]; empty: it begins none."""
    try:
        table: Any = tomllib.loads(line)
    except ValueError:
        return []
    path = []
    while isinstance(table, dict) and table:
        ((name, table),) = table.items()
        path.append(name)
    return path


def remove_target(name: str) -> None:
    """Remove a target from the file.

    Raises:
        CommandRejected: there is none of this name.
    """
    known = saved_targets()
    if name not in known:
        raise CommandRejected(
            f"there is no target {name}",
            parameter="name",
            value=name,
            hint=f"saved are {', '.join(known)}" if known else "none is saved",
        )
    _write(_without(name))
    with contextlib.suppress(OSError):
        _mark(name).unlink()


def _text(value: str) -> str:
    """A string as TOML writes it; JSON writes it in the same form."""
    return json.dumps(value, ensure_ascii=False)


def _content() -> str:
    """The text of the file; empty: there is none.

    Raises:
        CommandRejected: it cannot be read.
    """
    file = targets_file()
    return read_text(file, name="target") if os.path.lexists(file) else ""


def _write(text: str) -> None:
    """Replace the file at once.

    Raises:
        CommandRejected: it cannot be written.
    """
    file = targets_file()
    part = file.with_name(f".{file.name}.{os.getpid()}")
    try:
        private_folder(file.parent)
        part.write_text(text, encoding="utf-8")
        part.replace(file)
    except OSError as error:
        raise CommandRejected(
            f"the file of saved targets {file} cannot be written: {(error.strerror or str(error)).lower()}",
            parameter="name",
        ) from None
