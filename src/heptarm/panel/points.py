"""Taught points: a list of places with names, kept as a JSON file, and the motions that visit them."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from heptarm.errors import CommandRejected, HeptarmError
from heptarm.values.checks import Array, Value, array, shown
from heptarm.values.motion.line import lin
from heptarm.values.motion.motion import Motion
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel, known_robot

#: What the file begins with, and its version.
_KIND, _VERSION = "heptarm points", 1
_LONGEST_NAME, _MOST = 64, 1000


@dataclass(frozen=True, slots=True, eq=False)
class TaughtPoint(Value):
    """A place of the arm that was taught.

    Attributes:
        name: unique in its list, up to 64 characters.
        q: joint positions, shape (7,) [rad].
        pose: of the motion frame in the base frame, with the tool that was attached.
        tool: name of that tool; empty: none.
        straight: approach it on a straight line (LIN), otherwise with all joints (PTP).
    """

    name: str
    q: Array
    pose: Pose
    tool: str = ""
    straight: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "q", array(self.q, 7, "q"))

    def motion(self) -> Motion:
        """The motion that ends here."""
        return lin(self.pose, near=self.q) if self.straight else ptp(self.q)


class PointList:
    """Taught points in the order in which they are visited.

    Args:
        robot: the robot on which they are taught.
    """

    def __init__(self, robot: RobotModel) -> None:
        self._robot = robot
        self._points: tuple[TaughtPoint, ...] = ()

    def __iter__(self) -> Iterator[TaughtPoint]:
        """The points in order."""
        return iter(self._points)

    def __len__(self) -> int:
        """Number of points."""
        return len(self._points)

    @property
    def names(self) -> tuple[str, ...]:
        """Names in order."""
        return tuple(point.name for point in self._points)

    def index(self, name: str) -> int:
        """Place of a point in the list.

        Raises:
            CommandRejected: there is none of that name.
        """
        if name not in self.names:
            raise CommandRejected(
                f"no point is named {shown(name)}",
                parameter="point",
                value=name,
                allowed=", ".join(self.names) or "none: the list is empty",
            )
        return self.names.index(name)

    def add(self, point: TaughtPoint, *, after: str = "") -> None:
        """Append a point, or insert it after another one.

        Raises:
            CommandRejected: its name is taken, empty or too long, or the list is full.
        """
        self._check_name(point.name)
        if len(self) >= _MOST:
            raise CommandRejected(f"a list has at most {_MOST} points", parameter="point")
        self._robot.check(point.q)
        at = self.index(after) + 1 if after else len(self)
        self._points = (*self._points[:at], point, *self._points[at:])

    def free_name(self) -> str:
        """A name that no point has: P1, P2 ..."""
        number = len(self) + 1
        while f"P{number}" in self.names:
            number += 1
        return f"P{number}"

    def rename(self, name: str, new: str) -> None:
        """Give a point another name.

        Raises:
            CommandRejected: there is no such point, or the new name is taken, empty or too long.
        """
        index = self.index(name)
        if new != name:
            self._check_name(new)
            self._put(index, replace(self._points[index], name=new))

    def delete(self, name: str) -> None:
        """Remove a point; raises CommandRejected if there is none of that name."""
        index = self.index(name)
        self._points = self._points[:index] + self._points[index + 1 :]

    def shift(self, name: str, by: int) -> None:
        """Move a point up (negative) or down the list, as far as it goes."""
        index = self.index(name)
        others = self._points[:index] + self._points[index + 1 :]
        to = min(max(index + by, 0), len(others))
        self._points = (*others[:to], self._points[index], *others[to:])

    def approach(self, name: str, *, straight: bool) -> None:
        """Choose how a point is approached."""
        index = self.index(name)
        self._put(index, replace(self._points[index], straight=straight))

    def _put(self, index: int, point: TaughtPoint) -> None:
        self._points = (*self._points[:index], point, *self._points[index + 1 :])

    def _check_name(self, name: str) -> None:
        if not name.strip() or len(name) > _LONGEST_NAME or re.search(r"[\x00-\x1f]", name):
            raise CommandRejected(
                f"the name of a point must have 1 to {_LONGEST_NAME} printable characters, got {shown(name)}",
                parameter="name",
                value=name,
            )
        if name in self.names:
            raise CommandRejected(
                f"a point is named {name!r} already", parameter="name", value=name, hint="choose another name"
            )

    # --------------------------------------------------------------------------------------- file

    def to_json(self) -> str:
        """The list as a file: angles in radians, positions in metres, quaternions x y z w."""
        points = [
            {
                "name": point.name,
                "move": "lin" if point.straight else "ptp",
                "q": point.q.tolist(),
                "pose": {"xyz": point.pose.xyz.tolist(), "quat": point.pose.quat.tolist()},
                "tool": point.tool,
            }
            for point in self._points
        ]
        content = {"kind": _KIND, "version": _VERSION, "robot": self._robot.name, "points": points}
        return json.dumps(content, indent=2, ensure_ascii=False) + "\n"

    def load(self, content: str | bytes) -> None:
        """Take the points of a file in place of those of the list; after an error the list is as before.

        Raises:
            CommandRejected: it is no such file, is of another robot, or a point is outside the joint limits.
        """
        found, where = PointList(self._robot), ""
        try:
            file = json.loads(content if isinstance(content, str) else content.decode("utf-8-sig"))
            if not isinstance(file, dict) or file.get("kind") != _KIND:
                raise ValueError(f'its "kind" is not "{_KIND}"')
            if file.get("version") != _VERSION:
                raise ValueError(f"its version is {shown(file.get('version'))}, known is {_VERSION}")
            robot = known_robot(file.get("robot", ""))  # what is mounted on it moves no joint
            if robot is None or robot.base_name != self._robot.base_name:
                raise ValueError(f"its robot is {shown(file.get('robot'))}, this one is {self._robot.name!r}")
            for number, entry in enumerate(file["points"], 1):
                where = f"point {number}: "
                found.add(_point(entry))
        except HeptarmError as error:
            error.text = f"{where}{error.text}"
            raise
        except Exception as error:  # of any values in place of a point's
            why = str(error) if isinstance(error, ValueError) else f"{type(error).__name__}: {error}"
            raise _unreadable(f"{where}{why}") from None
        self._points = tuple(found)

    def motions(self, names: Sequence[str]) -> list[Motion]:
        """The motions that visit points; raises CommandRejected if there is none of a name."""
        return [self._points[self.index(name)].motion() for name in names]


def _point(entry: dict[str, Any]) -> TaughtPoint:
    return TaughtPoint(
        name=str(entry["name"]),
        q=entry["q"],
        pose=Pose.of(entry["pose"]["xyz"], entry["pose"]["quat"]),
        tool=str(entry.get("tool", "")),
        straight={"lin": True, "ptp": False}[entry["move"]],
    )


def _unreadable(why: str) -> CommandRejected:
    return CommandRejected(
        f"this file has no taught points: {why}",
        parameter="file",
        hint="choose a file that the panel has saved",
    )
