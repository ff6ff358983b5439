"""The controller side of FRI without a cabinet application: for any client, as `heptarm sim --fri VERSION` offers it.

It does what the usual FRI application on a cabinet does: open a session, hold the position with an overlay on it as
soon as the client answers well enough, and say what happens. Other than there nobody has to start it anew: after an
error it waits a moment and offers the next overlay in the same session.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from heptarm.errors import ModeConflict
from heptarm.fri import messages as m
from heptarm.fri.version import Version
from heptarm.values.mode import CartesianImpedance, JointImpedance, Mode, Position
from heptarm.virtual.fri.configuration import Configuration
from heptarm.virtual.fri.events import (
    Event,
    FrameProvided,
    OutputWritten,
    OverlayEnded,
    QualityChanged,
    Refused,
    StateChanged,
)
from heptarm.virtual.fri.faults import Scenario
from heptarm.virtual.fri.overlay import HoldingTarget, MotionOverlay
from heptarm.virtual.fri.server import PORT, Address, Server
from heptarm.virtual.pacer import ROOM, Pacer
from heptarm.virtual.ring import Ring

#: After an overlay has ended by an error, the next one begins so many ticks later at the earliest.
PAUSE = 1000
#: Ticks after `close` in which the last message leaves.
FAREWELL = 2

_COMMANDS = {
    "monitor": m.CommandMode.NO_COMMAND,
    "position": m.CommandMode.POSITION,
    "torque": m.CommandMode.TORQUE,
    "wrench": m.CommandMode.WRENCH,
    "pose": m.CommandMode.CARTESIAN_POSE,
}


class SimulatedArm(HoldingTarget, Protocol):
    """An arm that can be ticked, and whose ring tells the time."""

    @property
    def ring(self) -> Ring:
        """The shared ring, see heptarm.virtual.ring."""

    def tick(self) -> None:
        """One millisecond."""


def usual_mode(command: m.CommandMode) -> Mode:
    """The control mode in which a client command mode is mostly used: the softest that holds nothing else."""
    if command is m.CommandMode.TORQUE:
        return JointImpedance(0.0)
    if command is m.CommandMode.WRENCH:
        return CartesianImpedance((0.0,) * 6)
    return Position()


def control_of(mode: Mode) -> m.ControlMode:
    """What FRI calls a control mode."""
    if isinstance(mode, Position):
        return m.ControlMode.POSITION
    return (
        m.ControlMode.JOINT_IMPEDANCE
        if isinstance(mode, JointImpedance)
        else m.ControlMode.CARTESIAN_IMPEDANCE
    )


def command_mode(name: str) -> m.CommandMode:
    """The command mode of a name as in `arm.fri(name)`.

    Raises:
        ModeConflict: there is none of that name; the text lists them.
    """
    if name not in _COMMANDS:
        raise ModeConflict(
            f"no FRI command mode {name!r}; there are {', '.join(_COMMANDS)}", parameter="command"
        )
    return _COMMANDS[name]


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """What the controller offers, and to whom.

    Attributes:
        configuration: of the session.
        client: where the client listens.
        port: own port; None: see `heptarm.virtual.fri.server.source_port`.
        command: what the client may command; NO_COMMAND: it only monitors.
        mode: control mode of the hold; None: the usual one of the command mode.
        speed: simulated seconds per second.
        scenario: faults on purpose.
    """

    configuration: Configuration = field(default_factory=lambda: Configuration(Version.V1_15, 5))
    client: Address = ("127.0.0.1", PORT)
    port: int | None = None
    command: m.CommandMode = m.CommandMode.POSITION
    mode: Mode | None = None
    speed: float = 1.0
    scenario: Scenario | None = None


class Standalone:
    """A simulated arm that any FRI client can command.

    Args:
        arm: the arm.
        settings: what it offers.
        listener: hears of events in the arm's thread; must not block.

    Attributes:
        server: the session and its socket.

    Raises:
        ConnectFailed: the port is taken, or the client's address is none.
        CommandRejected: the command mode does not go with version, period or control mode.
    """

    def __init__(
        self, arm: SimulatedArm, settings: Settings, *, listener: Callable[[Event], None] | None = None
    ) -> None:
        self._arm = arm
        self._listener = listener
        self._mode = settings.mode or usual_mode(settings.command)
        self._overlay: MotionOverlay | None = None
        if settings.command is not m.CommandMode.NO_COMMAND:
            self._overlay = MotionOverlay(settings.command, control_of(self._mode))
            self._overlay.check(settings.configuration)
        self._patience = 0  # ticks until the next overlay may begin
        self._holding = False
        self.server = Server(
            settings.configuration,
            arm,
            client=settings.client,
            port=settings.port,
            speed=settings.speed,
            scenario=settings.scenario,
            listener=self._hear,
        )
        self.pacer = Pacer(arm.ring, self.tick, speed=settings.speed)
        self.pacer.room = ROOM

    def tick(self) -> None:
        """One millisecond of session and arm."""
        self.server.tick()
        self._offer()
        self._arm.tick()

    def run(self) -> None:
        """Open the session and tick in real time until `stop`; then close it and free the port."""
        self.server.open()
        try:
            self.pacer.run()
        finally:
            self.server.close()
            for _ in range(FAREWELL):
                self.tick()
            self.server.release()

    def stop(self) -> None:
        """End `run`; may be called from a signal handler or another thread."""
        self.pacer.stop()

    def _offer(self) -> None:
        """Hold with an overlay whenever the session is ready for one."""
        controller = self.server.controller
        self._patience = max(0, self._patience - 1)
        if self._overlay is None or self._patience or controller.state is not m.SessionState.MONITORING_READY:
            return
        if self._arm.reading().safety is m.Safety.NORMAL_OPERATION:
            self._arm.hold(self._mode)
            self._holding = True
            self.server.start(self._overlay)

    def _hear(self, event: Event) -> None:
        if isinstance(event, OverlayEnded):
            self._patience = PAUSE
            if self._holding:
                self._holding = False
                self._arm.release()
        if self._listener is not None:
            self._listener(event)


def words(event: Event) -> str:
    """An event in one line for a person; empty for what happens too often to be told."""
    if isinstance(event, StateChanged):
        return f"session {event.before.name} -> {event.state.name}"
    if isinstance(event, QualityChanged):
        return (
            f"quality {event.before.name} -> {event.quality.name} "
            f"(latency {1e3 * event.latency:.2f} ms, jitter {1e3 * event.jitter:.2f} ms)"
        )
    if isinstance(event, OverlayEnded):
        return f"overlay ended: {event.text or event.cause}"
    if isinstance(event, OutputWritten):
        return f"output {event.value.name} = {event.value.value:g}"
    if isinstance(event, FrameProvided):
        frame = event.transformation
        return f"frame {frame.name} = {', '.join(f'{value:g}' for value in frame.values)}"
    return event.text if isinstance(event, Refused) else ""
