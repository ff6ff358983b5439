"""Each fault a hundred times in a row: it ends in a designed state, its cause in words, and commanding works again."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest

from heptarm.fri import messages as m
from heptarm.fri.session import Session
from heptarm.fri.version import Version
from heptarm.virtual.fri.configuration import Configuration
from heptarm.virtual.fri.faults import Faults, Line, translate
from heptarm.virtual.fri.overlay import MotionOverlay
from tests.virtual_fri.pair import Pair
from tests.virtual_fri.rig import State

QUALITY = "possible connection problem"


def lines(pair: Pair, **faults: float) -> None:
    pair.there, pair.back = (Line(Faults(seed=random.randrange(10**6), **faults)) for _ in range(2))


def lossy(pair: Pair) -> str:
    lines(pair, loss=0.1)
    return QUALITY


def bursts(pair: Pair) -> str:
    lines(pair, burst=0.1, burst_time=0.005)
    return QUALITY


def silent(pair: Pair) -> str:
    lines(pair, loss=1.0)
    pair.run(200)
    return QUALITY


def stopped(pair: Pair) -> str:
    pair.arm.safety = random.choice((m.Safety.STOP_0, m.Safety.STOP_1, m.Safety.STOP_2))
    return "safety stop"


def killed_client(pair: Pair) -> str:
    pair.alive = False
    return QUALITY


def jumping(pair: Pair) -> str:
    pair.setpoint.q = (1.0,) * 7
    return "Illegal axis delta"


def foreign(pair: Pair) -> str:
    """The cabinet speaks another version for a while, so that the client understands nothing."""
    whole = pair.there.send

    def send(datagram: bytes, now: int) -> None:
        whole(translate(datagram, Version.V1_15, Version.V2_7), now)

    pair.session = Session(Version.V1_15)
    pair.there.send = send  # type: ignore[method-assign]
    return QUALITY


@pytest.mark.slow
@pytest.mark.parametrize("fault", [lossy, bursts, silent, stopped, killed_client, jumping, foreign])
def test_a_hundred_times(fault: Callable[[Pair], str]) -> None:
    random.seed(7)
    pair = Pair(Configuration(Version.V1_15))
    for turn in range(1, 101):
        pair.active(MotionOverlay())
        text = fault(pair)
        for _ in range(2000):
            if len(pair.ends) == turn:
                break
            pair.run(1)
        end = pair.ends[-1]
        assert len(pair.ends) == turn and end.is_error and text in end.text
        assert pair.controller.state in (State.MONITORING_WAIT, State.MONITORING_READY)
        pair.there, pair.back = Line(), Line()
        pair.arm.safety, pair.setpoint.q = m.Safety.NORMAL_OPERATION, None
        if not pair.alive or fault is foreign:
            pair.session, pair.alive = Session(), True
        pair.run(130)  # what was lost has left the window


@pytest.mark.slow
def test_garbage_between_the_datagrams_a_hundred_times() -> None:
    generator, pair = random.Random(5), Pair(Configuration(Version.V2_7))
    pair.active(MotionOverlay())
    for _ in range(100):
        for _ in range(10):
            pair.controller.receive(generator.randbytes(generator.randrange(1500)), pair.now)
            pair.session.receive(generator.randbytes(generator.randrange(1500)), pair.now)
        pair.run(2)
    assert pair.controller.state is pair.session.state is State.COMMANDING_ACTIVE
    assert pair.controller.traffic.refused == 1000 and pair.session.counters.malformed == 1000
