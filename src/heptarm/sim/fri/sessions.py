"""The FRI sessions that an application on the virtual cabinet opens, and the motions under their overlays."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from itertools import count
from math import nan

from heptarm.errors import CommandRejected, HeptarmError
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.messages import CommandMode, IoValue
from heptarm.fri.protocol.version import Version
from heptarm.planning.seam import Hold
from heptarm.sim.control_laws.laws import Superposition
from heptarm.sim.controller.command import MotionCommand, MotionListener
from heptarm.sim.controller.safety import StopRequest
from heptarm.sim.fri.io import IoImageSync, SessionSignal
from heptarm.sim.fri.overlay import MotionOverlay, Reading, control_mode
from heptarm.sim.fri.server import Address, Server
from heptarm.sim.fri.settings import (
    Event,
    OutputWritten,
    OverlayEnded,
    QualityChanged,
    SessionConfiguration,
    StateChanged,
    describe,
)
from heptarm.sim.plant.plant import Plant
from heptarm.sim.plant.shared_state import SharedState
from heptarm.values.mode.mode import Mode, Position
from heptarm.values.robot import RobotModel

_numbers = count(-1, -1)  # of own commands, distinct from those of the application


class PlantArm:
    """A plant that holds its position for overlays.

    Args:
        plant: the plant; must be ticked through this object.
    """

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        self._order = 0
        self._control = m.ControlMode.POSITION

    @property
    def robot(self) -> RobotModel:
        """Dimensions and limits."""
        return self.plant.robot

    @property
    def command_delay(self) -> int:
        """Delay of a client's commands beyond their interpolation [ticks]."""
        return self.plant.fri_command_delay

    @property
    def shared(self) -> SharedState:
        """The plant's shared memory."""
        return self.plant.shared

    def reading(self) -> Reading:
        """The state after the last tick."""
        state, safety = self.plant.snapshot, self.plant.safety
        return Reading(
            **{name: tuple(getattr(state, name).tolist()) for name in m.MONITORED},
            q_ipo=tuple(self.plant.interpolated.tolist()),
            wrench=tuple(state.wrench.tolist()),
            safety=m.Safety.STOP_1
            if safety.stop_requested
            else m.Safety.NORMAL_OPERATION,  # stops stay on the path
            drives=m.DriveState.OFF
            if StopRequest.DRIVE_ERROR in safety.stop_requests
            else m.DriveState.ACTIVE,
            operation_mode=m.OperationMode(int(safety.mode)),
            control_mode=self._control,
        )

    def overlay(self, action: Superposition | None) -> None:
        """Set the overlay of the next tick."""
        self.plant.overlay(action)

    def hold(self, mode: Mode) -> None:
        """Hold the present position in a control mode, until `release`."""
        self._order, self._control = next(_numbers), control_mode(mode)
        self.plant.submit(MotionCommand(self._order, Hold(duration=nan), mode=mode))

    def release(self) -> None:
        """End the hold; the arm rests in position control."""
        self.plant.cancel(self._order)
        self._control = m.ControlMode.POSITION

    def tick(self) -> None:
        """Advance by one millisecond."""
        self.plant.tick()


_log = logging.getLogger("heptarm.sim.fri")

#: Receives changes of a session: state and quality as FRI numbers them, latency and jitter [s].
Channel = Callable[[int, int, float, float], None]
#: During these stops a cabinet writes no outputs.
_STOPS = {StopRequest.EMERGENCY_STOP, StopRequest.EXTERNAL_EMERGENCY_STOP}
#: Ticks after `close` for the last message to be sent.
_FAREWELL = 2


class _Arm(PlantArm):
    """The plant as one of several sessions uses it: a session that only monitors does not end another's overlay."""

    def __init__(self, plant: Plant) -> None:
        super().__init__(plant)
        self._acts = False

    def overlay(self, action: Superposition | None) -> None:
        """Set the overlay of the next tick."""
        if action is not None or self._acts:
            super().overlay(action)
        self._acts = action is not None

    def set_mode(self, mode: Mode) -> None:
        """Set the control mode of the motion under the overlay."""
        self._control = control_mode(mode)


class _Session:
    """One session: forwards its events to the plant, the IO image and the application."""

    def __init__(self, plant: Plant, server: Server, arm: _Arm, sync: IoImageSync, channel: Channel) -> None:
        self._plant, self._channel = plant, channel
        self.server, self.arm, self.sync = server, arm, sync
        self.order = 0  # id of the overlaid command
        self.farewell = -1  # ticks until the port is free; -1: not closing
        server.listener = self._on_event
        server.controller.exchange.veto = self._veto

    def _on_event(self, event: Event) -> None:
        text = describe(event)
        if text:
            _log.info("FRI: %s", text)
        if isinstance(event, OutputWritten):
            self.sync.write(event.value)
        if isinstance(event, OverlayEnded) and event.is_error and self.order:
            self._plant.abort(self.order, event.text)
        if isinstance(event, StateChanged | QualityChanged):
            controller = self.server.controller
            meter = controller.meter
            latency, jitter = 1e-9 * meter.latency_ns, 1e-9 * meter.jitter_ns
            self._channel(int(controller.state), int(controller.quality), latency, jitter)

    def _veto(self, value: IoValue) -> str:
        return self.sync.veto(value, stopped=not _STOPS.isdisjoint(self._plant.safety.stop_requests))


class Sessions:
    """All sessions of a virtual cabinet.

    Args:
        plant: the plant; `tick` comes before each of its ticks, in the same thread.
        version: wire format of the cabinet's FRI.
        speed: simulated seconds per second.
        address: the address here of a client's address at the lab.
    """

    def __init__(
        self, plant: Plant, *, version: Version, speed: float, address: Callable[[str], str] = str
    ) -> None:
        self._plant, self._version, self._speed, self._address = plant, version, speed, address
        self._lock = threading.Lock()
        self._sessions: dict[int, _Session] = {}
        self._last = 0

    def open(
        self,
        client: Address,
        *,
        period_ms: int,
        multiplier: int,
        port: int | None,
        transformations: tuple[str, ...],
        signals: tuple[SessionSignal, ...],
        channel: Channel,
    ) -> int:
        """Open a session to a client; returns its number.

        Raises:
            HeptarmError: an illegal configuration, a port in use, an address that does not resolve.
        """
        image = self._plant.shared.signals
        configuration = SessionConfiguration(
            self._version,
            period_ms=period_ms,
            multiplier=multiplier,
            signals=tuple(signal.value(float(image[signal.place])) for signal in signals),
            transformations=transformations,
        )
        arm = _Arm(self._plant)
        host, remote = client
        server = Server(
            configuration, arm, client=(self._address(host), remote), port=port, speed=self._speed
        )
        session = _Session(self._plant, server, arm, IoImageSync(signals, image), channel)
        server.open()
        with self._lock:
            self._last += 1
            self._sessions[self._last] = session
            return self._last

    def close(self, number: int) -> None:
        """Close a session; its port is free a moment later. Closing twice is legal."""
        with self._lock:
            session = self._sessions.get(number)
        if session is not None and session.farewell < 0:
            session.server.close()
            session.farewell = _FAREWELL

    @property
    def is_any_open(self) -> bool:
        """Whether a session is open."""
        return bool(self._sessions)

    def tick(self) -> None:
        """Advance all sessions; called before each tick of the plant."""
        if not self._sessions:
            return
        for number, session in list(self._sessions.items()):
            session.sync.update(session.server.controller.exchange)
            session.server.tick()
            if session.farewell > 0:
                session.farewell -= 1
            elif session.farewell == 0:
                session.server.release()
                with self._lock:
                    del self._sessions[number]

    def overlaid(
        self, number: int, command: int, order: int, mode: Mode | None, listener: MotionListener
    ) -> MotionListener:
        """The listener of a motion under a session's overlay; it starts and stops the overlay with the motion.

        Raises:
            CommandRejected: there is no such session.
        """
        with self._lock:
            session = self._sessions.get(number)
        if session is None:
            raise CommandRejected(
                f"FRI session {number} is not open; open it first", parameter="session", value=number
            )
        return _Overlaid(self._plant, session, CommandMode(command), order, mode or Position(), listener)


class _Overlaid:
    """Starts and stops a session's overlay with its motion, and forwards the motion's events."""

    def __init__(
        self,
        plant: Plant,
        session: _Session,
        command: CommandMode,
        order: int,
        mode: Mode,
        listener: MotionListener,
    ) -> None:
        self._plant, self._session, self._command = plant, session, command
        self._order, self._mode, self._listener = order, mode, listener

    def started(self) -> None:
        """The motion has begun: start the overlay."""
        self._listener.started()
        self._session.order = self._order
        self._session.arm.set_mode(self._mode)
        try:
            self._session.server.start(MotionOverlay(self._command, control_mode(self._mode)))
        except HeptarmError as error:
            self._plant.abort(self._order, str(error))

    def finished(self, cause: str, text: str) -> None:
        """The motion has ended, and the overlay with it."""
        if self._session.order == self._order:
            self._session.order = 0
            self._session.server.stop()
            self._session.arm.set_mode(Position())
        self._listener.finished(cause, text)
