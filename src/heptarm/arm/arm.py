"""The arm: everything that a program does with the robot goes through it."""

from __future__ import annotations

import atexit
import contextlib
import logging
from collections.abc import Iterator, Sequence
from dataclasses import replace
from types import TracebackType
from typing import TYPE_CHECKING, Literal, overload

from heptarm.arm import fri_settings, program, servo_settings
from heptarm.arm.collision import Guarding
from heptarm.arm.conditions import condition_message
from heptarm.arm.connection import Connection
from heptarm.arm.contact import Touching
from heptarm.arm.equipment import Equipment
from heptarm.arm.fri import Fri
from heptarm.arm.handle import MotionHandle
from heptarm.arm.io import Io
from heptarm.arm.modes import mode_message
from heptarm.arm.observer import Observer
from heptarm.arm.operator import Operator
from heptarm.arm.pad import Pad
from heptarm.arm.servo import JointServo, PoseServo
from heptarm.arm.servo_settings import ServoSettings
from heptarm.arm.stopping import REST_TIMEOUT, Stopping
from heptarm.arm.teaching import Teaching
from heptarm.arm.tooling import Tooling
from heptarm.errors import CommandRejected, HeptarmError, ShapeError, Timeout
from heptarm.values.arrays import within
from heptarm.values.condition import Condition
from heptarm.values.mode import Mode
from heptarm.values.motion import TOOL, Motion
from heptarm.values.result import Result

if TYPE_CHECKING:
    from typing_extensions import Unpack

_log = logging.getLogger("heptarm.arm")



class Arm(Observer, Equipment, Stopping, Touching, Guarding, Teaching):
    """A connected arm; made by `connect`. Its methods may be called from any thread.

    In a `with` block it is left at rest, however the block ends.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._tooling = Tooling(connection)
        self._io = Io(connection)
        self._pad = Pad(connection)
        self._speed = 1.0
        self._mode: Mode | None = None

    # ------------------------------------------------------------------------------- connection

    def open(self, *, control: bool) -> None:
        """Connect; `connect` has done this already. Raises as `connect` does."""
        atexit.register(self.close)
        link = self._connection
        link.open()
        if control:
            link.take_control()
        if link.options.rate > 0 and link.feed.after(0, link.options.timeout) is None:
            raise Timeout(f"the cabinet pushed no state within {link.options.timeout:g} s")

    def reconnect(self) -> None:
        """Make a new connection after the old one was lost; a controller takes control again.

        Raises:
            ConnectFailed: nobody answers.
            NotInControl: another client has taken control meanwhile.
        """
        self._tooling.forget()
        self._connection.reopen()

    def take_control(self) -> None:
        """Ask to control.

        Raises:
            NotInControl: another client controls the robot; the text names it.
        """
        self._tooling.forget()
        self._connection.take_control()

    def release_control(self) -> None:
        """Give control back; what runs is stopped."""
        self._connection.release_control()

    def close(self) -> None:
        """Leave the arm at rest and disconnect; a private simulator ends. Closing twice is legal.

        A controller stops what runs and waits until the arm rests; an observer just leaves.
        """
        if not self._connection.close_once():
            return
        try:
            if self.in_control:
                self._come_to_rest()
        finally:
            atexit.unregister(self.close)
            self._connection.close()

    def _come_to_rest(self) -> None:
        try:
            self.subscribe(rate=100.0, groups=("joints", "motion", "safety"))
            self.stop()
            self._connection.wait_for(self._resting(), REST_TIMEOUT)
            self.release_control()
        except HeptarmError as error:
            _log.warning("closing: %s", error)

    def __enter__(self) -> Arm:
        """The arm itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close it."""
        self.close()

    def __repr__(self) -> str:
        """Short form."""
        link = self._connection
        state = "closed" if link.closed.is_set() else "connected" if link.stands else "lost"
        return f"<Arm {link.title}, {state}, {'in control' if link.controls else 'observing'}>"

    # ------------------------------------------------------------------------------- properties

    @property
    def operator(self) -> Operator:
        """The person beside the robot, to be played by this program; a private simulator only.

        Raises:
            CommandRejected: this is no private simulator.
        """
        if self._connection.cabinet is None:
            raise CommandRejected(
                "only a simulator that this program has started lets it play the operator",
                hint='connect("sim://iiwa14"), or type the words into the terminal of `heptarm sim`',
            )
        return Operator(self._connection.cabinet)

    @property
    def io(self) -> Io:
        """The cabinet's signals: the media flange's, and those of IO groups."""
        return self._io

    @property
    def pad(self) -> Pad:
        """The smartPAD: messages, user keys, process data."""
        return self._pad

    @property
    def in_control(self) -> bool:
        """Whether this client controls the robot, as far as is known."""
        return self._connection.controls and self._connection.stands

    @property
    def speed(self) -> float:
        """Ceiling of the speed of all motions sent, a fraction of each axis' maximum in (0, 1].

        A motion's own speed can only be lower.
        """
        return self._speed

    @speed.setter
    def speed(self, value: float) -> None:
        self._speed = within(value, "speed", 0.0, 1.0, above=True)

    # ---------------------------------------------------------------------------------- motion

    def move(
        self,
        motion: Motion | Sequence[Motion],
        *,
        mode: Mode | None = None,
        speed: float | None = None,
        until: Condition | None = None,
        timeout: float | None = None,
    ) -> Result:
        """Carry out a motion, or several as one batch, and wait until it has ended.

        Args:
            motion: what to do.
            mode: control mode of all of them; None: that of `using`, otherwise position.
            speed: ceiling for this call, (0, 1]; the lower one of this and `arm.speed` counts.
            until: condition that ends it when it holds, as in `until=force > 10`; what is behind the motion that it
                ends does not begin. See heptarm.when; the result says which part of it fired, and where.
            timeout: how long to wait [s]; None: three times as long as it can take, and more.

        Returns:
            How it ended.

        Raises:
            CommandRejected: refused before anything moved; LimitError and others say which value and what is allowed.
            MotionAborted: ended under way; carries cause, state and history.
            ConnectionLost: the cabinet was lost; it stops the arm.
            Timeout: not ended in time; the arm was stopped.
        """
        motions = program.listed(motion)
        if timeout is None and program.is_endless(motions):
            raise ShapeError(
                "this program ends only when it is cancelled",
                parameter="timeout",
                hint="give a timeout, a hold with a duration, or use arm.start()",
            )
        with self._connection.stopping_on_interrupt():
            handle = self._send(motions, mode=mode, speed=speed, until=until, when="queue")
            try:
                return handle.wait(timeout=timeout)
            except Timeout:
                handle.cancel()
                raise

    def start(
        self,
        motion: Motion | Sequence[Motion],
        *,
        mode: Mode | None = None,
        speed: float | None = None,
        until: Condition | None = None,
        when: Literal["queue", "replace", "reject"] = "queue",
    ) -> MotionHandle:
        """Begin a motion, or several as one batch, and return at once.

        Args:
            motion: what to do.
            mode: control mode of all of them; None: that of `using`, otherwise position.
            speed: ceiling for this call, (0, 1].
            until: condition that ends it; see `move`.
            when: while another one runs: "queue" behind it, "replace" it, or "reject" this one.

        Raises:
            CommandRejected: refused; ModeConflict if `when` is "reject" and something runs.
            ConnectionLost: the connection has ended.
        """
        with self._connection.stopping_on_interrupt():
            return self._send(program.listed(motion), mode=mode, speed=speed, until=until, when=when)

    @contextlib.contextmanager
    def using(self, mode: Mode) -> Iterator[None]:
        """A block whose motions and servo motions have a control mode unless they say another.

        Raises:
            ShapeError: it is no mode.
        """
        mode_message(mode)
        outer, self._mode = self._mode, mode
        try:
            yield
        finally:
            self._mode = outer

    def _send(
        self,
        motions: tuple[Motion, ...],
        *,
        mode: Mode | None,
        speed: float | None,
        until: Condition | None,
        when: str,
    ) -> MotionHandle:
        ceiling = self._speed
        if speed is not None:
            ceiling = min(ceiling, within(speed, "speed", 0.0, 1.0, above=True))
        mode, until = mode or self._mode, self._guarded(until)
        return program.send(
            self._connection, self._tooling, motions, ceiling=ceiling, mode=mode, until=until, when=when
        )

    @overload
    def servo(self, kind: Literal["joint"] = "joint", **settings: Unpack[ServoSettings]) -> JointServo: ...
    @overload
    def servo(self, kind: Literal["pose", "lin"], **settings: Unpack[ServoSettings]) -> PoseServo: ...
    def servo(
        self,
        kind: Literal["joint", "pose", "lin"] = "joint",
        *,
        rate: float = 100.0,
        watchdog: float | None = None,
        engine: Literal["smart", "direct"] = "smart",
        mode: Mode | None = None,
        speed: float | None = None,
        acceleration: float | None = None,
        speed_mps: float | None = None,
        acceleration_mps2: float | None = None,
        speed_radps: float | None = None,
        acceleration_radps2: float | None = None,
        min_trajectory_time: float | None = None,
        goal_timeout: float = 300.0,
        speed_timeout: float | None = None,
        moving: str = TOOL,
        until: Condition | None = None,
    ) -> JointServo | PoseServo:
        """A stream of targets that the arm follows; it begins with the `with` block.

        Args:
            kind: what the targets are: "joint" positions; "pose" of the moved frame, to be reached by the joints; or
                "lin": the same, to be reached on straight lines.
            rate: ticks per second of the loop [Hz].
            watchdog: within this time after a target the next one has to come, or the arm stops [s], 0.005 to 2;
                None: five periods, and at least 0.2 s.
            engine: of joints and poses: "smart" plans a limited trajectory to each target; "direct" goes straight for
                it, for targets that are close and smooth.
            mode: control mode; None: position. It may change its parameters while the arm follows.
            speed: of joints and poses: ceiling, a fraction of each axis' maximum in (0, 1]; None: 0.2. The lower one of
                this and `arm.speed` counts.
            acceleration: likewise, of the acceleration and the jerk.
            speed_mps: of "lin": largest speed along each axis of the base [m/s], up to 10; None: 0.25. `arm.speed`
                scales it, since the joints' own limits are not heeded.
            acceleration_mps2: likewise [m/s²], up to 100; None: 1. Not scaled.
            speed_radps: largest speed of the rotation about each axis of the base [rad/s], up to 20; None: 0.5. Scaled.
            acceleration_radps2: likewise [rad/s²], up to 200; None: 2. Not scaled.
            min_trajectory_time: no trajectory to a target is shorter [s]; None: a period and 5 ms.
            goal_timeout: after so long at its target without another one the cabinet's servo motion ends [s]; the
                next target begins a new one.
            speed_timeout: of joints with the engine "smart": how long the velocity of a target is kept after the target
                was passed, before the arm brakes [s], 0.001 to 10; None: 0.1.
            moving: the moved frame: "tool" (the attached tool's, without one the flange), "flange" or a frame's name.
            until: condition that ends it when it holds; the cabinet's application looks 250 times a second, as far as
                its robot answers that fast. See `move`.

        Raises:
            LimitError: a value outside its range.
            CommandRejected: a limit that this kind of stream would not heed.
            ModeConflict: another motion runs (when the block begins).
        """
        message, hertz, seconds = servo_settings.open_message(
            kind,
            rate=rate,
            watchdog=watchdog,
            engine=engine,
            mode=mode or self._mode,
            speed=speed,
            acceleration=acceleration,
            min_trajectory_time=min_trajectory_time,
            goal_timeout=goal_timeout,
            moving=moving,
            line=servo_settings.Line(speed_mps, acceleration_mps2, speed_radps, acceleration_radps2),
            ceiling=self._speed,
            speed_timeout=speed_timeout,
        )
        self._tooling.check_moved(moving, "moving")
        self._tooling.check_mode(mode or self._mode)
        ends, parts = condition_message(self._guarded(until), self._connection.welcome.signals)
        self._tooling.check_until(parts)
        stream = JointServo if kind == "joint" else PoseServo
        return stream(
            self._connection, replace(message, until=ends), rate=hertz, watchdog=seconds, until=parts
        )

    def fri(
        self,
        kind: Literal["position", "torque", "wrench", "pose", "monitor"] = "position",
        **settings: Unpack[fri_settings.FriSettings],
    ) -> Fri:
        """An FRI session, answered by a process of its own; it begins with the `with` block.

        Args:
            kind: what is commanded on top of a hold: joint "position", "torque" (under joint impedance), "wrench"
                (under Cartesian impedance), "pose" (Sunrise 2.x); or "monitor", which runs beside other motions.
            **settings: period_ms: time between two messages, 1 to 100 [ms]; 5, and 1 for a monitor.
                multiplier: every how manieth message is answered; 1.
                mode: control mode of the hold; None: that of `using`, otherwise position.
                law: `law(state, out, params)`, called in the loop's process in every cycle; None: `Fri.command`.
                params: numbers and arrays by name for the law, to be changed while it runs.
                policy: what is sent while commands stay away, `heptarm.fri.Policy`; by default the arm brakes.
                limits: what the guard keeps, `heptarm.fri.Limits`; the robot's, a little inside.
                pose_limits: what it keeps of commanded poses, `heptarm.fri.PoseLimits`; 0.25 m/s and 1 rad/s.
                io: up to ten names of signals, as in `arm.io`, that the session carries: `state.io`, `Fri.output`.
                version: FRI release of the cabinet such as "1.15"; None: told from the first message.
                host: under which address the cabinet reaches this machine; empty: as this connection does.
                port: own UDP port; 0: any free one; None: the first free one of FRI's.
                realtime: ask for real-time priority and locked memory. cpu: processor of the loop; None: any.
                history: messages that are kept. timeout: how long the session may take to stand [s].

        Raises:
            CommandRejected: this cabinet has no such session; ModeConflict: not in this control mode.
            LimitError: a value outside its range.
        """
        settings["mode"] = settings.get("mode") or (None if kind == "monitor" else self._mode)
        self._tooling.check_mode(settings["mode"])
        return Fri(self._connection, fri_settings.request(self._connection, kind, **settings))
