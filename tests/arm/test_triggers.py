"""Triggers and events through the whole stack: API, TCP, Java application, doubles, plant."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

import heptarm as ha
from heptarm.arm.translate.triggers import trigger_messages
from heptarm.do import notify, set_output
from heptarm.model.kinematics import forward
from heptarm.values.condition.force import force
from heptarm.values.condition.signals import io, path
from heptarm.values.io import Signal
from heptarm.values.motion.motion import Motion
from heptarm.values.robot import robot
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.simulators import FASTER

WORLD = "MediaFlange.UserButton<bool MediaFlange.LEDBlue>bool Cell.Part<u8 Cell.Level>analog12[-10,10]"
PROJECT = f"""<persistence><processDataContainer>
<processData dataType="java.lang.String" id="heptarm.io" value="{WORLD.replace("<", "&lt;").replace(">", "&gt;")}"/>
</processDataContainer></persistence>"""
START = ha.deg(0, 35, 0, -80, 0, 65, 0)
BACK = ha.lin_rel(y=-0.1, frame="base", speed_mps=0.1)
ACROSS = ha.lin_rel(y=0.1, frame="base", speed_mps=0.1)
SLOWLY = ha.lin_rel(y=0.1, frame="base", speed_mps=0.01)


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ha.Arm]:
    project = tmp_path_factory.mktemp("project") / "RoboticsAPI.data.xml"
    project.write_text(PROJECT)
    with ha.connect(f"sim://iiwa14?speed={FASTER:g}&project={project}", watchdog=10.0, timeout=20.0) as arm:
        yield arm


@pytest.fixture
def arm(cell: ha.Arm) -> ha.Arm:
    cell.move(ha.ptp(START), speed=0.7)
    cell.io.set({"LEDBlue": False, "level": 0.0})
    return cell


def place(event: ha.MotionEvent) -> np.ndarray:
    """Commanded position of the flange, shape (3,) [m]."""
    assert event.state is not None and event.state.joints is not None
    return forward(robot("iiwa14"), event.state.joints.q_cmd)[:3, 3]


def fired(handle: ha.MotionHandle) -> dict[str, ha.MotionEvent]:
    """What fired, by its label or its output."""
    events = [event for event in handle.events(timeout=60.0) if event.trigger is not None]
    return {
        event.label or getattr(event.trigger.action, "signal", ""): event for event in events if event.trigger
    }


def test_an_output_is_set_on_the_way_and_the_handle_receives_it(arm: ha.Arm) -> None:
    start = arm.wait_for_rest().pose.xyz
    motion = (
        ACROSS.trigger(path.after(0.04), set_output("LEDBlue"))
        .trigger(path.before_end(0.02), set_output("Cell.Level", 2.5))
        .trigger(path.after(0.05, seconds=0.2), notify("later"))
        .trigger(path.before_end(seconds=0.3), notify("almost there"))
        .trigger(path.before_end(), notify("there"))
        .trigger(force > 900, notify("never"))
    )
    handle = arm.start(motion)
    events = fired(handle)
    assert handle.wait().arrived
    arm.io.wait("LEDBlue", True, timeout=10.0)
    arm.io.wait("level", 2.5, timeout=10.0)
    assert set(events) == {"LEDBlue", "later", "almost there", "Cell.Level", "there"}
    assert all(event.code == 0 and event.item == 0 for event in events.values())
    assert events["LEDBlue"].time < events["Cell.Level"].time < events["there"].time
    for name, least in (("LEDBlue", 0.04), ("Cell.Level", 0.08), ("later", 0.06)):
        assert place(events[name])[1] - start[1] >= least - 2e-3, name


def test_triggers_of_blended_motions_and_splines(arm: ha.Arm) -> None:
    start = arm.wait_for_rest().pose
    corners = [
        ha.Pose.of(start.xyz + travel, start.quat) for travel in ((0, 0.1, 0), (0, 0.1, 0.1), (0, 0, 0.1))
    ]
    lines = [
        ha.lin(corner, speed_mps=0.1, blend_m=0.02).trigger(path.after(0.05), notify(f"half of {k}"))
        for k, corner in enumerate(corners)
    ]
    curve = ha.spline([start, corners[0], corners[1], ha.lin(corners[2])], speed_mps=0.1)
    handle = arm.start([*lines, curve.trigger(path.before_end(0.03), notify("near the end"))])
    reported = [(e.kind, e.item, e.segment, e.label) for e in handle.events(timeout=60.0)]
    assert handle.wait().arrived
    program = [(kind, item) for kind, item, *_ in reported if kind in ("begun", "ended")]
    assert program == [(kind, item) for item in range(4) for kind in ("begun", "ended")]
    assert [(item, label) for kind, item, _, label in reported if kind == "trigger"] == [
        (0, "half of 0"),
        (1, "half of 1"),
        (2, "half of 2"),
        (3, "near the end"),
    ]
    assert [(item, segment) for kind, item, segment, _ in reported if kind == "segment"] == [
        (3, k) for k in range(4)
    ]
    assert handle.item == 3 and handle.segment == 3


def test_events_come_by_callbacks_too_under_override_and_pause(arm: ha.Arm) -> None:
    arm.set_override(0.1)
    handle = arm.start([ACROSS.trigger(path.after(0.03), notify("on the way")), BACK])
    first: list[ha.MotionEvent] = []
    handle.add_event_callback(first.append)
    arm.pause()
    assert handle.wait_started(20.0) and not handle.done
    arm.resume()
    arm.set_override(0.9)
    handle.add_event_callback(lambda event: 1 / 0)  # type: ignore[arg-type]  # not our error
    assert handle.wait().arrived
    arm.set_override(1.0)
    late: list[ha.MotionEvent] = []
    handle.add_event_callback(late.append)
    assert [(e.kind, e.item) for e in late] == [
        ("begun", 0),
        ("trigger", 0),
        ("ended", 0),
        ("begun", 1),
        ("ended", 1),
    ]
    assert first == late == list(handle.events())


def test_the_time_that_is_left_is_reported(arm: ha.Arm) -> None:
    handle = arm.start(SLOWLY)
    assert handle.wait_started(20.0)
    state = arm.wait_until(
        lambda s: s.motion is not None and s.motion.id == handle.id and s.motion.progress > 0.05
    )
    assert state.motion is not None and 0 < state.motion.remaining < 60
    handle.cancel()
    handle.wait()
    assert np.isnan(handle.remaining)


def test_events_end_with_a_program_that_is_cancelled(arm: ha.Arm) -> None:
    handle = arm.start([SLOWLY, BACK])
    with pytest.raises(ha.Timeout, match="no event of motion"):
        list(handle.events(timeout=0.0))
    assert handle.wait_started(20.0)
    handle.cancel()
    assert [e.kind for e in handle.events(timeout=30.0)] == ["begun", "ended"]
    assert handle.result is not None and handle.result.cause is ha.Cause.CANCELLED


BAD: list[tuple[Motion, int, str]] = [
    (ACROSS.trigger(path.after(0.1), set_output("no_such_thing")), Code.UNKNOWN_NAME, "no signal"),
    (ACROSS.trigger(io.no_such_thing, notify()), Code.UNKNOWN_NAME, "no signal"),
    (ACROSS.trigger(path.after(0.1), set_output("UserButton")), Code.UNSUPPORTED, "input"),
    (ACROSS.trigger(path.after(0.1), set_output("Cell.Level", 11.0)), Code.OUT_OF_RANGE, "11"),
    (ACROSS.trigger(path.after(0.1), set_output("LEDBlue", 0.5)), Code.OUT_OF_RANGE, "boolean"),
    (ha.hold(1.0).trigger(path.after(0.1), notify()), Code.BAD_CONDITION, "hold has no path"),
    (ACROSS.trigger(io["Cell.Part"] > 3, notify()), Code.UNSUPPORTED, "number signals"),
]


@pytest.mark.parametrize(("motion", "code", "text"), BAD)
def test_what_makes_no_sense_is_refused_before_anything_moves(
    arm: ha.Arm, motion: Motion, code: int, text: str
) -> None:
    with pytest.raises(ha.CommandRejected, match=text) as error:
        arm.move([ACROSS, motion])
    assert error.value.code == code
    assert error.value.parameter.startswith("motions[1].triggers[0].")


def test_negative_distances_do_not_come_into_being() -> None:
    wrong: Callable[[], object]
    for wrong in (lambda: path.after(-0.1), lambda: path.before_end(-0.1), lambda: path.after(float("nan"))):
        with pytest.raises(ha.LimitError) as error:
            wrong()
        assert error.value.code in (Code.OUT_OF_RANGE, Code.NOT_FINITE)


def test_the_messages_of_triggers() -> None:
    signals = (Signal("MediaFlange.LEDBlue", is_output=True, kind="boolean"),)
    motion = ACROSS.trigger(path.before_end(0.02), set_output("led_blue")).trigger(io.led_blue, notify("lit"))
    messages = trigger_messages(motion, signals)
    end = wire.PathReached(reference=wire.PathReference.DESTINATION, distance=-0.02, delay=0.0)
    assert messages == (
        wire.Trigger(
            condition=wire.Condition(nodes=(end,)),
            action=wire.SetSignal(signal="MediaFlange.LEDBlue", value=1.0),
        ),
        wire.Trigger(
            condition=wire.Condition(nodes=(wire.SignalIs(signal="MediaFlange.LEDBlue", value=True),)),
            action=wire.Notify(label="lit"),
        ),
    )
