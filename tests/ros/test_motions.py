"""Motions from messages: each kind, defaults of fields that are not given, refusals that name the error."""

from __future__ import annotations

from math import inf, nan
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import heptarm as ha
from heptarm.do import notify, set_output
from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.ros.interface.motions import motion_of, pose_of, program_of
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.values.condition.signals import path

HERE = np.arange(7) * 0.1
EMPTY: dict[str, Any] = {
    name: 0.0
    for name in (
        *("speed_mps", "acceleration_mps2", "jerk_mps3", "speed_radps", "acceleration_radps2", "jerk_radps3"),
        *("blend_rel", "blend_m", "blend_rad", "duration", "joint_velocity", "cartesian_velocity"),
    )
} | {
    name: []
    for name in (
        *("joint_names", "position", "segments", "near", "redundancy", "q_min", "q_max"),
        *("joint_speed", "joint_acceleration", "joint_jerk", "triggers"),
    )
}


CORNER = ha.Pose.xyz_abc(0.1, 0.2, 0.3, *ha.deg(90, 0, 0))


class FakeDriver:
    """A driver of an arm at rest."""

    configuration = NodeConfiguration.of({})
    transforms = None
    arm = SimpleNamespace(state=SimpleNamespace(q_cmd=HERE), frames={"/Table/Corner": CORNER})


def pose(x: float, y: float, z: float, turn: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)) -> SimpleNamespace:
    orientation = SimpleNamespace(**dict(zip("xyzw", turn)))
    return SimpleNamespace(position=SimpleNamespace(x=x, y=y, z=z), orientation=orientation)


def stamped(frame: str = "", *numbers: Any) -> SimpleNamespace:
    return SimpleNamespace(
        header=SimpleNamespace(frame_id=frame), pose=pose(*cast(Any, numbers or (0.5, 0.1, 0.4)))
    )


def message(kind: int, **fields: Any) -> SimpleNamespace:
    plain: dict[str, Any] = {name: "" for name in ("moving", "orientation", "at_limit", "outside")}
    plain |= {"pose": stamped(), "via": pose(0.5, 0.0, 0.5)}
    return SimpleNamespace(kind=kind, **(EMPTY | plain | fields))


def segment(kind: int, **fields: Any) -> SimpleNamespace:
    plain = {"pose": pose(0.5, 0.1, 0.4), "via": pose(0.5, 0.0, 0.5), "orientation": ""}
    return SimpleNamespace(
        kind=kind, **(dict.fromkeys(("speed_mps", "acceleration_mps2", "jerk_mps3"), 0.0) | plain | fields)
    )


def made(one: SimpleNamespace) -> Any:
    return motion_of(FakeDriver(), one)  # type: ignore[arg-type]


TARGET, VIA = ha.Pose.at(0.5, 0.1, 0.4), ha.Pose.at(0.5, 0.0, 0.5)


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        (message(0, position=HERE.tolist()), ha.ptp(HERE)),
        (
            message(0, pose=stamped("", nan, nan, 0.4, (nan,) * 4)),
            ha.ptp(ha.PartialPose(z=0.4)),
        ),
        (
            message(1, pose=stamped("Table/Corner", 0.1, nan, nan)),
            ha.lin(ha.PartialPose(x=0.1, a=0.0, b=0.0, c=0.0).placed(CORNER)),
        ),
        (
            message(0, joint_names=["A1"], position=[0.0], joint_speed=[0.3], blend_rel=0.5),
            ha.ptp(HERE, speed=0.3, blend_rel=0.5),
        ),
        (message(0, moving="flange", near=[0.0] * 7), ha.ptp(TARGET, moving="flange", near=[0.0] * 7)),
        (message(0, redundancy=[0.2, 2.0]), ha.ptp(TARGET, redundancy=ha.Redundancy(0.2, 2))),
        (
            message(1, speed_mps=0.2, orientation="constant"),
            ha.lin(TARGET, speed_mps=0.2, orientation="constant"),
        ),
        (
            message(1, joint_speed=[0.1] * 7, blend_m=0.01, blend_rad=0.1),
            ha.lin(TARGET, joint_speed=[0.1] * 7, blend_m=0.01, blend_rad=0.1),
        ),
        (message(2, pose=stamped("link_0"), jerk_mps3=2.0), ha.circ(VIA, TARGET, jerk_mps3=2.0)),
        (message(1, pose=stamped("/Table/Corner")), ha.lin(TARGET, frame=CORNER)),
        (message(2, pose=stamped("Table/Corner")), ha.circ(VIA, TARGET, frame=CORNER)),
        (message(0, pose=stamped("Table/Corner")), ha.ptp(TARGET, frame=CORNER)),
        (message(3, pose=stamped("base", 0.0, 0.0, 0.1)), ha.lin_rel(z=0.1, frame="base")),
        (message(3, pose=stamped("", 0.0, 0.0, 0.1, (0, 0, 0, 0))), ha.lin_rel(z=0.1)),
        (
            message(
                4,
                segments=[segment(0, speed_mps=0.1), segment(1), segment(2, orientation="constant")],
                acceleration_mps2=1.0,
            ),
            ha.spline(
                [ha.spl(TARGET, speed_mps=0.1), ha.lin(TARGET), ha.circ(VIA, TARGET, orientation="constant")],
                acceleration_mps2=1.0,
            ),
        ),
        (
            message(5, joint_names=["A1", "A2"], position=[0.0, 0.1, 0.0, 0.2]),
            ha.spline_joints([HERE, [0, 0.2, *HERE[2:]]]),
        ),
        (message(8), ha.hand_guide()),
        (
            message(8, q_min=[-1.0] * 7, joint_velocity=0.5, outside="pull"),
            ha.hand_guide(q_min=[-1.0] * 7, joint_velocity=0.5, outside="pull"),
        ),
        (message(6), ha.hold()),
        (message(7, joint_speed=[0.2]), ha.ptp_home(speed=0.2)),
        (message(6, duration=2.0), ha.hold(2.0)),
    ],
)
def test_a_message_is_the_motion_that_python_makes(given: SimpleNamespace, wanted: Any) -> None:
    assert made(given) == wanted


@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        (message(9), CommandRejected, "got 9"),
        (message(0, position=[0.0]), ShapeError, "must have one number"),
        (message(1, pose=stamped("table")), ShapeError, "table"),
        (message(1, speed_mps=-1.0), LimitError, "speed_mps"),
        (message(4), ShapeError, "segments"),
        (message(4, segments=[segment(7)]), CommandRejected, "got 7"),
        (
            message(5, joint_names=["A1", "A2"], position=[0.0, 0.1, 0.0]),
            ShapeError,
            "2 numbers for each point, got 3",
        ),
        (message(5), ShapeError, "7 numbers for each point, got 0"),
        (message(1, redundancy=[0.0] * 4), ShapeError, "4 numbers"),
        (message(0, redundancy=[0.0, nan]), LimitError, r"redundancy\[1\] must be finite"),
        (message(0, redundancy=[0.0, 2.0, inf]), LimitError, "must be finite"),
        (message(0, near=[0.0] * 7, redundancy=[0.1]), CommandRejected, "both choose"),
    ],
)
def test_what_is_no_motion_is_refused(given: SimpleNamespace, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        made(given)


def trigger(condition: str, **action: Any) -> SimpleNamespace:
    return SimpleNamespace(**({"signal": "", "value": 0.0, "label": ""} | {"condition": condition, **action}))


def test_motions_of_a_program_have_their_triggers() -> None:
    driver: Any = FakeDriver()
    lamp = trigger("path.after(0.1, seconds=-0.2)", signal="LEDBlue", value=1.0)
    near = trigger("path.before_end(0.02)", label="near")
    first, second = program_of(driver, [message(1, triggers=[lamp, near]), message(6)])
    assert first == ha.lin(TARGET).trigger(path.after(0.1, seconds=-0.2), set_output("LEDBlue", 1.0)).trigger(
        path.before_end(0.02), notify("near")
    )
    assert second == ha.hold(inf)
    for wrong, words in (
        (message(1, triggers=[trigger("")]), r"triggers\[0\].condition must be a condition"),
        (message(1, triggers=[near, trigger("now")]), "must be a condition"),
        (message(8, triggers=[near]), "hand guiding cannot have triggers"),
    ):
        with pytest.raises(CommandRejected, match=words):
            program_of(driver, [wrong])


def test_a_program_has_motions_and_a_pose_without_turn_is_none() -> None:
    driver: Any = FakeDriver()
    assert program_of(driver, [message(6), message(6)]) == (ha.hold(inf), ha.hold(inf))
    with pytest.raises(ShapeError, match="no motions"):
        program_of(driver, [])
    assert pose_of(pose(1, 2, 3, (0, 0, 0, 0))) == ha.Pose.at(1, 2, 3)
