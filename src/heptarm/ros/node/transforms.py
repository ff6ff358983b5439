"""Where the frames are that others publish on /tf and /tf_static, as far as they are connected with the arm's base.

A pose of a time is asked for, as a camera looked from where the arm was then: transforms are kept for ten seconds, and
what lies between two of them is interpolated. tf2 does the same; it is not used, as no package index has it. Without a
time it is now: of flange and tool the newest state counts, and what else moves must have been seen a moment ago.
"""

from __future__ import annotations

import threading
from bisect import bisect
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from heptarm.errors import HeptarmError, NotReady, ShapeError
from heptarm.values.pose import Pose
from heptarm.values.shape import ORIGIN

#: How long transforms are kept, as tf2 does [s].
_KEPT = 10.0
#: The newest transform counts for so long [s].
_FRESH = 0.5
#: Most frames from one to the root.
_DEEPEST = 100


class _Edge:
    """A frame in its parent, through time.

    Args:
        parent: name of the parent.
        is_static: one pose counts for all times.
    """

    def __init__(self, parent: str, *, is_static: bool) -> None:
        self.parent, self.is_static = parent, is_static
        self.times: deque[float] = deque()
        self.poses: deque[Pose] = deque()

    @classmethod
    def fixed(cls, parent: str, pose: Pose) -> _Edge:
        """One that does not move."""
        made = cls(parent, is_static=True)
        made.add(0.0, pose)
        return made

    def add(self, time: float, pose: Pose) -> None:
        """Keep a pose; one that is not newer than the newest is left out."""
        if self.is_static or (self.times and time < self.times[-1] - _KEPT):
            self.times.clear()
            self.poses.clear()
        elif self.times and time <= self.times[-1]:
            return
        self.times.append(time)
        self.poses.append(pose)
        while self.times[0] < time - _KEPT:
            self.times.popleft()
            self.poses.popleft()

    def at(self, name: str, time: float) -> Pose:
        """The pose at a time [s].

        Raises:
            NotReady: nothing is known of it.
        """
        newest = self.times[-1]
        if self.is_static or newest <= time <= newest + _FRESH:
            return self.poses[-1]
        if not self.times[0] <= time <= newest:
            raise NotReady(
                f"{name!r} must have been on /tf {newest - time:.2f} s before its newest transform, the oldest is of "
                f"{newest - self.times[0]:.2f} s before",
                parameter="frame_id",
                value=name,
                hint="check that it is published all the time, and the clocks of the machines; a stamp of 0 takes "
                "the newest",
            )
        after = bisect(self.times, time)
        first, second = self.times[after - 1], self.times[after]
        return self.poses[after - 1].interpolate(self.poses[after], (time - first) / (second - first))


class Transforms:
    """The frames of /tf; thread-safe.

    Args:
        clock: the time of ROS [s].
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock, self._lock = clock, threading.Lock()
        self._edges: dict[str, _Edge] = {}

    def add(self, message: Any, *, is_static: bool = False) -> None:
        """Take a tf2_msgs/TFMessage.

        Args:
            message: the message.
            is_static: of /tf_static.

        Raises:
            ShapeError: one of its transforms is no rotation, or has a number that is not finite; the others are taken.
        """
        wrong: HeptarmError | None = None
        for one in message.transforms:
            parent, name = one.header.frame_id.lstrip("/"), one.child_frame_id.lstrip("/")
            place, turn = one.transform.translation, one.transform.rotation
            try:
                pose = Pose.of((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))
            except HeptarmError as error:
                wrong = ShapeError(f"the transform of {name!r} is refused: {error}", parameter="transforms")
                continue
            with self._lock:
                edge = self._edges.get(name)
                if edge is None or edge.parent != parent or edge.is_static != is_static:
                    edge = self._edges[name] = _Edge(parent, is_static=is_static)
                edge.add(_seconds(one.header.stamp), pose)
        if wrong is not None:
            raise wrong

    def find(self, name: str, *, base: str, stamp: Any, own: Mapping[str, Pose]) -> Pose:
        """Pose of a frame in another one.

        Args:
            name: of the frame.
            base: the other one.
            stamp: the time, of a header; 0: now, as far as all transforms between them are there.
            own: where frames of this arm are in the other one now.

        Raises:
            NotReady: they are not connected, or not known at that time.
        """
        time = _seconds(stamp)
        with self._lock:
            edges = dict(self._edges)
            if time == 0.0:
                edges |= {one: _Edge.fixed(base, pose) for one, pose in own.items()}
            up, down = _path(edges, name), _path(edges, base)
            while up and down and up[-1] == down[-1]:  # what both have in common
                up.pop()
                down.pop()
            if _root(edges, up, name) != _root(edges, down, base):
                known = ", ".join(sorted({*edges, *(edge.parent for edge in edges.values())}))
                raise NotReady(
                    f"{name!r} is not connected with {base!r} on /tf; known are {known or 'no frames'}",
                    parameter="frame_id",
                    value=name,
                    hint="check who publishes it, by tf2_echo for instance",
                )
            if time == 0.0:
                time = self._newest({one: edges[one] for one in (*up, *down) if not edges[one].is_static})
            return _pose(edges, down, time).inverse() @ _pose(edges, up, time)

    def _newest(self, moving: Mapping[str, _Edge]) -> float:
        """The newest time of all of some frames."""
        if not moving:
            return 0.0
        name = min(moving, key=lambda one: moving[one].times[-1])
        time = moving[name].times[-1]
        if (age := self._clock() - time) > _FRESH:
            raise NotReady(
                f"the newest transform of {name!r} on /tf is {age:.2f} s old",
                parameter="frame_id",
                value=name,
                allowed=f"at most {_FRESH} s",
                hint="check that it is published all the time, and the clocks of the machines",
            )
        return time


def _path(edges: Mapping[str, _Edge], name: str) -> list[str]:
    """A frame and those above it, but for the root."""
    found: list[str] = []
    while name in edges:
        found.append(name)
        name = edges[name].parent
        if len(found) > _DEEPEST:
            raise NotReady(
                f"{name!r} is above itself on /tf",
                parameter="frame_id",
                hint="two nodes publish the same frame with different parents",
            )
    return found


def _root(edges: Mapping[str, _Edge], path: list[str], name: str) -> str:
    return edges[path[-1]].parent if path else name


def _pose(edges: Mapping[str, _Edge], path: list[str], time: float) -> Pose:
    """Of a frame in the one above the last of its path."""
    pose = ORIGIN
    for name in path:
        pose = edges[name].at(name, time) @ pose
    return pose


def _seconds(stamp: Any) -> float:
    """A time of either ROS [s]."""
    return float(stamp.to_sec()) if hasattr(stamp, "to_sec") else stamp.sec + 1e-9 * stamp.nanosec
