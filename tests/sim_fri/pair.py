"""heptarm's controller and heptarm's client on one clock, with a line between them that may have faults."""

from __future__ import annotations

from dataclasses import dataclass, field

from heptarm.fri.protocol import messages as m
from heptarm.planning.seam import TICK_NS
from heptarm.sim.fri.controller_side import Controller
from heptarm.sim.fri.faults import NONE, FaultyLink, LinkFaults
from heptarm.sim.fri.overlay import MotionOverlay
from heptarm.sim.fri.settings import Event, OverlayEnded, SessionConfiguration
from tests.oracles.fri.answers import Setpoint
from tests.oracles.fri.session import Session
from tests.sim_fri.rig import Arm, State


@dataclass
class Pair:
    """A controller and heptarm's client, one tick after the other; the client's answers take 0.3 ms."""

    configuration: SessionConfiguration
    faults: LinkFaults = NONE
    setpoint: Setpoint = field(default_factory=Setpoint)

    def __post_init__(self) -> None:
        self.arm, self.session, self.now = Arm(), Session(), 0
        self.there, self.back = FaultyLink(self.faults), FaultyLink(self.faults)
        self.events: list[Event] = []
        self.alive = True  # the client's process
        self.renew()

    def renew(self) -> None:
        self.controller = Controller(self.configuration, self.arm.robot)
        self.controller.open()

    def run(self, ticks: int) -> None:
        for _ in range(ticks):
            self.now += TICK_NS
            for answer in self.back.arrived(self.now):
                self.controller.receive(answer, self.now - 700_000)
            datagram = self.controller.tick(self.arm.reading(), self.now)
            self.arm.overlay(self.controller.superposition)
            self.arm.tick()
            self.events += self.controller.events()
            if datagram is not None:
                self.there.send(datagram, self.now)
            for message in self.there.arrived(self.now):
                if self.alive and self.session.receive(message, self.now) is not None:
                    answer_now = self.session.answer(self.setpoint)
                    if answer_now is not None:
                        self.back.send(answer_now, self.now)

    def until(self, state: m.SessionState) -> None:
        for _ in range(4000):
            if self.controller.state is self.session.state is state:
                return
            self.run(1)
        raise AssertionError(
            f"{self.controller.state.name}, {self.session.state.name} instead of {state.name}"
        )

    def active(self, overlay: MotionOverlay) -> None:
        self.until(State.MONITORING_READY)
        self.controller.start(overlay)
        self.until(State.COMMANDING_ACTIVE)

    @property
    def ends(self) -> list[OverlayEnded]:
        return [event for event in self.events if isinstance(event, OverlayEnded)]
