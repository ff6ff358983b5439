"""The controller side of FRI without a cabinet application, for any client: `heptarm sim fri VERSION`.

It behaves like the usual FRI application on a cabinet: it opens a session, holds the position with an overlay as soon
as the connection is good enough, and reports events. Unlike there, nobody has to restart it: after an error it waits
a second and offers the next overlay in the same session.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from heptarm.errors import ModeConflict
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.version import Version
from heptarm.sim.fri.faults import FaultScenario
from heptarm.sim.fri.overlay import MotionOverlay, OverlayTarget, control_mode
from heptarm.sim.fri.server import PORT, Address, Server
from heptarm.sim.fri.sessions import PlantArm
from heptarm.sim.fri.settings import (
    Event,
    OverlayEnded,
    SessionConfiguration,
)
from heptarm.sim.plant.plant import Plant
from heptarm.sim.plant.shared_state import SharedState
from heptarm.sim.runtime.operator import SimulatedOperator
from heptarm.sim.runtime.realtime_loop import ANSWER_GAP, RealtimeLoop
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import Mode, Position

#: Least time between an overlay that ended by an error and the next one [ticks].
PAUSE = 1000
#: Ticks after `close` for the last message to be sent.
FAREWELL = 2

_COMMANDS = {
    "monitor": m.CommandMode.NO_COMMAND,
    "position": m.CommandMode.POSITION,
    "torque": m.CommandMode.TORQUE,
    "wrench": m.CommandMode.WRENCH,
    "pose": m.CommandMode.CARTESIAN_POSE,
}


class SimulatedArm(OverlayTarget, Protocol):
    """An arm that can be ticked, has the time in a shared state, and can hold its position without an application."""

    @property
    def shared(self) -> SharedState:
        """The shared state, see heptarm.sim.plant.shared_state."""

    def tick(self) -> None:
        """One millisecond."""

    def hold(self, mode: Mode) -> None:
        """Hold the present position in a control mode, until `release`."""

    def release(self) -> None:
        """End the hold; the arm rests in position control."""


#: Usual stiffness beneath a torque overlay [Nm/rad], as public applications choose it.
STIFFNESS = 200.0


class OperatedArm(PlantArm):
    """A plant with a simulated operator, who acts before each tick."""

    def __init__(self, plant: Plant, operator: SimulatedOperator) -> None:
        super().__init__(plant)
        self._operator = operator

    def hold(self, mode: Mode) -> None:
        """Hold the present position; continues after a stop that is not requested any more."""
        self.plant.resume()
        super().hold(mode)

    def tick(self) -> None:
        """Advance by one millisecond."""
        self._operator.tick()
        super().tick()


def usual_mode(command: m.CommandMode) -> Mode:
    """The control mode in which a client command mode is mostly used.

    Beneath torques and wrenches it holds the arm: without stiffness a small torque drives a joint into its limit.
    """
    if command is m.CommandMode.TORQUE:
        return JointImpedance(STIFFNESS)
    if command is m.CommandMode.WRENCH:
        return CartesianImpedance()
    return Position()


def command_mode(name: str) -> m.CommandMode:
    """The command mode of a name as in `arm.fri(name)`.

    Raises:
        ModeConflict: there is none of that name; the error lists them.
    """
    if name not in _COMMANDS:
        raise ModeConflict(
            f"FRI command mode must be one of {', '.join(_COMMANDS)}; got {name!r}", parameter="command"
        )
    return _COMMANDS[name]


@dataclass(frozen=True, slots=True, kw_only=True)
class StandaloneSettings:
    """Settings of an FRI controller without a cabinet application.

    Attributes:
        configuration: of the session.
        client: address at which the client listens.
        port: own port; None: see `heptarm.sim.fri.server.source_port`.
        command: client command mode; NO_COMMAND: the client only monitors.
        mode: control mode while holding; None: see `usual_mode`.
        speed: simulated seconds per second.
        scenario: faults to inject.
    """

    configuration: SessionConfiguration = field(
        default_factory=lambda: SessionConfiguration(Version.V1_15, 5)
    )
    client: Address = ("127.0.0.1", PORT)
    port: int | None = None
    command: m.CommandMode = m.CommandMode.POSITION
    mode: Mode | None = None
    speed: float = 1.0
    scenario: FaultScenario | None = None


class Standalone:
    """A simulated arm that any FRI client can command.

    Args:
        arm: the arm.
        settings: session, client and command mode.
        listener: receives events in the arm's thread; must not block.

    Attributes:
        server: the session and its socket.

    Raises:
        ConnectFailed: the port is in use, or the client's address does not resolve.
        CommandRejected: the command mode does not go with version, period or control mode.
    """

    def __init__(
        self,
        arm: SimulatedArm,
        settings: StandaloneSettings,
        *,
        listener: Callable[[Event], None] | None = None,
    ) -> None:
        self._arm = arm
        self._listener = listener
        self._mode = settings.mode or usual_mode(settings.command)
        self._overlay: MotionOverlay | None = None
        if settings.command is not m.CommandMode.NO_COMMAND:
            self._overlay = MotionOverlay(settings.command, control_mode(self._mode))
            self._overlay.check(settings.configuration)
        self._pause = 0  # ticks until the next overlay may begin
        self._holding = False
        self.server = Server(
            settings.configuration,
            arm,
            client=settings.client,
            port=settings.port,
            speed=settings.speed,
            scenario=settings.scenario,
            listener=self._on_event,
        )
        self.loop = RealtimeLoop(arm.shared, self.tick, speed=settings.speed)
        self.loop.answer_gap = ANSWER_GAP

    def tick(self) -> None:
        """Advance session and arm by one millisecond."""
        self.server.tick()
        self._offer()
        self._arm.tick()

    def run(self) -> None:
        """Open the session and tick in real time until `stop`; then close it and free the port."""
        self.server.open()
        try:
            self.loop.run()
        finally:
            self.server.close()
            for _ in range(FAREWELL):
                self.tick()
            self.server.release()

    def stop(self) -> None:
        """End `run`; may be called from a signal handler or another thread."""
        self.loop.stop()

    def _offer(self) -> None:
        """Start a hold with an overlay whenever the session is ready for one."""
        controller = self.server.controller
        self._pause = max(0, self._pause - 1)
        if self._overlay is None or self._pause or controller.overlay is not None:
            return
        if controller.state is not m.SessionState.MONITORING_READY:
            return
        if self._arm.reading().safety is m.Safety.NORMAL_OPERATION:
            self._arm.hold(self._mode)
            self._holding = True
            self.server.start(self._overlay)

    def _on_event(self, event: Event) -> None:
        if isinstance(event, OverlayEnded):
            self._pause = PAUSE
            if self._holding:
                self._holding = False
                self._arm.release()
        if self._listener is not None:
            self._listener(event)
