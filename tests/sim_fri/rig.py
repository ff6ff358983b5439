"""An arm that follows exactly, a client that obeys the protocol, and both sides of a session on one clock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.version import Version
from heptarm.planning.seam import TICK_NS, HeaderWords
from heptarm.sim.control_laws.laws import Superposition
from heptarm.sim.fri.controller_side import Controller
from heptarm.sim.fri.overlay import MotionOverlay, Reading
from heptarm.sim.fri.settings import Event, OverlayEnded, Refused, SessionConfiguration, StateChanged
from heptarm.sim.plant.shared_state import SharedState
from heptarm.values.checks import Array
from heptarm.values.mode.mode import Mode
from heptarm.values.robot import RobotModel, robot
from tests.oracles.fri.codec import decode_monitoring, encode_command

State = m.SessionState
READY = (0.0, 0.5, 0.1, -1.3, 0.2, 0.9, 0.0)

#: What a client commands in answer to a message of an active session.
Law = Callable[[m.Monitoring], m.Command]


class Arm:
    """Follows its commands at once; external forces are only recorded."""

    def __init__(self, model: str = "iiwa14", *, command_delay: int = 0) -> None:
        self.robot: RobotModel = robot(model)
        self.command_delay = command_delay
        self.q = self.q_ipo = np.array(READY)
        self.action: Superposition | None = None
        self.safety = m.Safety.NORMAL_OPERATION
        self.track: list[Array] = []
        self.loads: list[tuple[Array | None, Array | None]] = []
        self.mode: Mode | None = None
        self.holds = 0
        self.shared = SharedState()

    def reading(self) -> Reading:
        q, ipo = tuple(self.q.tolist()), tuple(self.q_ipo.tolist())
        drives = m.DriveState.ACTIVE if self.safety is m.Safety.NORMAL_OPERATION else m.DriveState.OFF
        return Reading(q, q, ipo, safety=self.safety, drives=drives)

    def overlay(self, action: Superposition | None) -> None:
        if action is None and self.action is not None:
            self.q_ipo = self.q
        self.action = action

    def tick(self) -> None:
        self.shared.header[HeaderWords.NEWEST] += 1
        if self.action is not None:
            self.q = self.action.q
            self.loads.append((self.action.tau, self.action.wrench))
        self.track.append(self.q)

    def hold(self, mode: Mode) -> None:
        self.mode = mode
        self.holds += 1

    def release(self) -> None:
        self.mode = None

    @property
    def leaps(self) -> Array:
        """Largest step of each axis in a tick, shape (7,) [rad]."""
        return np.asarray(np.abs(np.diff(np.array(self.track), axis=0)).max(axis=0))


def mirror(message: m.Monitoring) -> m.Command:
    """A command equal to the interpolator, in any command mode."""
    ipo, header = message.ipo, m.Header(0, 0)
    assert ipo is not None
    return m.Command(
        header,
        q=ipo.q if ipo.pose is None else None,
        tau=(0.0,) * 7 if ipo.command_mode is m.CommandMode.TORQUE else None,
        wrench=(0.0,) * 6 if ipo.command_mode is m.CommandMode.WRENCH else None,
        pose=ipo.pose,
        redundancy=ipo.redundancy,
    )


@dataclass
class Client:
    """Answers like the vendor's client: every n-th message, never in IDLE, mirroring while it waits."""

    version: Version
    law: Law = mirror
    waiting: Law = mirror
    multiplier: int = 1
    sequence: int = 0
    seen: list[m.Monitoring] = field(default_factory=list)
    extra: m.Command = field(default_factory=lambda: m.Command(m.Header(0, 0)))
    _count: int = 0

    def answer(self, datagram: bytes) -> bytes | None:
        message = decode_monitoring(datagram, self.version)
        self.seen.append(message)
        assert message.connection is not None
        state = message.connection.state
        self._count += 1
        if state is State.IDLE or self._count < self.multiplier:
            return None
        self._count = 0
        header = m.Header(self.sequence, message.header.sequence)
        self.sequence += 1
        if state is State.COMMANDING_WAIT:
            command = replace(self.waiting(message), header=header)
        elif state is State.COMMANDING_ACTIVE:
            command = replace(self.law(message), header=header)
        else:
            command = replace(self.extra, header=header)
        return encode_command(command, self.version)


@dataclass
class Rig:
    """Both sides of a session; an answer arrives `latency` after its message, None of the answers if it is silent."""

    version: Version = Version.V1_15
    configuration: SessionConfiguration | None = None
    latency: int = 300_000
    silent: bool = False
    command_delay: int = 0

    def __post_init__(self) -> None:
        self.configuration = self.configuration or SessionConfiguration(self.version)
        self.version = self.configuration.version
        self.arm = Arm(command_delay=self.command_delay)
        self.controller = Controller(
            self.configuration,
            self.arm.robot,
            epoch_ns=1_700_000_000 * 10**9,
            command_delay=self.command_delay,
        )
        self.client = Client(self.version, multiplier=self.configuration.multiplier)
        self.now = 0
        self.events: list[Event] = []
        self._under_way: list[tuple[int, bytes]] = []

    def run(self, ticks: int) -> None:
        for _ in range(ticks):
            self.now += TICK_NS
            while self._under_way and self._under_way[0][0] <= self.now:
                at, answer = self._under_way.pop(0)
                self.controller.receive(answer, at)
            datagram = self.controller.tick(self.arm.reading(), self.now)
            self.arm.overlay(self.controller.superposition)
            self.events += self.controller.events()
            self.arm.tick()
            if datagram is not None:
                answer_now = self.client.answer(datagram)
                if answer_now is not None and not self.silent:
                    self._under_way.append((self.now + self.latency, answer_now))

    def until(self, state: m.SessionState, most: int = 5000) -> Rig:
        for _ in range(most):
            if self.controller.state is state:
                return self
            self.run(1)
        raise AssertionError(f"{self.controller.state.name} instead of {state.name}: {self.reported}")

    def ready(self) -> Rig:
        self.controller.open()
        return self.until(State.MONITORING_READY)

    def waiting(self, overlay: MotionOverlay | None = None) -> Rig:
        self.ready()
        self.controller.start(overlay or MotionOverlay())
        return self.until(State.COMMANDING_WAIT)

    def active(self, overlay: MotionOverlay | None = None) -> Rig:
        return self.waiting(overlay).until(State.COMMANDING_ACTIVE)

    @property
    def states(self) -> list[m.SessionState]:
        return [event.state for event in self.events if isinstance(event, StateChanged)]

    @property
    def end(self) -> OverlayEnded:
        return [event for event in self.events if isinstance(event, OverlayEnded)][-1]

    @property
    def reported(self) -> list[str]:
        return [event.text for event in self.events if isinstance(event, (Refused, OverlayEnded))]

    def command(self, **fields: Any) -> None:
        """From now on the client commands the mirrored values, except for these fields."""
        self.client.law = lambda message: replace(mirror(message), **fields)
