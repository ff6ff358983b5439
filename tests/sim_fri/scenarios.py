"""Faults of a session, repeated: it ends as designed with its cause as text, and the next one works."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace

from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.version import Version
from heptarm.sim.fri.faults import FaultyLink, LinkFaults, translate
from heptarm.sim.fri.overlay import MotionOverlay
from heptarm.sim.fri.settings import SessionConfiguration
from tests.oracles.fri.session import Session
from tests.sim_fri.pair import Pair
from tests.sim_fri.rig import State

QUALITY = "possible connection problem"


def _lines(pair: Pair, faults: LinkFaults) -> None:
    pair.there, pair.back = (FaultyLink(replace(faults, seed=random.randrange(10**6))) for _ in range(2))


def lossy(pair: Pair) -> str:
    """A tenth of all datagrams is lost."""
    _lines(pair, LinkFaults(loss=0.1))
    return QUALITY


def bursts(pair: Pair) -> str:
    """Datagrams are held back for 5 ms and arrive together."""
    _lines(pair, LinkFaults(burst=0.1, burst_time=0.005))
    return QUALITY


def silent(pair: Pair) -> str:
    """200 ms in which nothing arrives."""
    _lines(pair, LinkFaults(loss=1.0))
    pair.run(200)
    return QUALITY


def stopped(pair: Pair) -> str:
    """A safety stop."""
    pair.arm.safety = random.choice((m.Safety.STOP_0, m.Safety.STOP_1, m.Safety.STOP_2))
    return "safety stop"


def mute(pair: Pair) -> str:
    """The client stops answering."""
    pair.alive = False
    return QUALITY


def jumping(pair: Pair) -> str:
    """A client without a guard commands a jump."""
    pair.setpoint.q = (1.0,) * 7
    return "Illegal axis delta"


def foreign(pair: Pair) -> str:
    """The cabinet speaks another version for a while, so that the client understands nothing."""
    whole = pair.there.send

    def send(datagram: bytes, now: int) -> None:
        said = pair.controller.said
        assert said is not None
        whole(translate(said, Version.V2_7), now)

    pair.session = Session(Version.V1_15)
    pair.there.send = send  # type: ignore[method-assign]
    return QUALITY


def reordered(pair: Pair) -> str:
    """A third of all datagrams is overtaken by the next one."""
    _lines(pair, LinkFaults(reorder=0.3))
    return QUALITY


def corrupt(pair: Pair) -> str:
    """A fifth of all datagrams is damaged; their check sums show it."""
    _lines(pair, LinkFaults(corrupt=0.2))
    return QUALITY


FAULTS: tuple[Callable[[Pair], str], ...] = (
    *(lossy, bursts, silent, stopped, mute, jumping, foreign, reordered, corrupt),
)


def again(fault: Callable[[Pair], str], times: int) -> int:
    """Repeat it in one session of the controller; return how often it went as designed."""
    random.seed(7)
    pair = Pair(SessionConfiguration(Version.V2_7 if fault is corrupt else Version.V1_15))
    for turn in range(1, times + 1):
        pair.active(MotionOverlay())
        text = fault(pair)
        for _ in range(2000):
            if len(pair.ends) == turn:
                break
            pair.run(1)
        end = pair.ends[-1]
        assert len(pair.ends) == turn and end.is_error and text in end.text
        assert pair.controller.state in (State.MONITORING_WAIT, State.MONITORING_READY)
        if fault is foreign:
            assert "the other side speaks FRI 2.7" in pair.session.trouble
        counts = pair.session.counters
        assert fault is not reordered or counts.reordered >= turn
        assert fault is not corrupt or counts.malformed >= turn
        pair.there, pair.back = FaultyLink(), FaultyLink()
        pair.arm.safety, pair.setpoint.q = m.Safety.NORMAL_OPERATION, None
        if not pair.alive or fault is foreign:
            pair.session, pair.alive = Session(), True
        pair.run(130)  # what was lost has left the window
    pair.active(MotionOverlay())
    return len(pair.ends)


def duplicates(times: int) -> int:
    """A third of all datagrams arrives twice, in both directions; commanding continues, duplicates are ignored."""
    pair = Pair(SessionConfiguration(Version.V1_15))
    pair.active(MotionOverlay())
    for turn in range(1, times + 1):
        _lines(pair, LinkFaults(duplicate=0.3))
        pair.run(20)
        assert pair.controller.state is pair.session.state is State.COMMANDING_ACTIVE
        assert pair.session.counters.duplicated >= turn and pair.controller.traffic.stale >= turn
    assert pair.session.counters.lost == pair.controller.meter.counts.late == 0 and not pair.ends
    return times


def garbage(times: int) -> int:
    """Garbage to both sides of an open session; it continues, and every piece is counted."""
    generator, pair = random.Random(5), Pair(SessionConfiguration(Version.V2_7))
    pair.active(MotionOverlay())
    for turn in range(1, times + 1):
        for _ in range(10):
            pair.controller.receive(generator.randbytes(generator.randrange(1500)), pair.now)
            pair.session.receive(generator.randbytes(generator.randrange(1500)), pair.now)
        pair.run(2)
        assert pair.controller.state is pair.session.state is State.COMMANDING_ACTIVE
        assert pair.controller.traffic.refused == pair.session.counters.malformed == 10 * turn
    return times
