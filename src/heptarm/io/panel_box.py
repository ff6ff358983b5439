"""What a program hands to an open panel of the same user: files in a folder that nobody else may enter.

A panel that somebody looks at has a folder of its own below `folder()`, and refreshes a card in it. A program writes a
plan there as numbers (`numpy.savez`), complete under its final name, and the panel takes it: numbers, no code. A card
that is no longer fresh is that of a panel that has ended, or that nobody looks at. The bodies of a world lie there as
long as the program shows them, and likewise count while their file is fresh.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import shutil
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from heptarm.io.folders import is_private, private_folder, runtime_folder
from heptarm.values.checks import Array, Value, array, frozen, numbers
from heptarm.values.mesh import Mesh
from heptarm.values.pose import Pose
from heptarm.values.shape import Shape
from heptarm.values.world import WorldArm, WorldBody, WorldOutline, checked_color

_CARD, _SUFFIX, _WORLD = "panel.json", ".npz", ".world.json"
#: Most samples of a plan that are handed over, and the largest files that are read, of a plan and of a world [bytes].
_MOST, _LARGEST, _LARGEST_WORLD = 2000, 4_000_000, 64_000_000
#: Age up to which a card or a world is fresh, and the one after which a folder is removed [s].
_FRESH, _OLD = 10.0, 86_400.0


@dataclass(frozen=True, slots=True, eq=False)
class PlanOutline(Value):
    """What a panel shows of a plan. n samples over time.

    Attributes:
        robot: name of the robot, such as "iiwa14".
        t: times from its beginning [s], shape (n,).
        q: joint positions, shape (n, 7) [rad].
        path: positions of the tool frame in the base, shape (n, 3) [m].
        touches: times at which bodies would touch [s], shape (m,).
    """

    robot: str
    t: Array
    q: Array
    path: Array
    touches: Array


def folder() -> Path:
    """Folder of this user's open panels: heptarm/panels in XDG_RUNTIME_DIR, otherwise in the temporary folder."""
    return runtime_folder() / "panels"


class PanelBox:
    """The folder of an open panel; where none can be made that is this user's alone, it stays empty.

    Args:
        robots: names of the robots that the panel shows.
    """

    def __init__(self, robots: Sequence[str]) -> None:
        self._folder: Path | None = None
        self._world: tuple[str, WorldOutline | None] = "", None
        self._robots = json.dumps(list(robots)).encode()
        with contextlib.suppress(OSError):
            self._folder = private_folder(folder() / str(os.getpid()))

    def take(self) -> PlanOutline | None:
        """The newest plan that has arrived since the last call, None: there is none; to be called every second."""
        if self._folder is None:
            return None
        newest: PlanOutline | None = None
        with contextlib.suppress(OSError):
            _put(self._folder / _CARD, self._robots)
            for file in sorted(self._folder.glob(f"*{_SUFFIX}"), key=lambda path: path.stat().st_mtime_ns):
                newest = _read(file) or newest
                file.unlink()
        return newest

    def world(self) -> WorldOutline | None:
        """The world that a program shows, the one shown last; None: none does. The same object until it changes."""
        if self._folder is None:
            return None
        with contextlib.suppress(OSError):
            for file in sorted(self._folder.glob(f"*{_WORLD}"), reverse=True):
                if time.time() - file.stat().st_mtime > _FRESH:
                    file.unlink()
                    continue
                if file.name != self._world[0]:
                    self._world = file.name, _read_world(file)
                return self._world[1]
        return None

    def close(self) -> None:
        """Remove the folder."""
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)


def hand_over(plan: PlanOutline) -> bool:
    """Give a plan to the open panel that shows its robot, the newest one of several; returns whether there is one."""
    keep = np.unique(np.linspace(0, len(plan.t) - 1, min(len(plan.t), _MOST)).astype(int))
    content = io.BytesIO()
    np.savez(
        content,
        robot=np.array(plan.robot),
        t=plan.t[keep],
        q=plan.q[keep],
        path=plan.path[keep],
        touches=plan.touches,
    )
    for place in _open_panels(plan.robot):
        with contextlib.suppress(OSError):
            _put(place / f"{time.time_ns()}{_SUFFIX}", content.getvalue())
            return True
    return False


class WorldFiles:
    """The files of one world in the folders of the open panels that show its robot.

    Args:
        robot: its name.
    """

    def __init__(self, robot: str) -> None:
        self._robot = robot
        self._name = f"{time.time_ns()}-{os.getpid()}"  # of several worlds the one that began last is shown
        self._changes = 0
        self._outline: WorldOutline | None = None
        self._content = b""
        self._written: dict[Path, Path] = {}

    def put(self, outline: WorldOutline) -> bool:
        """Write a world where it has changed, and keep it fresh; to be called every second.

        Returns:
            Whether there is an open panel.
        """
        if outline != self._outline:
            self._outline, self._content = outline, _world_json(outline)
            self._changes += 1
        name = f"{self._name}-{self._changes:09d}{_WORLD}"
        places = _open_panels(self._robot)
        for place in places:
            before = self._written.get(place)
            with contextlib.suppress(OSError):
                if before is not None and before.name == name and before.exists():
                    os.utime(before)
                    continue
                self._written[place] = place / name
                _put(place / name, self._content)
                if before is not None:
                    before.unlink(missing_ok=True)
        return bool(places)

    def remove(self) -> None:
        """Remove the files."""
        for file in self._written.values():
            with contextlib.suppress(OSError):
                file.unlink(missing_ok=True)
        self._written = {}


def _open_panels(robot: str) -> list[Path]:
    """Folders of the open panels that show a robot, the newest first."""
    found, now = [], time.time()
    with contextlib.suppress(OSError):
        for place in folder().iterdir():
            if not place.name.isdigit() or not is_private(place):
                continue
            with contextlib.suppress(OSError, ValueError):
                card = place / _CARD
                age = now - (card if card.exists() else place).stat().st_mtime
                if age > _OLD:
                    shutil.rmtree(place, ignore_errors=True)
                elif age < _FRESH and robot in json.loads(card.read_text(encoding="utf-8")):
                    found.append((place.stat().st_ctime_ns, place))
    return [place for _, place in sorted(found, reverse=True)]


def _put(file: Path, content: bytes) -> None:
    """Write a file that is complete as soon as it has its name."""
    handle, name = tempfile.mkstemp(dir=file.parent)
    with open(handle, "wb") as stream:
        stream.write(content)
    os.replace(name, file)


def _read(file: Path) -> PlanOutline | None:
    """A plan of a file; None: it is none."""
    if file.stat().st_size > _LARGEST:
        return None
    try:
        with np.load(io.BytesIO(file.read_bytes()), allow_pickle=False) as found:
            plan = PlanOutline(
                str(found["robot"]),
                *(np.asarray(found[name], float) for name in ("t", "q", "path", "touches")),
            )
    except Exception:  # of any bytes in place of a plan
        return None
    if plan.t.ndim != 1:
        return None
    count = len(plan.t)
    shapes = plan.t.shape == (count,) and plan.q.shape == (count, 7) and plan.path.shape == (count, 3)
    finite = all(np.isfinite(array).all() for array in (plan.t, plan.q, plan.path, plan.touches))
    return plan if count and shapes and finite else None


# ------------------------------------------------------------------------------------------- worlds


def _world_json(outline: WorldOutline) -> bytes:
    """A world as JSON."""
    arms = [
        {
            "name": arm.name,
            "robot": arm.robot,
            "pose": _pose_json(arm.pose),
            "q": arm.q.tolist(),
            "shapes": [_shape_json(shape) for shape in arm.shapes],
        }
        for arm in outline.arms
    ]
    found = {
        "robot": outline.robot,
        "scene": outline.scene,
        "bodies": [_body_json(body) for body in outline.bodies],
        "placed": [_body_json(body) for body in outline.placed],
        "arms": arms,
    }
    return json.dumps(found).encode()


def _body_json(body: WorldBody) -> dict[str, Any]:
    return {
        "name": body.name,
        "shapes": [_shape_json(shape) for shape in body.shapes],
        "pose": _pose_json(body.pose),
        "points": body.points.tolist(),
        "radius": body.radius,
        "color": body.color,
        "is_held": body.is_held,
    }


def _shape_json(shape: Shape | Mesh) -> dict[str, Any]:
    if isinstance(shape, Mesh):
        found = {"vertices": shape.vertices.tolist(), "faces": shape.faces.tolist()}
    else:
        found = {"kind": shape.kind, "size": shape.size.tolist()}
    return found | {"pose": _pose_json(shape.pose)}


def _pose_json(pose: Pose) -> list[list[float]]:
    return [pose.xyz.tolist(), pose.quat.tolist()]


def _read_world(file: Path) -> WorldOutline | None:
    """A world of a file; None: it is none."""
    if file.stat().st_size > _LARGEST_WORLD:
        return None
    try:
        found = json.loads(file.read_bytes())
        arms = [
            WorldArm(
                str(arm["name"]),
                str(arm["robot"]),
                Pose.of(*arm["pose"]),
                array(arm["q"], 7, "q"),
                tuple(shape for shape in map(_shape_of, arm["shapes"]) if isinstance(shape, Shape)),
            )
            for arm in found["arms"]
        ]
        return WorldOutline(
            str(found["robot"]),
            str(found["scene"]),
            tuple(map(_body_of, found["bodies"])),
            tuple(map(_body_of, found["placed"])),
            tuple(arms),
        )
    except Exception:  # of any bytes in place of a world
        return None


def _body_of(found: dict[str, Any]) -> WorldBody:
    return WorldBody(
        str(found["name"]),
        tuple(map(_shape_of, found["shapes"])),
        Pose.of(*found["pose"]),
        frozen(numbers(found["points"], "points").reshape(-1, 3)),
        float(found["radius"]),
        checked_color(found["color"]),
        bool(found["is_held"]),
    )


def _shape_of(found: dict[str, Any]) -> Shape | Mesh:
    pose = Pose.of(*found["pose"])
    if "faces" in found:
        return Mesh(numbers(found["vertices"], "vertices"), np.array(found["faces"], np.int64), pose)
    return Shape(found["kind"], array(found["size"], 3, "size"), pose)
