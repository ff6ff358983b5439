"""Reactions to a break condition in the core: what the robot does then, what may end it, and the forces meanwhile."""

from __future__ import annotations

from math import isnan

import pytest

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.cabinet.conftest import Maker
from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import Peer, run
from tests.cabinet.test_conditions import CAUSE, PUSHED, controller, finish, started, turn

#: Cabinet seconds per second where a request has to arrive during the reaction.
SLOW = 0.15
RETREAT = wire.Retreat(distance=0.1, speed=0.5)
#: Fires at 0.3 rad of A7, where the fake's spring pushes with 3 N.
CORE = wire.SignalOutside(signal="Cell.Level", low=1.0, high=2.0)


def reacting(a7: float, reaction: wire.Reaction | None, *nodes: wire.ConditionNode) -> wire.Item:
    return wire.Item(
        motion=wire.Ptp(q=(0.0,) * 6 + (a7,)),
        until=wire.Condition(nodes=nodes or (PUSHED,)),
        reaction=reaction,
    )


def begun(peer: Peer, item: wire.Item) -> int:
    number = started(peer, item)
    peer.wait_for(wire.ConditionFired, lambda event: event.id == number)
    return number


def test_without_a_reaction_it_stays_and_the_forces_are_reported(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        end = finish(peer, started(peer, reacting(1.1, None)))
        assert (end.cause, end.fired) == (CAUSE.CONDITION, 0)
        assert 3.0 <= end.rest_force <= end.peak_force < 4.0
        assert end.rest_force == pytest.approx(10.0 * end.q[6], abs=0.05)


def test_what_no_condition_ends_reports_no_forces(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        end = finish(peer, started(peer, reacting(0.2, RETREAT)))
        assert end.cause is CAUSE.FINISHED and end.q[6] == pytest.approx(0.2)
        assert isnan(end.peak_force) and isnan(end.rest_force)


def test_relaxing_takes_its_time_before_the_end(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        stays, relaxes = [], []
        for _ in range(2):  # a busy machine makes one of them longer
            stays.append(finish(peer, started(peer, reacting(1.1, None))))
            finish(peer, started(peer, turn(0.0)))
            relaxes.append(finish(peer, started(peer, reacting(1.1, wire.Relax()))))
            finish(peer, started(peer, turn(0.0)))
        assert {(one.cause, one.fired) for one in relaxes} == {(CAUSE.CONDITION, 0)}
        assert min(one.duration for one in relaxes) > min(one.duration for one in stays) + 0.15


@pytest.mark.parametrize("getter", [0.002, 0.01])
@pytest.mark.parametrize("reaction", [None, RETREAT], ids=["stays", "retreats"])
def test_slow_readings_keep_no_motion_from_its_end(
    make: Maker, getter: float, reaction: wire.Reaction | None
) -> None:
    """A getter of a cabinet takes as long as the period of the record of a contact, or longer."""
    with controller(make(getter=getter).port) as peer:
        end = finish(peer, started(peer, reacting(1.1, reaction)))
        assert (end.cause, end.fired) == (CAUSE.CONDITION, 0)
        assert end.peak_force >= 3.0
        assert end.q[6] < (0.5 if reaction is None else 0.1)
        assert finish(peer, started(peer, turn(0.0))).cause is CAUSE.FINISHED


@pytest.mark.parametrize("node", [PUSHED, CORE])
def test_it_retreats_by_what_it_has_passed(cabinet: FakeCabinet, node: wire.ConditionNode) -> None:
    with controller(cabinet.port) as peer:
        end = finish(peer, started(peer, reacting(1.1, RETREAT, node)))
        assert (end.cause, end.fired, end.code) == (CAUSE.CONDITION, 0, 0)
        assert end.q[6] == pytest.approx(0.0, abs=1e-6), (
            "the frame of the fake rests, so it returns to the start"
        )
        assert end.rest_force < 0.1
        if node is PUSHED:
            assert end.peak_force >= 3.0


def test_what_is_queued_begins_after_the_reaction(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        number = started(peer, reacting(1.1, RETREAT), turn(1.1))
        behind = started(peer, turn(-0.1))
        end = finish(peer, number)
        assert (end.cause, end.item) == (CAUSE.CONDITION, 0)
        assert end.q[6] == pytest.approx(0.0, abs=1e-6)
        assert finish(peer, behind).cause is CAUSE.FINISHED


@pytest.mark.parametrize(
    ("request_", "cause"),
    [(wire.Stop(), CAUSE.STOPPED), (wire.Cancel(id=0), CAUSE.CANCELLED)],
    ids=["stop", "cancel"],
)
def test_a_stop_ends_the_reaction(make: Maker, request_: wire.Stop | wire.Cancel, cause: wire.Cause) -> None:
    with controller(make(rate=SLOW).port) as peer:
        number = begun(peer, reacting(1.1, RETREAT))
        assert isinstance(peer.ask(request_), wire.Accepted)
        end = finish(peer, number)
        assert end.cause is cause and end.fired == -1
        assert end.q[6] > 0.05, "it has not moved back to the start"
        assert finish(peer, started(peer, turn(0.0))).cause is CAUSE.FINISHED


def test_a_replacing_program_ends_the_reaction(make: Maker) -> None:
    with controller(make(rate=SLOW).port) as peer:
        number = begun(peer, reacting(1.1, RETREAT))
        answer = peer.ask(run(turn(0.5), when=wire.When.REPLACE))
        assert finish(peer, number).cause is CAUSE.REPLACED
        assert finish(peer, int(answer.id)).cause is CAUSE.FINISHED


def test_a_reaction_needs_a_condition_and_no_hand(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        for item, code in (
            (wire.Item(motion=wire.Ptp(q=(0.0,) * 7), reaction=wire.Relax()), Code.BAD_CONDITION),
            (
                wire.Item(
                    motion=wire.HandGuide(), until=wire.Condition(nodes=(PUSHED,)), reaction=wire.Relax()
                ),
                Code.UNSUPPORTED,
            ),
            (reacting(1.1, wire.Retreat(distance=0.6)), Code.OUT_OF_RANGE),
        ):
            answer = peer.ask(run(item))
            assert isinstance(answer, wire.Rejected) and answer.code == code, answer
            assert answer.parameter.startswith("items[0].reaction")
