"""Tools and workpieces as values."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from heptarm.errors import CommandRejected, HeptarmError, LimitError, ShapeError
from heptarm.values.pose import Pose
from heptarm.values.tool import Tool, Workpiece

NAN, INF = math.nan, math.inf
TIP = Pose.at(0, 0, 0.12)
BALL = (1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0)


def test_a_tool_has_a_body_and_frames_of_which_the_tcp_is_the_first() -> None:
    tool = Tool("gripper", mass=1.2, com=(0, 0, 0.06), inertia=BALL, tcp=TIP, frames={"pad": Pose.at(0.02)})
    assert (tool.body.mass, tool.body.com[2], tool.body.inertia[0]) == (1.2, 0.06, 1e-3)
    assert tool.frame_names == ("tcp", "pad")
    assert tool.tcp == TIP
    assert tool.frame("pad").x == 0.02
    with pytest.raises(CommandRejected, match="must be one of tcp, pad") as refused:
        tool.frame("tip")
    assert refused.value.code == 42


def test_without_a_tcp_the_first_frame_is_the_default_and_without_frames_the_flange() -> None:
    assert Tool("fork", frames={"left": Pose.at(0, 0.1), "right": Pose.at(0, -0.1)}).tcp.y == 0.1
    assert Tool("plate").tcp == Pose.at()


def test_tools_are_frozen_compare_by_their_numbers_and_differ_from_workpieces() -> None:
    tool = Tool("gripper", mass=1.2, tcp=TIP)
    assert tool == Tool("gripper", mass=1.2, tcp=TIP)
    assert hash(tool) == hash(Tool("gripper", mass=1.2, tcp=TIP))
    assert tool != Tool("gripper", mass=1.3, tcp=TIP)
    assert tool != Workpiece("gripper", mass=1.2, tcp=TIP)
    with pytest.raises(dataclasses.FrozenInstanceError):
        tool.mass = 2.0  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        tool.com[0] = 1.0


#: Refused values, with the code and the parameter; tests/cabinet refuses the same when the client is bypassed.
REFUSED: list[tuple[Callable[[Any], object], type[HeptarmError], int, str]] = [
    (lambda make: make("", mass=1), ShapeError, 3, "name"),
    (lambda make: make("x" * 65), ShapeError, 3, "name"),
    (lambda make: make(7), ShapeError, 3, "name"),
    (lambda make: make("a/b"), LimitError, 2, "name"),
    (lambda make: make("t", mass=-0.1), LimitError, 2, "mass"),
    (lambda make: make("t", mass=50.1), LimitError, 2, "mass"),
    (lambda make: make("t", mass=NAN), LimitError, 1, "mass"),
    (lambda make: make("t", mass=None), ShapeError, 0, "mass"),
    (lambda make: make("t", mass=INF), LimitError, 1, "mass"),
    (lambda make: make("t", com=(0, NAN, 0)), LimitError, 1, "com[1]"),
    (lambda make: make("t", com=(0, 0, 2.1)), LimitError, 2, "com[2]"),
    (lambda make: make("t", com=(0, 0)), ShapeError, 0, "com"),
    (lambda make: make("t", inertia=(NAN, *BALL[1:])), LimitError, 1, "inertia[0]"),
    (lambda make: make("t", inertia=(-1e-3, 1e-3, 1e-3, 0, 0, 0)), LimitError, 2, "inertia"),
    (lambda make: make("t", inertia=(1e-3, 1e-3, 3e-3, 0, 0, 0)), LimitError, 2, "inertia"),
    (lambda make: make("t", inertia=(1e-3, 1e-3, 1e-3, 2e-3, 0, 0)), LimitError, 2, "inertia"),
    (lambda make: make("t", inertia=(1, 2, 3)), ShapeError, 0, "inertia"),
    (lambda make: make("t", tcp=(0, 0, 0.1)), ShapeError, 0, "frames[0].pose"),
    (lambda make: make("t", frames=[("tip", TIP)]), ShapeError, 0, "frames"),
    (lambda make: make("t", frames={"": TIP}), ShapeError, 3, "frames[0].name"),
    (lambda make: make("t", frames={"tip": TIP, "flange": TIP}), LimitError, 2, "frames[1].name"),
    (lambda make: make("t", frames={"base": TIP}), LimitError, 2, "frames[0].name"),
    (lambda make: make("t", frames={"tool": TIP}), LimitError, 2, "frames[0].name"),
    (lambda make: make("t", frames={"a/b": TIP}), LimitError, 2, "frames[0].name"),
    (lambda make: make("t", frames={str(i): TIP for i in range(33)}), ShapeError, 3, "frames"),
    (lambda make: make("t", tcp=TIP, frames={"tcp": TIP}), CommandRejected, 0, "frames"),
]


@pytest.mark.parametrize("make", [Tool, Workpiece])
@pytest.mark.parametrize("case", range(len(REFUSED)))
def test_what_no_tool_has_is_refused_by_name(make: type[Tool], case: int) -> None:
    build, kind, code, parameter = REFUSED[case]
    with pytest.raises(kind) as refused:
        build(make)
    assert (refused.value.code, refused.value.parameter) == (code, parameter)


def test_a_thin_plate_is_just_a_body() -> None:
    plate = Tool("plate", mass=1.0, inertia=(1e-3, 1e-3, 2e-3, 0, 0, 0))
    assert np.isclose(plate.inertia[2], 2e-3)
