"""The FRI sessions that an application on the virtual cabinet opens, and the motions that their clients overlay."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

from heptarm.errors import CommandRejected, HeptarmError
from heptarm.fri.messages import CommandMode, IoValue
from heptarm.fri.version import Version
from heptarm.values.mode import Mode, Position
from heptarm.virtual.fri.configuration import Configuration
from heptarm.virtual.fri.events import Event, OutputWritten, OverlayEnded, QualityChanged, StateChanged
from heptarm.virtual.fri.overlay import MotionOverlay, Superposition
from heptarm.virtual.fri.plant_arm import PlantArm
from heptarm.virtual.fri.server import Address, Server
from heptarm.virtual.fri.signals import Bridge, SessionSignal
from heptarm.virtual.fri.standalone import control_of, words
from heptarm.virtual.order import Listener
from heptarm.virtual.plant import Plant
from heptarm.virtual.safety import Demand

_log = logging.getLogger("heptarm.virtual.fri")

#: Hears of a session: numbers of state and quality as FRI transmits them, latency and jitter [s].
Channel = Callable[[int, int, float, float], None]
#: During these a cabinet writes no outputs.
_STOPS = {Demand.EMERGENCY_STOP, Demand.EXTERNAL_EMERGENCY_STOP}
#: Ticks after `close` in which the last message leaves.
_FAREWELL = 2


class _Arm(PlantArm):
    """The plant as one of several sessions sees it: a session that only monitors does not end another one's overlay."""

    def __init__(self, plant: Plant) -> None:
        super().__init__(plant)
        self._acts = False

    def overlay(self, action: Superposition | None) -> None:
        """Take what the next tick does."""
        if action is not None or self._acts:
            super().overlay(action)
        self._acts = action is not None

    def takes(self, mode: Mode) -> None:
        """The motion under the overlay has this control mode."""
        self._control = control_of(mode)


class _Session:
    def __init__(self, server: Server, arm: _Arm, bridge: Bridge) -> None:
        self.server, self.arm, self.bridge = server, arm, bridge
        self.order = 0  # whose motion is overlaid
        self.farewell = -1  # ticks until the port is free; -1: not closing


class Sessions:
    """All sessions of a virtual cabinet.

    Args:
        plant: the plant; `tick` comes before each of its ticks, in the same thread.
        version: wire format of the cabinet's FRI.
        speed: simulated seconds per second.
    """

    def __init__(self, plant: Plant, *, version: Version, speed: float) -> None:
        self._plant, self._version, self._speed = plant, version, speed
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
            HeptarmError: an illegal configuration, a port that is taken, an address that is none.
        """
        image = self._plant.ring.signals
        configuration = Configuration(
            self._version,
            period_ms=period_ms,
            multiplier=multiplier,
            signals=tuple(one.value(float(image[one.place])) for one in signals),
            transformations=transformations,
        )
        arm = _Arm(self._plant)
        server = Server(configuration, arm, client=client, port=port, speed=self._speed)
        session = _Session(server, arm, Bridge(signals, image))

        def hear(event: Event) -> None:
            text = words(event)
            if text:
                _log.info("FRI: %s", text)
            if isinstance(event, OutputWritten):
                session.bridge.write(event.value)
            if isinstance(event, OverlayEnded) and event.is_error and session.order:
                self._plant.abort(session.order, event.text)
            if isinstance(event, StateChanged | QualityChanged):
                controller = server.controller
                meter = controller.meter
                channel(
                    int(controller.state),
                    int(controller.quality),
                    1e-9 * meter.latency_ns,
                    1e-9 * meter.jitter_ns,
                )

        def veto(value: IoValue) -> str:
            return session.bridge.veto(value, stopped=not _STOPS.isdisjoint(self._plant.safety.demands))

        server.listener = hear
        server.controller.exchange.veto = veto
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
    def any(self) -> bool:
        """Whether a session stands."""
        return bool(self._sessions)

    def tick(self) -> None:
        """What comes before a tick of the plant."""
        if not self._sessions:
            return
        for number, session in list(self._sessions.items()):
            session.bridge.show(session.server.controller.exchange)
            session.server.tick()
            if session.farewell > 0:
                session.farewell -= 1
            elif session.farewell == 0:
                session.server.release()
                with self._lock:
                    del self._sessions[number]

    def overlaid(
        self, number: int, command: int, order: int, mode: Mode | None, listener: Listener
    ) -> Listener:
        """The listener of a motion that a session's client overlays; it begins and ends the overlay with the motion.

        Raises:
            CommandRejected: there is no such session.
        """
        with self._lock:
            session = self._sessions.get(number)
        if session is None:
            raise CommandRejected(f"FRI session {number} is not open", parameter="session", value=number)
        return _Overlaid(self._plant, session, CommandMode(command), order, mode or Position(), listener)


class _Overlaid:
    """Listens to a motion for a session, and passes on what it hears."""

    def __init__(
        self,
        plant: Plant,
        session: _Session,
        command: CommandMode,
        order: int,
        mode: Mode,
        listener: Listener,
    ) -> None:
        self._plant, self._session, self._command = plant, session, command
        self._order, self._mode, self._listener = order, mode, listener

    def started(self) -> None:
        """The motion has begun: wait for the client's commands."""
        self._listener.started()
        self._session.order = self._order
        self._session.arm.takes(self._mode)
        try:
            self._session.server.start(MotionOverlay(self._command, control_of(self._mode)))
        except HeptarmError as error:
            self._plant.abort(self._order, str(error))

    def finished(self, cause: str, text: str) -> None:
        """The motion has ended, and the overlay with it."""
        if self._session.order == self._order:
            self._session.order = 0
            self._session.server.stop()
            self._session.arm.takes(Position())
        self._listener.finished(cause, text)
