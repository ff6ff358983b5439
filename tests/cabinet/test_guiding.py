"""Hand guiding in the core: checked, and its break condition monitored by the core, as no robot is known to do it."""

from __future__ import annotations

import math
from typing import Any

import pytest

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import Peer, run
from tests.cabinet.test_conditions import CAUSE, NEVER, PUSHED, controller, finish, firing, started, turn

NAN = math.nan
SPRING = wire.JointImpedance(stiffness=(300.0,) * 7, damping=(0.7,) * 7)
POINT = wire.PathReached(reference=wire.PathReference.START, distance=0.1, delay=0.0)


def guide(*nodes: wire.ConditionNode, mode: Any = None, **limits: Any) -> wire.Item:
    return wire.Item(motion=wire.HandGuide(**limits), mode=mode, until=wire.Condition(nodes=nodes))


def one(axis: int, value: float) -> tuple[float, ...]:
    return tuple(value if i == axis else NAN for i in range(7))


@pytest.mark.parametrize(
    ("item", "code", "parameter"),
    [
        (guide(q_min=one(1, 9.0)), Code.JOINT_LIMIT, "items[1].motion.q_min[1]"),
        (guide(q_max=one(6, -9.0)), Code.JOINT_LIMIT, "items[1].motion.q_max[6]"),
        (guide(q_min=one(3, 0.5), q_max=one(3, 0.5)), Code.OUT_OF_RANGE, "items[1].motion.q_min[3]"),
        (guide(q_min=one(3, math.inf)), Code.NOT_FINITE, "items[1].motion.q_min[3]"),
        (guide(joint_velocity=0.0), Code.OUT_OF_RANGE, "items[1].motion.joint_velocity"),
        (guide(cartesian_velocity=-1.0), Code.OUT_OF_RANGE, "items[1].motion.cartesian_velocity"),
        (
            wire.Item(motion=wire.Hold(duration=1.0), mode=wire.HandGuidingMode()),
            Code.UNSUPPORTED,
            "items[1].mode",
        ),
        (guide(mode=SPRING), Code.MODE_CONFLICT, "items[1].mode"),
        (guide(POINT), Code.BAD_CONDITION, "items[1].until"),
    ],
)
def test_what_makes_no_sense_is_refused(
    cabinet: FakeCabinet, item: wire.Item, code: Code, parameter: str
) -> None:
    with controller(cabinet.port) as peer:
        answer = peer.ask(run(turn(0.1), item))
        assert isinstance(answer, wire.Rejected)
        assert (answer.code, answer.parameter) == (code, parameter)
        assert answer.text


def test_it_goes_on_until_it_is_cancelled(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        number = started(peer, guide(NEVER, q_max=one(1, 0.5), mode=wire.PositionMode()))
        peer.wait_for(wire.MotionStarted, lambda event: event.id == number)
        peer.ask(wire.Cancel(id=number))
        assert finish(peer, number).cause is CAUSE.CANCELLED


def test_the_core_watches_its_condition(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        finish(peer, started(peer, turn(0.6)))  # the fake's spring pushes there
        number = started(peer, guide(NEVER, PUSHED, wire.AnyOf(n=2)))
        end = finish(peer, number)
        assert (end.cause, end.fired) == (CAUSE.CONDITION, 1)
        assert firing(peer, number).torques.tau_ext[6] == pytest.approx(-6.0, abs=0.05)


def test_who_does_not_control_cannot_begin_it(cabinet: FakeCabinet) -> None:
    with Peer(cabinet.port) as observer:
        answer = observer.ask(run(guide()))
        assert isinstance(answer, wire.Rejected) and answer.code == Code.NOT_IN_CONTROL
