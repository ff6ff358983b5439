"""Break conditions through the whole stack: API, TCP, Java application, doubles, plant, and a table in it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import heptarm as ha
from heptarm.arm.translate.conditions import condition_message
from heptarm.values.condition.force import force, torque
from heptarm.values.condition.signals import io, path
from heptarm.values.io import Signal, find_signal
from heptarm.values.mode.impedance import CartesianImpedance
from heptarm.wire import messages as wire
from tests.simulators import FASTER

TOUCH = force(frame="base").along("z") > 10
TABLE = 0.3
TARGET = f"sim://iiwa14?speed={FASTER:g}&box=0.6,0,{TABLE / 2},0.4,0.6,{TABLE}"
SIGNALS = tuple(
    Signal(name, is_output=False, kind="boolean")
    for name in ("MediaFlange.UserButton", "MediaFlange.InputX3Pin3", "Cell.Button", "Line.Button")
)


@pytest.fixture(scope="module")
def table() -> Iterator[ha.Arm]:
    """An arm above a table."""
    with ha.connect(TARGET, watchdog=5.0, timeout=30.0) as arm:
        yield arm


@pytest.fixture
def arm(table: ha.Arm) -> ha.Arm:
    table.move(ha.ptp(ha.deg(0, 35, 0, -80, 0, 65, 0)), speed=0.7)
    return table


def test_a_line_down_until_it_touches(arm: ha.Arm) -> None:
    start = arm.wait_for_rest().pose
    down = ha.lin_rel(z=-0.5, frame="base", speed_mps=0.04)
    result = arm.move(down, until=(abs(torque[0]) > 100) | TOUCH)
    assert result.cause is ha.Cause.CONDITION and result.stopped_by == TOUCH
    assert result.fired_at is not None
    assert result.fired_at.wrench.force[2] > 8.0
    pose = result.fired_at.pose
    assert TABLE - 0.01 < pose.xyz[2] < TABLE + 0.02
    assert np.abs(pose.xyz[:2] - start.xyz[:2]).max() < 2e-3
    assert arm.wait_for_rest().wrench.force[2] > 8.0
    lifted = arm.move(ha.lin_rel(z=0.05, frame="base", speed_mps=0.1), until=torque.about("z") > 200)
    assert lifted.arrived and lifted.stopped_by is None and lifted.fired_at is None


def test_the_axes_of_any_frame_in_the_base(arm: ha.Arm) -> None:
    tilted = ha.Pose.xyz_abc(0.5, 0.2, 0.1, *ha.deg(0, 90, 0))  # its x points down
    pressed = force(frame=tilted).along("x") < -10
    across = (force(frame=tilted).normal("z") > 8) | (force(frame=tilted).along("x") > 5)
    turned = abs(torque(frame=tilted).about("x")) > 100
    down = ha.lin_rel(z=-0.5, frame="base", speed_mps=0.04)
    assert arm.move(down, until=across | turned | pressed).stopped_by == pressed
    with arm.servo(
        "joint", watchdog=2.0, until=pressed
    ) as sv:  # evaluated by the application, not by Sunrise
        while sv.tick() and sv.t < 30.0:
            pass
    assert sv.result is not None and sv.result.stopped_by == pressed


def test_touching_gently(arm: ha.Arm) -> None:
    compliant = CartesianImpedance(stiffness=(1000, 1000, 500, 100, 100, 100))
    down = ha.lin_rel(z=-0.5, frame="base", speed_mps=0.05)
    result = arm.move(down, mode=compliant, until=TOUCH & (force > 5))
    assert str(result.stopped_by) == "(force along z of base > 10 N & force > 5 N)"
    assert arm.wait_for_rest().wrench.force[2] < 60.0


def test_of_a_list_the_rest_does_not_begin(arm: ha.Arm) -> None:
    down = ha.lin_rel(z=-0.1, frame="base", speed_mps=0.2)
    handle = arm.start([down, ha.lin_rel(z=0.1, frame="base"), down], until=path.after(0.05))
    result = handle.wait(timeout=20.0)
    assert result.item == 0 and result.stopped_by == path.after(0.05)
    assert result.fired_at is not None and handle.result is result


def test_one_of_two_is_named_as_it_was_written(arm: ha.Arm) -> None:
    either = path.after(0.02) ^ TOUCH
    assert arm.move(ha.lin_rel(z=-0.05, frame="base", speed_mps=0.1), until=either).stopped_by == either


def test_the_cabinets_application_watches_a_servo_motion(arm: ha.Arm) -> None:
    with arm.servo("pose", rate=50, speed=0.3, acceleration=0.5, watchdog=2.0, until=TOUCH) as sv:
        start = sv.start.pose
        while sv.tick() and sv.t < 20.0:
            sv.set(ha.Pose.of(start.xyz - [0, 0, 0.05 * sv.t], start.quat))
    assert sv.result is not None and sv.result.cause is ha.Cause.CONDITION
    assert sv.result.stopped_by == TOUCH
    assert sv.result.fired_at is not None and sv.result.fired_at.wrench.force[2] > 5.0
    arm.wait_for_rest()


def test_what_makes_no_sense_is_refused(arm: ha.Arm) -> None:
    with pytest.raises(ha.CommandRejected, match="hold has no path"):
        arm.move(ha.hold(1.0), until=path.after(0.1))
    with pytest.raises(ha.CommandRejected, match="no path"), arm.servo("joint", until=path.after(0.1)):
        pass
    with pytest.raises(ha.CommandRejected, match="nowhere"):
        arm.move(ha.hold(1.0), until=force(frame="nowhere") > 10)
    with pytest.raises(ha.ShapeError, match="must be a condition"):
        arm.move(ha.hold(1.0), until=5.0)  # type: ignore[arg-type]
    with pytest.raises(ha.CommandRejected, match="no signal"):
        arm.move(ha.hold(1.0), until=io.no_such_thing)
    with pytest.raises(ha.ShapeError, match="only when it is cancelled"):
        arm.move(ha.hold(), until=force > 10)


def test_signals_are_found_by_the_names_that_people_use() -> None:
    assert find_signal("MediaFlange.UserButton", SIGNALS).name == "MediaFlange.UserButton"
    assert find_signal("user_button", SIGNALS).name == "MediaFlange.UserButton"
    assert find_signal("input_x3_pin_3", SIGNALS).name == "MediaFlange.InputX3Pin3"
    assert find_signal("cell.button", SIGNALS).name == "Cell.Button"
    with pytest.raises(ha.CommandRejected, match="several") as error:
        find_signal("button", SIGNALS)
    assert "Cell.Button, Line.Button" in error.value.allowed
    with pytest.raises(ha.CommandRejected, match="no signal"):
        find_signal("lamp", SIGNALS)


def test_each_node_knows_which_part_it_is() -> None:
    first, second = io.user_button, force > 5
    message, parts = condition_message(first | ~second, SIGNALS)
    assert message.nodes[0] == wire.SignalIs(signal="MediaFlange.UserButton", value=True)
    assert parts == (first, second, ~second, first | ~second)
    message, parts = condition_message(first ^ second, SIGNALS)
    assert len(message.nodes) == len(parts) == 8
    assert set(map(str, parts)) == {str(first ^ second)}


def test_blended_motions_stay_blended_and_end_together(arm: ha.Arm) -> None:
    start = arm.wait_for_rest().pose
    corners = [(0.0, 0.1, 0.0), (-0.1, 0.1, 0.0), (-0.1, 0.0, 0.0), (0.0, 0.0, -0.4)]
    lines = [
        ha.lin(ha.Pose.of(start.xyz + corner, start.quat), blend_m=0.03, speed_mps=0.1) for corner in corners
    ]
    result = arm.move(lines, until=TOUCH)
    assert result.cause is ha.Cause.CONDITION and result.item == 3 and result.stopped_by == TOUCH
    assert result.fired_at is not None
    assert result.fired_at.pose.xyz[2] < TABLE + 0.02
    again = arm.move(
        [ha.lin_rel(z=0.1, frame="base", blend_m=0.02), ha.lin_rel(y=0.05, frame="base")], until=force > 900
    )
    assert again.arrived and again.item == 1
