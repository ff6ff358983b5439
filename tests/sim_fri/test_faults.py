"""Faults do what their names state, reproducibly, and a session survives or ends as it should."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pytest

from heptarm.errors import LimitError
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.protobuf import MalformedMessage
from heptarm.fri.protocol.version import Version, recognise
from heptarm.planning.seam import TICK_NS
from heptarm.sim.fri.faults import NONE, FaultScenario, FaultyLink, LinkFaultCounts, LinkFaults
from heptarm.sim.fri.overlay import MotionOverlay
from heptarm.sim.fri.settings import OverlayEnded
from tests.long import longer
from tests.oracles.fri.codec import decode_monitoring
from tests.sim_fri.rig import Arm, Rig, State

MS = 1_000_000


def sent(faults: LinkFaults, count: int = 2000) -> tuple[list[tuple[int, int]], LinkFaultCounts]:
    """Fate of datagrams 0, 1, 2 … sent each millisecond: time of arrival [ms], and the counts."""
    line, found = FaultyLink(faults), []
    for tick in range(count + 200):
        if tick < count:
            line.send(tick.to_bytes(4, "big") * 5, tick * MS)
        found += [(tick, int.from_bytes(datagram[:4], "big")) for datagram in line.arrived(tick * MS)]
    return found, line.damage


def test_a_good_line_carries_everything_at_once() -> None:
    found, damage = sent(NONE)
    assert found == [(n, n) for n in range(2000)] and damage == LinkFaultCounts(passed=2000)


@pytest.mark.parametrize(
    ("faults", "count", "fraction"),
    [
        (LinkFaults(loss=0.1), lambda d: d.lost, 0.1),
        (LinkFaults(duplicate=0.2), lambda d: d.duplicated, 0.2),
        (LinkFaults(corrupt=0.05), lambda d: d.corrupted, 0.05),
        (LinkFaults(reorder=0.1), lambda d: d.reordered, 0.1),
    ],
)
def test_a_fraction_is_that_fraction(
    faults: LinkFaults, count: Callable[[LinkFaultCounts], int], fraction: float
) -> None:
    found, damage = sent(faults)
    assert count(damage) == pytest.approx(2000 * fraction, rel=0.2)
    assert damage.passed == 2000 - damage.lost + damage.duplicated and len(found) == damage.passed


def test_delay_and_jitter_are_times() -> None:
    found, _ = sent(LinkFaults(delay=0.005, jitter=0.01))
    waits = [arrived - number for arrived, number in found]
    assert min(waits) >= 5 and max(waits) <= 16 and len(set(waits)) > 5


def test_reordering_changes_neighbours() -> None:
    numbers = [number for _, number in sent(LinkFaults(reorder=0.1))[0]]
    assert sorted(numbers) == list(range(2000)) and numbers != sorted(numbers)


def test_a_burst_holds_everything_back_to_its_end() -> None:
    found, _ = sent(LinkFaults(burst=0.02, burst_time=0.005))
    by_tick: dict[int, int] = {}
    for tick, _ in found:
        by_tick[tick] = by_tick.get(tick, 0) + 1
    assert [number for _, number in found] == list(range(2000))
    assert max(by_tick.values()) >= 5 and max(tick - number for tick, number in found) == 5


def test_in_silence_nothing_passes() -> None:
    numbers = [number for _, number in sent(LinkFaults(silence=((0.1, 0.3), (1.0, 1.1))))[0]]
    assert numbers == [n for n in range(2000) if not (100 <= n < 300 or 1000 <= n < 1100)]


def test_the_same_seed_gives_the_same_faults() -> None:
    faults: dict[str, Any] = {"loss": 0.1, "duplicate": 0.1, "corrupt": 0.1, "reorder": 0.1, "jitter": 0.003}
    assert sent(LinkFaults(seed=5, **faults)) == sent(LinkFaults(seed=5, **faults))
    assert sent(LinkFaults(seed=5, **faults)) != sent(LinkFaults(seed=6, **faults))


@pytest.mark.parametrize(
    ("name", "value"), [("loss", 1.1), ("corrupt", -0.1), ("delay", -1.0), ("jitter", float("nan"))]
)
def test_nonsense_is_refused(name: str, value: float) -> None:
    wrong: dict[str, Any] = {name: value}
    with pytest.raises(LimitError, match=name):
        LinkFaults(**wrong)


# ------------------------------------------------------------------------------ sessions under faults


@dataclass
class Trial:
    """A session that is commanding without faults, then under a scenario."""

    scenario: FaultScenario
    version: Version = Version.V1_15
    rig: Rig = field(init=False)
    unreadable: int = 0

    def __post_init__(self) -> None:
        self.rig = Rig(self.version).active()
        self.rig.run(200)
        self.there, self.back = FaultyLink(self.scenario.to_client), FaultyLink(self.scenario.from_client)
        self.begin = self.rig.now

    def run(self, ticks: int) -> Trial:
        rig = self.rig
        for _ in range(ticks):
            rig.now += TICK_NS
            for answer in self.back.arrived(rig.now):
                rig.controller.receive(answer, rig.now - 500_000)
            elapsed = (rig.now - self.begin) * 1e-9
            rig.arm.safety = self.scenario.safety(elapsed) or m.Safety.NORMAL_OPERATION
            datagram = rig.controller.tick(rig.arm.reading(), rig.now)
            rig.arm.overlay(rig.controller.superposition)
            rig.events += rig.controller.events()
            rig.arm.tick()
            assert datagram is not None
            said = rig.controller.said
            assert said is not None
            self.there.send(self.scenario.sent(datagram, said, elapsed), rig.now)
            for message in self.there.arrived(rig.now):
                try:
                    answer_now = rig.client.answer(message)
                except MalformedMessage:
                    self.unreadable += 1  # a client drops what it cannot read
                    continue
                if answer_now is not None:
                    self.back.send(answer_now, rig.now)
        return self

    @property
    def causes(self) -> list[str]:
        return [event.cause for event in self.rig.events if isinstance(event, OverlayEnded)]

    def works_again(self) -> None:
        """After the faults, the same session returns to commanding."""
        rig = self.rig
        rig.arm.safety = m.Safety.NORMAL_OPERATION
        rig.until(State.MONITORING_READY)
        rig.controller.start(MotionOverlay())
        rig.until(State.COMMANDING_ACTIVE)


def test_a_good_line_keeps_commanding() -> None:
    trial = Trial(FaultScenario()).run(500)
    assert trial.causes == [] and trial.rig.controller.quality is m.Quality.EXCELLENT


@pytest.mark.parametrize("seed", range(longer(1, 3)))
@pytest.mark.parametrize(
    ("faults", "least"),
    [
        (LinkFaults(loss=0.01), m.Quality.GOOD),
        (LinkFaults(duplicate=0.3), m.Quality.EXCELLENT),
        (LinkFaults(jitter=0.0005), m.Quality.EXCELLENT),
    ],
)
def test_small_faults_keep_commanding(faults: LinkFaults, least: m.Quality, seed: int) -> None:
    faults = LinkFaults(
        **{name: getattr(faults, name) for name in ("loss", "duplicate", "jitter")}, seed=seed
    )
    trial = Trial(FaultScenario(from_client=faults)).run(500)
    assert trial.causes == [] and trial.rig.controller.quality >= least


@pytest.mark.parametrize("seed", range(longer(1, 3)))
@pytest.mark.parametrize("version", [Version.V1_11, Version.V2_7])
@pytest.mark.parametrize(
    "faults",
    [{"loss": 0.1}, {"burst": 0.05}, {"jitter": 0.02}, {"corrupt": 0.2}, {"delay": 0.03}, {"reorder": 0.3}],
)
def test_great_faults_end_commanding_by_quality(faults: dict[str, Any], version: Version, seed: int) -> None:
    both = LinkFaults(seed=seed, **faults)
    trial = Trial(FaultScenario(to_client=both, from_client=both), version)
    while not trial.causes and trial.rig.now < 3_000 * MS:
        trial.run(20)
    # a damaged command of a version without CRC may still be decodable, and illegal
    assert trial.causes[0] == "quality" or ("corrupt" in faults and not version.traits.framed)
    trial.works_again()


def test_silence_ends_commanding_and_the_next_overlay_works() -> None:
    trial = Trial(FaultScenario(to_client=LinkFaults(silence=((0.05, 0.25),)))).run(400)
    assert trial.causes == ["quality"] and trial.rig.controller.state is State.MONITORING_READY
    trial.works_again()


def test_a_safety_stop_ends_commanding_and_the_next_overlay_works() -> None:
    trial = Trial(FaultScenario(stops=(((0.05, 0.25), m.Safety.STOP_1),))).run(100)
    assert trial.causes == ["safety"]
    trial.works_again()


@pytest.mark.parametrize("own", Version)
@pytest.mark.parametrize("other", Version)
def test_a_cabinet_can_speak_another_version(own: Version, other: Version) -> None:
    trial = Trial(FaultScenario(version=other), own)
    rig, scenario = trial.rig, trial.scenario
    datagram = rig.controller.tick(Arm().reading(), rig.now)
    assert datagram is not None
    assert rig.controller.said is not None
    strange = scenario.sent(datagram, rig.controller.said, 0.0)
    reported, spoken = recognise(strange), decode_monitoring(strange, other)
    assert reported is other or {reported, other} == {Version.V1_11, Version.V1_15}
    assert spoken.header == decode_monitoring(datagram, own).header


def test_a_wrong_version_ends_commanding_by_quality() -> None:
    trial = Trial(FaultScenario(version=Version.V2_7, strange=((0.1, 0.3),))).run(200)
    assert trial.causes == ["quality"] and trial.unreadable > 50
    trial.works_again()
