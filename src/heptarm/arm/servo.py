"""Servo motions: a stream of targets that the arm follows while it is being told.

::

    with arm.servo("joint", rate=100) as sv:
        while (dt := sv.tick()) and sv.t < 5:
            sv.set(sv.start.q + [0, 0, 0, 0, 0, 0, 0.2 * np.sin(sv.t)])

Each target brings the time within which the next one has to come; a program that hangs or dies leaves an arm at rest.
"""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from math import inf, nan
from operator import le
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from heptarm.arm.block import Block
from heptarm.arm.handle import MotionHandle
from heptarm.arm.modes import mode_message
from heptarm.errors import CommandRejected, HeptarmError, LocalProtocolError, ShapeError, Timeout
from heptarm.io.rehearsal import Rehearsal
from heptarm.values.arrays import Array, array
from heptarm.values.condition import Condition
from heptarm.values.mode import Mode
from heptarm.values.pose import Pose
from heptarm.values.result import Result
from heptarm.values.state import State
from heptarm.wire import messages as wire

if TYPE_CHECKING:
    from heptarm.arm.connection import Connection

#: How long to wait for the start, and for rest at the end [s].
_PATIENCE = 5.0
#: Calls of `set` whose cost is remembered.
_REMEMBERED = 4096
#: How long before a tick its waiter wakes, to make ready [s].
_EARLY = 200e-6
_DOUBLES = np.dtype(np.float64)


@dataclass(frozen=True, slots=True)
class ServoStats:
    """How a stream of targets went.

    Attributes:
        sent: targets sent.
        rate: targets per second since the first one [Hz].
        late_ticks: ticks that came later than half a period.
        set_median: what a call of `set` costs [s]; `set_p99` likewise.
        set_p99: see `set_median`.
        received: targets that the cabinet received, as it said last; the next ones likewise.
        applied: how many of them became the arm's target; newer ones overtook the others.
        refused: how many the cabinet refused; `text` says why it refused the last one.
        late: gaps longer than the watchdog time.
        age_median: age of the targets when they were applied [s]; NaN: not told yet.
        age_p99: see `age_median`.
        text: why the last refused target was refused.
    """

    sent: int
    rate: float
    late_ticks: int
    set_median: float
    set_p99: float
    received: int = 0
    applied: int = 0
    refused: int = 0
    late: int = 0
    age_median: float = nan
    age_p99: float = nan
    text: str = ""


class Servo(Block):
    """A stream of targets; made by `Arm.servo`, used in a `with` block. Its subclasses say what targets are.

    Leaving the block ends the motion at rest. An error that ended it earlier, such as a missed watchdog, rises there.

    Attributes:
        period: pause between two ticks [s].
        watchdog: within this time after a target the next one has to come [s].
    """

    what = "servo motion"

    def __init__(
        self,
        connection: Connection,
        message: wire.ServoOpen,
        *,
        rate: float,
        watchdog: float,
        until: tuple[Condition, ...] = (),
    ) -> None:
        self.period = 1.0 / rate
        self.watchdog = watchdog
        self._connection = connection
        self._link = connection.link
        self._clock = connection.clock
        self._message = message
        self._until = until
        self._handle: MotionHandle | None = None
        self._number = 0
        self._active = False
        self._start: State | None = None
        self._result: Result | None = None
        self._began = self._due = self._last = 0
        self._first_sent = self._last_sent = 0
        self._sent = self._late_ticks = 0
        self._rehearsal: Rehearsal | None = None
        self._told: tuple[type[wire.OneWay], tuple[float, ...]] | None = None
        self._costs: deque[int] = deque(maxlen=_REMEMBERED)

    # ------------------------------------------------------------------------------------ life

    def __enter__(self) -> Servo:
        """Begin the servo motion where the arm is; waits until it runs.

        Raises:
            CommandRejected: refused; ModeConflict if another motion runs.
            MotionAborted: the cabinet could not start it.
        """
        if self._handle is not None:
            raise LocalProtocolError("a servo is used once; make another one with arm.servo(...)")
        handle = self._handle = self._connection.run(self._message, 1, inf, until=self._until)
        if not handle.wait_started(_PATIENCE):
            handle.cancel()
            raise Timeout(
                f"the servo motion did not begin within {_PATIENCE:g} s",
                hint="look at arm.state.safety: is the robot ready to move, is it paused?",
            )
        if handle.done:
            self._result = handle.wait()  # raises why
        newest = self._connection.newest()
        before = 0 if newest is None or newest.joints is None else newest.joints.stamp
        self._start = self._connection.wait_for(
            lambda state: state.joints is not None and state.joints.stamp > before, _PATIENCE
        )
        self._rehearsal = Rehearsal()
        self._began = self._due = self._last = self._clock.nanos()
        self._number, self._active = handle.id, True
        handle.add_done_callback(self._on_end)
        return self

    def close(self) -> None:
        """End the motion at rest; raises what ended it early. Closing twice is legal."""
        handle = self._handle
        if self._rehearsal is not None:
            self._rehearsal.close()
        if handle is None or self._result is not None:
            return
        if not handle.done:
            self._connection.cancel(handle)
        self._active = False
        self._result = handle.wait(timeout=_PATIENCE)

    def _on_end(self, _: MotionHandle) -> None:
        self._active = False

    @property
    def active(self) -> bool:
        """Whether the arm follows."""
        return self._active

    @property
    def start(self) -> State:
        """The robot's state when the motion began: build targets on it, and nothing jumps."""
        if self._start is None:
            raise LocalProtocolError("the servo motion has not begun; use it in a with block")
        return self._start

    @property
    def result(self) -> Result | None:
        """How it ended, after the block."""
        return self._result

    @property
    def t(self) -> float:
        """Time since the motion began [s]."""
        return (self._clock.nanos() - self._began) * 1e-9

    # ---------------------------------------------------------------------------------- the loop

    def tick(self) -> float | None:
        """Wait for the next period.

        Returns:
            Time since the last tick [s]; None when the arm follows no more (why rises at the end of the block).
        """
        if not self._active:
            return None
        clock = self._clock
        self._due += round(self.period * 1e9)
        now = clock.nanos()
        if now < self._due:
            clock.sleep((self._due - now) * 1e-9 - _EARLY)
            self._rehearse()
            clock.sleep_until(self._due)
            now = clock.nanos()
        late = (now - self._due) * 1e-9
        if late > 0.5 * self.period:
            self._late_ticks += 1
            if late > self.period:
                self._due = now  # what was missed is not caught up in a burst
        passed = (now - self._last) * 1e-9
        self._last = now
        return passed if self._active else None

    def _rehearse(self) -> None:
        """Tell the last target once more, to nobody: between two ticks the caches have forgotten how."""
        if self._told is not None and self._rehearsal is not None:
            with suppress(HeptarmError):  # the link has ended: the next target tells
                self._rehearsal.send(self._link.rehearse(*self._told, now=self._clock.nanos()))

    def _tell(self, began: int, kind: type[wire.OneWay], target: list[float]) -> None:
        if not self._active:
            _ = self.start  # raises unless it has begun
            return
        self._told = kind, (self._number, self.watchdog, *target)
        self._link.tell(*self._told, now=began)
        self._sent += 1
        self._last_sent = now = self._clock.nanos()
        self._costs.append(now - began)
        if self._sent == 1:
            self._first_sent = now

    def change(self, mode: Mode) -> None:
        """Change the parameters of the control mode while the arm follows.

        Raises:
            ModeConflict: it is another kind of mode than the one the servo motion began with.
        """
        message = mode_message(mode)
        assert message is not None
        _ = self.start  # raises unless it has begun
        self._connection.request(wire.ServoSettings(servo=self._number, mode=message))

    @property
    def stats(self) -> ServoStats:
        """How it went so far."""
        seconds = (self._last_sent - self._first_sent) * 1e-9
        median, p99 = np.percentile(self._costs, [50, 99]) * 1e-9 if self._costs else (nan, nan)
        told = None if self._handle is None else self._connection.servo_status(self._handle.id)
        seen = {} if told is None else _seen(told)
        rate = (self._sent - 1) / seconds if self._sent > 1 and seconds > 0 else nan
        return ServoStats(self._sent, rate, self._late_ticks, float(median), float(p99), **seen)  # type: ignore[arg-type]


def _seen(told: wire.ServoStatus) -> dict[str, object]:
    return {
        "received": told.targets,
        "applied": told.applied,
        "refused": told.refused,
        "late": told.late,
        "age_median": told.age_median,
        "age_p99": told.age_p99,
        "text": told.text,
    }


class JointServo(Servo):
    """A stream of joint positions."""

    def __init__(self, connection: Connection, message: wire.ServoOpen, **settings: Any) -> None:
        super().__init__(connection, message, **settings)
        self._low, self._high = connection.robot.q_min.tolist(), connection.robot.q_max.tolist()
        self._newest: Array | None = None

    def __enter__(self) -> JointServo:
        """Begin; see `Servo`."""
        super().__enter__()
        return self

    def set(self, q: npt.ArrayLike, dq: npt.ArrayLike | None = None) -> Array:
        """Send a target; the newest wins. After the motion has ended it does nothing.

        Args:
            q: joint positions, shape (7,) [rad]; beyond a joint's limits they are brought back to them.
            dq: velocity to pass them at, shape (7,) [rad/s]; None: come to rest there. With the engine "smart" only.

        Returns:
            What was sent, shape (7,) [rad].

        Raises:
            ShapeError: not seven numbers.
            LimitError: one is not finite.
            CommandRejected: a velocity for the engine "direct", which would not heed it.
        """
        began = self._clock.nanos()
        if dq is not None and self._message.engine is wire.ServoEngine.DIRECT:
            raise CommandRejected(
                'the engine "direct" passes its targets at the speed that the next ones make; it takes no velocity',
                parameter="dq",
                hint='leave dq out, or use engine="smart"',
            )
        sent, target = self._within(q)
        self._newest = sent
        if dq is None:
            self._tell(began, wire.ServoJoints, target)
        else:
            self._tell(began, wire.ServoJointsVelocity, target + array(dq, 7, "dq").tolist())
        return sent

    def _within(self, q: npt.ArrayLike) -> tuple[Array, list[float]]:
        """Joint positions brought back to the limits, and the same as numbers."""
        # where caches may be cold, few different functions cost less than few calls
        if not (type(q) is np.ndarray and q.dtype is _DOUBLES and q.shape == (7,)):
            q = array(q, 7, "q")
        sent = q.copy()
        target = sent.tolist()
        if not (all(map(le, self._low, target)) and all(map(le, target, self._high))):  # nor is NaN
            sent = array(sent, 7, "q").clip(self._low, self._high)
            target = sent.tolist()
        return sent, target

    def _rehearse(self) -> None:
        if self._newest is not None:
            self._within(self._newest)
        super()._rehearse()


class PoseServo(Servo):
    """A stream of poses of the moved frame in the base: followed by the joints or, as "lin", on straight lines."""

    def __enter__(self) -> PoseServo:
        """Begin; see `Servo`."""
        super().__enter__()
        return self

    def set(self, pose: Pose) -> Pose:
        """Send a target; the newest wins. After the motion has ended it does nothing.

        The cabinet chooses the joints that reach it nearest to the last target, on straight lines those that keep the
        arm angle; a pose that none reach is refused there, and `stats` tells of it.

        Returns:
            What was sent.

        Raises:
            ShapeError: it is no Pose.
        """
        began = self._clock.nanos()
        if not isinstance(pose, Pose):
            raise ShapeError(
                f"pose is {pose!r}; a Pose is wanted", parameter="pose", value=pose, hint="Pose.of(xyz, quat)"
            )
        self._tell(began, wire.ServoPose, pose.xyz.tolist() + pose.quat.tolist())
        return pose
