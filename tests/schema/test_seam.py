"""The seam between the doubles and the plant: values survive a round trip, and the memory has no gaps."""

from __future__ import annotations

from math import isnan, nan
from pathlib import Path
from typing import get_args

import pytest

import plant
from heptarm.planning import seam
from heptarm.sim.runtime.java_plant import command_of, mode_of
from heptarm.values.mode.sine import SineImpedance
from heptarm.wire.codec import DecodeError

SEVEN = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)
SIX = SEVEN[:6]
FRAME = seam.MeasuringFrame(
    point_moves=True, point=(0.1, 0.2, 0.3), axes_move=False, axes=(0.0, 0.0, 0.0, 1.0)
)
CARTESIAN = seam.CartesianImpedance(
    stiffness=(2000.0,) * 3 + (200.0,) * 3,
    damping=(0.7,) * 6,
    nullspace_stiffness=100.0,
    nullspace_damping=0.7,
    additional_force=(0.0,) * 6,
    max_force=(10.0, *(nan,) * 5),
    max_force_stops=True,
    axes=(0.0, 0.0, 0.0, 1.0),
)
SINE = seam.SineImpedance(
    base=CARTESIAN, amplitude=SIX, frequency=SIX, phase=SIX, bias=SIX, rise_time=0.5, fall_time=1.0
)
CONDITIONS = (
    seam.JointTorqueOutside(joint=6, low=-1.0, high=2.0),
    seam.WrenchAbove(frame=FRAME, components=seam.WrenchComponents(7), threshold=3.0),
    seam.AnyOf(
        parts=(
            seam.WrenchOutside(frame=FRAME, component=4, low=-4.0, high=5.0),
            seam.Inverted(part=seam.SignalIs(place=511, value=True)),
            seam.AllOf(parts=(seam.PathReached(reference=seam.PathReference.END, distance=-0.1, delay=0.2),)),
        )
    ),
)
PLACE = seam.Pose(xyz=SEVEN[:3], quat=(0.0, 0.0, 0.0, 1.0))
ARC = seam.Circ(
    via=PLACE,
    end=PLACE,
    redundancy=seam.Redundancy(e1=0.5, status=2),
    dynamics=seam.CartesianDynamics(velocity=0.2),
    orientation=seam.Orientation(type=seam.OrientationType.JOINT),
)
MOTIONS = (
    seam.Ptp(q=SEVEN, blending=seam.Blending(relative=0.5)),
    seam.PtpPose(target=PLACE, redundancy=seam.Redundancy()),
    seam.Lin(target=PLACE, redundancy=seam.Redundancy(), joints=seam.JointDynamics(velocity=SEVEN)),
    seam.LinRel(offset=PLACE, axes=(0.0, 0.0, 0.0, 1.0)),
    ARC,
    seam.Spline(segments=(seam.Spl(target=PLACE), ARC)),
    seam.JointSpline(points=(seam.Ptp(q=SEVEN), seam.Ptp(q=SEVEN))),
    seam.Batch(motions=(seam.Ptp(q=SEVEN), ARC), blending=seam.Blending(distance=0.02)),
    seam.Hold(duration=nan),
    seam.HandGuide(q_min=SEVEN, freezes_all=True),
    seam.ServoSmart(timing=seam.ServoTiming(), dynamics=seam.JointDynamics()),
    seam.ServoDirect(timing=seam.ServoTiming(goal_timeout=2.0), dynamics=seam.JointDynamics()),
    seam.ServoStraight(timing=seam.ServoTiming(), velocity=SIX),
)


def order(motion: seam.PlantMotion) -> seam.MotionOrder:
    return seam.MotionOrder(
        id=2**60,
        motion=motion,
        tcp=SEVEN,
        mode=SINE,
        fri_overlay=seam.FriOverlay(session=2, command=3),
        conditions=(
            seam.MotionCondition(condition=CONDITIONS[0], breaks=False, part=1, index=0),
            seam.MotionCondition(condition=CONDITIONS[2], breaks=True, index=3),
        ),
    )


ORDER = order(MOTIONS[7])


@pytest.mark.parametrize("motion", MOTIONS, ids=lambda one: type(one).__name__)
def test_an_order_comes_back_as_it_was(motion: seam.PlantMotion) -> None:
    sent = order(motion)
    assert repr(seam.MotionOrder.decode(sent.encode())) == repr(sent)


def test_every_member_of_the_union_has_come_back() -> None:
    assert {type(one) for one in (*MOTIONS, *MOTIONS[5].segments)} == set(get_args(seam.PlantMotion))


def test_an_unknown_motion_is_refused() -> None:
    data = ORDER.encode()
    with pytest.raises(DecodeError, match="PlantMotion has tag 99"):
        seam.MotionOrder.decode(data[:8] + bytes((99,)) + data[9:])


@pytest.mark.parametrize("cut", [0, 1, 9, 60, -1])
def test_bytes_of_another_length_are_refused(cut: int) -> None:
    with pytest.raises(DecodeError):
        seam.MotionOrder.decode(ORDER.encode()[:cut])
    with pytest.raises(DecodeError):
        seam.MotionOrder.decode(ORDER.encode() + b"\0")


def test_an_unknown_condition_is_refused() -> None:
    data = seam.encode_condition(CONDITIONS[0])
    assert repr(seam.decode_condition(data)) == repr(CONDITIONS[0])
    with pytest.raises(DecodeError, match="Condition has tag 77"):
        seam.decode_condition(bytes((77,)) + data[1:])


def test_an_order_becomes_the_controllers_command() -> None:
    class Listener:
        def fired(self, part: int, breaks: bool, index: int) -> None:
            heard.append((part, breaks, index))

    heard: list[tuple[int, bool, int]] = []
    command = command_of(ORDER, Listener())
    assert command.motion is ORDER.motion and command.tcp == SEVEN and command.axes == CARTESIAN.axes
    assert [(one.part, one.breaks) for one in command.watches] == [(1, False), (-1, True)]
    for one in command.watches:
        one.fired()
    assert heard == [(1, False, 0), (-1, True, 3)]


def test_every_parameter_of_a_mode_arrives_under_its_name() -> None:
    mode, axes = mode_of(SINE)
    assert isinstance(mode, SineImpedance) and axes == (0.0, 0.0, 0.0, 1.0)
    assert mode.base.frame == "reference" and mode.base.max_force_stops
    assert mode.amplitude.tolist() == list(SIX) and mode.rise_time == 0.5 and isnan(mode.hold_time)


def test_sections_of_the_memory_follow_each_other() -> None:
    sections = plant.load().sections
    assert [one.start for one in sections] == [0, *(one.end for one in sections[:-1])]
    assert sections[-1].end == seam.MEMORY_WORDS
    assert seam.StateWords.SECTION.stop == seam.TargetWords.SECTION.start


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ('type = "f64[SIGNALS]"', 'type = "f32"', "unknown type"),
        ('name = "mass", type', 'name = "mass", units = "kg", type', "unknown attributes"),
    ],
)
def test_a_wrong_schema_is_refused(tmp_path: Path, old: str, new: str, complaint: str) -> None:
    text = (Path(plant.__file__).parent / "plant.toml").read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "plant.toml").write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ValueError, match=complaint):
        plant.load(tmp_path)
