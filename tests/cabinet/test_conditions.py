"""Break conditions in the core: checked, monitored by the robot or the core, reported with the state of the robot."""

from __future__ import annotations

from typing import Any

import pytest

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.cabinet.conftest import Maker
from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import Peer, run

#: The fake's A7 turns against a spring of 10 Nm/rad; it pushes along z of the flange, x of the base.
PUSHED = wire.JointTorqueOutside(joint=6, low=-3.0, high=3.0)
NEVER = wire.JointTorqueOutside(joint=0, low=-3.0, high=3.0)
#: A pose in the base whose y points against x of the base.
TURNED = wire.Pose(xyz=(0.4, 0.0, 0.0), quat=(0.0, 0.0, 0.5**0.5, 0.5**0.5))
CAUSE = wire.Cause


def controller(port: int) -> Peer:
    peer = Peer(port)
    peer.take_control()
    finish(peer, started(peer, turn(0.0)))
    return peer


def turn(a7: float, *nodes: wire.ConditionNode) -> wire.Item:
    return wire.Item(motion=wire.Ptp(q=(0.0,) * 6 + (a7,)), until=wire.Condition(nodes=nodes))


def started(peer: Peer, *items: wire.Item) -> int:
    answer = peer.ask(run(*items))
    assert isinstance(answer, wire.Accepted), answer
    return int(answer.id)


def finish(peer: Peer, number: int) -> wire.MotionFinished:
    return peer.wait_for(wire.MotionFinished, lambda event: event.id == number)


def firing(peer: Peer, number: int) -> wire.ConditionFired:
    return peer.wait_for(wire.ConditionFired, lambda event: event.id == number)


def test_the_leaf_that_fired_is_named_and_where_the_robot_was(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        number = started(peer, turn(1.1, NEVER, PUSHED, wire.AnyOf(n=2)))
        end = finish(peer, number)
        assert (end.cause, end.fired, end.item) == (CAUSE.CONDITION, 1, 0)
        assert 0.3 <= end.q[6] < 0.4
        fired = firing(peer, number)
        assert (fired.node, fired.item) == (1, 0)
        assert fired.torques.tau_ext[6] == pytest.approx(-10 * fired.joints.q[6], abs=0.05)
        kinds = [type(message) for _, message in peer.seen]
        assert kinds.index(wire.ConditionFired) < len(kinds) - 1 - kinds[::-1].index(wire.MotionFinished)


@pytest.mark.parametrize(
    ("nodes", "fired"),
    [
        ((PUSHED, wire.ForceAbove(threshold=2.0), wire.AllOf(n=2)), 2),
        ((NEVER, wire.Inverted()), 1),
        ((NEVER, PUSHED, NEVER, wire.AllOf(n=2), wire.AnyOf(n=2), PUSHED, wire.AnyOf(n=2)), 5),
        ((wire.NormalForceAbove(axis=wire.Axis.Z, threshold=2.0),), 0),
        ((wire.NormalForceAbove(axis=wire.Axis.X, threshold=2.0, frame="base"),), 0),
        ((wire.ShearForceAbove(axis=wire.Axis.X, threshold=2.0),), 0),
        ((wire.NormalForceAbove(axis=wire.Axis.Y, threshold=2.0, frame="base", axes=TURNED),), 0),
        ((wire.ForceOutside(axis=wire.Axis.Z, low=-2.0, high=1000.0),), 0),
        ((wire.ForceAbove(threshold=900.0, tolerance=0.1),), 0),  # the estimate is 0.5 N inaccurate
        ((wire.SignalIs(signal="Flange.Button", value=False),), 0),
        ((wire.SignalOutside(signal="Cell.Level", low=1.0, high=2.0),), 0),  # monitored by the core
    ],
)
def test_every_kind_fires(cabinet: FakeCabinet, nodes: tuple[wire.ConditionNode, ...], fired: int) -> None:
    with controller(cabinet.port) as peer:
        end = finish(peer, started(peer, turn(1.1, *nodes)))
        assert (end.cause, end.fired) == (CAUSE.CONDITION, fired)
        assert end.q[6] < 1.0


@pytest.mark.parametrize(
    "nodes",
    [
        (NEVER,),
        (PUSHED, NEVER, wire.AllOf(n=2)),
        (wire.ShearForceAbove(axis=wire.Axis.Z, threshold=2.0),),
        (wire.ForceOutside(axis=wire.Axis.Z, low=-1000.0, high=2.0),),
        (wire.NormalForceAbove(axis=wire.Axis.X, threshold=2.0, frame="base", axes=TURNED),),
        (wire.SignalIs(signal="Flange.Button", value=True),),
        (wire.SignalOutside(signal="Cell.Level", low=-1.0, high=2.0),),
    ],
)
def test_what_does_not_hold_does_not_fire(
    cabinet: FakeCabinet, nodes: tuple[wire.ConditionNode, ...]
) -> None:
    with controller(cabinet.port) as peer:
        end = finish(peer, started(peer, turn(0.6, *nodes)))
        assert (end.cause, end.fired) == (CAUSE.FINISHED, -1)


def test_what_is_behind_it_in_the_program_does_not_begin_but_the_next_program_does(
    cabinet: FakeCabinet,
) -> None:
    with controller(cabinet.port) as peer:
        number = started(peer, turn(0.1, NEVER), turn(0.9, PUSHED), turn(-1.0))
        behind = started(peer, turn(0.2))
        end = finish(peer, number)
        assert (end.cause, end.item, end.fired) == (CAUSE.CONDITION, 1, 0)
        assert end.q[6] > 0.2
        assert [e.item for e in peer.all(wire.MotionStarted) if e.id == number] == [0, 1]
        assert [e.item for e in peer.all(wire.ItemReached) if e.id == number] == [0]
        assert finish(peer, behind).cause is CAUSE.FINISHED


def test_the_core_watches_a_servo_motion(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        until = wire.Condition(nodes=(NEVER, PUSHED, wire.AnyOf(n=2)))
        answer = peer.ask(wire.ServoOpen(watchdog=2.0, until=until))
        assert isinstance(answer, wire.Accepted)
        servo = int(answer.id)
        peer.wait_for(wire.MotionStarted, lambda event: event.id == servo)
        for step in range(6):
            target = wire.ServoJoints(servo=servo, watchdog=2.0, q=(0.0,) * 6 + (0.1 * step,))
            peer.send(target)
            peer.read_for(0.02)
        end = finish(peer, servo)
        assert (end.cause, end.fired) == (CAUSE.CONDITION, 1)
        assert firing(peer, servo).node == 1


def refused(peer: Peer, *nodes: wire.ConditionNode, motion: Any = None) -> wire.Rejected:
    item = wire.Item(motion=motion or wire.Ptp(q=(0.0,) * 7), until=wire.Condition(nodes=nodes))
    answer = peer.ask(run(turn(0.1), item))
    assert isinstance(answer, wire.Rejected), answer
    return answer


@pytest.mark.parametrize(
    ("nodes", "code", "parameter"),
    [
        ((NEVER, NEVER), Code.BAD_CONDITION, "items[1].until.nodes"),
        ((NEVER, wire.AllOf(n=2)), Code.BAD_CONDITION, "items[1].until.nodes[1]"),
        ((wire.Inverted(),), Code.BAD_CONDITION, "items[1].until.nodes[0]"),
        (
            (wire.JointTorqueOutside(joint=1, low=2.0, high=1.0),),
            Code.OUT_OF_RANGE,
            "items[1].until.nodes[0].low",
        ),
        (
            (wire.ForceOutside(axis=wire.Axis.X, low=2.0, high=2.0),),
            Code.OUT_OF_RANGE,
            "items[1].until.nodes[0].low",
        ),
        ((wire.ForceAbove(threshold=-1.0),), Code.OUT_OF_RANGE, "items[1].until.nodes[0].threshold"),
        (
            (wire.SignalIs(signal="Flange.Knob", value=True),),
            Code.UNKNOWN_NAME,
            "items[1].until.nodes[0].signal",
        ),
        (
            (wire.SignalIs(signal="Cell.Level", value=True),),
            Code.BAD_CONDITION,
            "items[1].until.nodes[0].signal",
        ),
        (
            (wire.PathReached(reference=wire.PathReference.DESTINATION, distance=0.1, delay=0.0),),
            Code.OUT_OF_RANGE,
            "items[1].until.nodes[0].distance",
        ),
    ],
)
def test_a_bad_condition_is_refused_and_nothing_moves(
    cabinet: FakeCabinet, nodes: tuple[wire.ConditionNode, ...], code: Code, parameter: str
) -> None:
    with controller(cabinet.port) as peer:
        answer = refused(peer, *nodes)
        assert (answer.code, answer.parameter) == (code, parameter)
        assert answer.text


def test_a_hold_and_a_servo_motion_have_no_path(cabinet: FakeCabinet) -> None:
    point = wire.PathReached(reference=wire.PathReference.START, distance=0.1, delay=0.0)
    with controller(cabinet.port) as peer:
        assert refused(peer, point, motion=wire.Hold(duration=1.0)).code == Code.BAD_CONDITION
        answer = peer.ask(wire.ServoOpen(until=wire.Condition(nodes=(point,))))
        assert isinstance(answer, wire.Rejected) and answer.code == Code.BAD_CONDITION


@pytest.mark.parametrize(("fault", "reason"), [("blind", "did not respond"), ("outdated", "a later release")])
def test_a_robot_that_cannot_be_read_is_stopped(make: Maker, fault: str, reason: str) -> None:
    with controller(make().port) as peer:
        long = wire.Item(
            motion=wire.Hold(duration=20.0),
            until=wire.Condition(nodes=(wire.SignalOutside(signal="Cell.Level", low=-1.0, high=1.0),)),
        )
        number = started(peer, long)
        peer.wait_for(wire.MotionStarted, lambda event: event.id == number)
        peer.ask(wire.ShowMessage(severity=wire.Severity.INFO, text=fault))
        end = finish(peer, number)
        assert end.cause is CAUSE.STOPPED and reason in end.text
