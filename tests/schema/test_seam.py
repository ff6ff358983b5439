"""The seam between the doubles and the plant: values survive a round trip, and the memory has no gaps."""

from __future__ import annotations

from math import isnan, nan
from pathlib import Path

import pytest

import plant
from heptarm.planning import seam
from heptarm.sim.runtime.java_plant import mode_of, order_of
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
PART = seam.MotionOrder(id=3, kind=seam.MotionKind.CIRC, tcp=SEVEN, pose=SEVEN, via=SEVEN)
ORDER = seam.MotionOrder(
    id=2**60,
    kind=seam.MotionKind.BATCH,
    tcp=SEVEN,
    joints=SEVEN,
    orientation_type=seam.OrientationType.JOINT,
    reference=(0.0, 0.0, 0.0, 1.0),
    mode=SINE,
    straight_limits=seam.StraightLimits(velocity=SIX),
    hand_guiding=seam.HandGuiding(q_min=SEVEN, at_limit=seam.AtLimit.ALL),
    fri_overlay=seam.FriOverlay(session=2, command=3),
    breaks=CONDITIONS,
    triggers=CONDITIONS[:1],
    parts=(PART, PART),
)


def test_an_order_comes_back_as_it_was() -> None:
    assert repr(seam.MotionOrder.decode(ORDER.encode())) == repr(ORDER)


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


def test_an_order_becomes_the_plants() -> None:
    order = order_of(ORDER)
    assert (order.kind, order.orientation.type, order.orientation.reference) == ("batch", "joint", "base")
    assert order.guide is not None and order.guide.at_limit == "all" and order.guide.outside == "free"
    assert order.guide.q_min.tolist() == list(SEVEN) and isnan(order.guide.joint_velocity)
    assert order.joint_velocity == (1.0,) * 7 and order.blending == (0.0, 0.0, 0.0)
    assert [part.kind for part in order.parts] == ["circ", "circ"]


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
    text = (plant.HERE / "plant.toml").read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "plant.toml").write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ValueError, match=complaint):
        plant.load(tmp_path)
