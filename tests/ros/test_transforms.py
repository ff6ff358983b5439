"""Frames of /tf: through time, from several publishers, connected or not, and what is wrong with them."""

from __future__ import annotations

from math import nan
from types import SimpleNamespace
from typing import Any

import pytest

from heptarm.errors import NotReady, ShapeError
from heptarm.ros.node.transforms import Transforms
from heptarm.values.pose import Pose


def stamp(time: float) -> SimpleNamespace:
    """As in ROS 2."""
    return SimpleNamespace(sec=int(time), nanosec=round((time - int(time)) * 1e9))


def moved(parent: str, name: str, time: float, pose: Pose | None = None, **place: float) -> SimpleNamespace:
    """A transform."""
    pose = pose or Pose.of((0.0, 0.0, 0.0))
    x, y, z = (place.get(axis, float(value)) for axis, value in zip("xyz", pose.xyz))
    names = zip("xyzw", pose.quat.tolist())
    return SimpleNamespace(
        header=SimpleNamespace(frame_id=parent, stamp=stamp(time)),
        child_frame_id=name,
        transform=SimpleNamespace(
            translation=SimpleNamespace(x=x, y=y, z=z), rotation=SimpleNamespace(**dict(names))
        ),
    )


def message(*transforms: Any) -> SimpleNamespace:
    return SimpleNamespace(transforms=list(transforms))


def x_of(frames: Transforms, name: str, time: float, base: str = "base") -> float:
    return float(frames.find(name, base=base, stamp=stamp(time), own={}).xyz[0])


def test_a_frame_is_where_it_was_at_the_time_of_the_stamp() -> None:
    frames = Transforms(lambda: 100.3)
    for time in (100.0, 100.1, 100.2):
        frames.add(message(moved("base", "flange", time, x=time - 100.0)))
    frames.add(message(moved("flange", "/camera", 0.0, x=1.0)), is_static=True)
    assert x_of(frames, "camera", 100.05) == pytest.approx(1.05)
    assert x_of(frames, "camera", 100.2) == x_of(frames, "camera", 0.0) == pytest.approx(1.2)
    assert x_of(frames, "camera", 100.4) == pytest.approx(1.2)  # stamped a little later than the newest
    assert x_of(frames, "base", 100.05) == 0.0
    for time in (99.9, 101.0):
        with pytest.raises(NotReady, match="'flange' must have been on /tf"):
            x_of(frames, "camera", time)
    frames.add(message(moved("base", "flange", 120.0, x=5.0)))
    with pytest.raises(NotReady, match="'flange' must have been on /tf"):
        x_of(frames, "camera", 100.1)


def test_the_newest_is_that_of_the_slowest_publisher() -> None:
    frames = Transforms(lambda: 2.0)
    for time in (1.0, 2.0):
        frames.add(message(moved("base", "flange", time, x=time)))
    frames.add(message(moved("flange", "part", 1.5, x=0.1)))
    assert x_of(frames, "part", 0.0) == pytest.approx(1.6)


def test_turns_are_composed_also_through_a_common_root() -> None:
    frames, quarter = Transforms(lambda: 0.0), Pose.xyz_abc(0.0, 0.0, 1.0, a=1.5707963267948966)
    frames.add(
        message(moved("world", "base", 0.0, quarter), moved("world", "table", 0.0, y=2.0)), is_static=True
    )
    seen = frames.find("table", base="base", stamp=stamp(0.0), own={})
    assert seen.xyz == pytest.approx([2.0, 0.0, -1.0])
    # what stands above both does not count: it may be old
    frames.add(message(moved("map", "world", 5.0)))
    assert frames.find("table", base="base", stamp=stamp(900.0), own={}).xyz == pytest.approx(
        [2.0, 0.0, -1.0]
    )


def test_what_is_wrong_is_reported_and_the_rest_is_taken() -> None:
    frames = Transforms(lambda: 1.2)
    with pytest.raises(NotReady, match="not connected with 'base' on /tf; known are no frames"):
        x_of(frames, "part", 0.0)
    broken = moved("base", "other", 1.0, x=nan)
    with pytest.raises(ShapeError, match="the transform of 'other' is refused"):
        frames.add(message(broken, moved("base", "part", 1.0, x=1.0)))
    assert x_of(frames, "part", 0.0) == 1.0
    with pytest.raises(NotReady, match="'other' is not connected with 'base' on /tf; known are base, part"):
        x_of(frames, "other", 0.0)
    frames.add(message(moved("a", "b", 1.0), moved("b", "a", 1.0)))
    with pytest.raises(NotReady, match="is above itself on /tf"):
        x_of(frames, "a", 0.0)


def test_a_clock_that_is_set_back_begins_again() -> None:
    frames = Transforms(lambda: 3.2)
    frames.add(message(moved("base", "part", 100.0, x=1.0)))
    frames.add(message(moved("base", "part", 99.0, x=2.0)))  # late, of no use
    assert x_of(frames, "part", 0.0) == 1.0
    frames.add(message(moved("base", "part", 3.0, x=3.0)))  # a bag is played again
    assert x_of(frames, "part", 0.0) == 3.0


def test_now_is_the_newest_state_of_the_arm_and_what_was_seen_a_moment_ago() -> None:
    frames = Transforms(lambda: 10.0)
    frames.add(message(moved("base", "flange", 9.0, x=1.0), moved("base", "part", 9.4, x=2.0)))
    frames.add(message(moved("flange", "camera", 0.0, x=0.1)), is_static=True)
    own = {"flange": Pose.of((3.0, 0.0, 0.0))}
    assert frames.find("camera", base="base", stamp=stamp(0.0), own=own).xyz[0] == pytest.approx(3.1)
    assert frames.find("camera", base="base", stamp=stamp(9.0), own=own).xyz[0] == pytest.approx(1.1)
    with pytest.raises(NotReady, match="the newest transform of 'part' on /tf is 0.60 s old"):
        frames.find("part", base="base", stamp=stamp(0.0), own=own)
