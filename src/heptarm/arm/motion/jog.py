"""Streams of velocities: of the joints, or Cartesian; a thread turns them into the targets of a servo motion.

The thread sends a target in every period, whatever the program does. It ramps to the newest velocity, brakes before
limits, and ramps to zero when the program falls silent. If the process dies, or hangs as a whole, no more targets
arrive, and the cabinet's watchdog stops the arm.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf
from typing import Final

import numpy as np
import numpy.typing as npt

from heptarm.arm.link.connection import Connection
from heptarm.arm.motion.servo import Servo, ServoStats, StreamTerms
from heptarm.errors import CommandRejected, HeptarmError
from heptarm.model.boundary import TOLERANCE
from heptarm.model.kinematics import forward, jacobian
from heptarm.model.velocity import (
    FREE,
    MARGIN,
    ElbowTask,
    Slowdown,
    VelocityPath,
    joint_velocity,
    limited_twist,
    ramped_twist,
    resolved_twist,
    wall_velocity,
)
from heptarm.values.checks import Array, array
from heptarm.values.pose import Pose
from heptarm.values.state import State
from heptarm.wire import messages as wire

#: The path stays below the cabinet's own limit of the speed, so that the arm can catch up.
BELOW_CEILING = 0.95
#: Longest time for which a velocity is integrated at once: a late thread is no reason for a jump [s].
_LONGEST_STEP = 0.1
#: The path may be so far ahead of the arm: a distance [rad], and one that grows with the velocity [s]. From half of it
#: on the arm is slowed down, so that a blocked or pushed arm does not have a far target, and a spring no large force.
_AHEAD, _AHEAD_TIME = 0.1, 0.25
#: Largest age of a state that is made up for by the commanded velocity [s].
_OLDEST = 0.3
#: Distance to other bodies below which they are looked at [m], and the time over which their approach is measured [s].
_NEAR, _LOOK_AHEAD = 0.15, 0.05
#: Longest wait for the thread at the end [s].
_PATIENCE = 5.0


@dataclass(frozen=True, slots=True, eq=False)
class JogLimits:
    """What limits a stream of velocities.

    Attributes:
        speed: largest speed of the joints, a fraction of each axis' maximum.
        acceleration: likewise.
        silence: time without a command after which the velocity becomes zero [s].
    """

    speed: float
    acceleration: float
    silence: float


@dataclass(frozen=True, slots=True, eq=False)
class TwistLimits:
    """What limits a Cartesian velocity.

    Attributes:
        speed: [m/s].
        acceleration: [m/s²].
        turn: angular velocity [rad/s].
        spin: angular acceleration [rad/s²].
    """

    speed: float
    acceleration: float
    turn: float
    spin: float


def lag(path: VelocityPath, dq: Array, state: State | None, *, now: int, rate: float) -> Slowdown | None:
    """The arm does not follow: it is blocked, pushed, or its speed override is low.

    Args:
        path: where the arm is to be.
        dq: velocity that is asked for [rad/s].
        state: the newest one.
        now: on the clock of this machine [ns].
        rate: seconds of the robot's clock in one of this machine's.
    """
    if state is None or state.groups.joints is None:
        return None
    # since it was sampled, not received: an arm whose states arrive late does not lag
    age = min((now - state.sampled) * 1e-9 * rate, _OLDEST)
    ahead = (path.q - state.q - path.dq * age) * np.sign(dq)
    ratio = ahead / (_AHEAD + _AHEAD_TIME * np.abs(path.dq))
    index = int(ratio.argmax())
    if ratio[index] <= 0.5:
        return None
    return Slowdown(f"A{index + 1} does not follow", float(np.clip(2.0 - 2.0 * ratio[index], 0.0, 1.0)))


class JogServo(Servo):
    """A stream of velocities; made by `Arm.servo`. Its subclasses define what a velocity is.

    Attributes:
        period: time between two targets [s].
        watchdog: longest gap between two targets; a longer one stops the arm [s].
        timeout: silence after which the velocity becomes zero [s].
    """

    #: Numbers of a command, and the name of its parameter.
    size = 7
    name = "dq"
    timeout: Final[float]

    def __init__(self, connection: Connection, terms: StreamTerms, limits: JogLimits) -> None:
        super().__init__(connection, terms)
        self.timeout = limits.silence
        self._limits = limits
        self._command: tuple[Array, int] | None = None  # and when it was set
        self._slowdown = FREE
        self._slowdowns: dict[str, Slowdown] = {}
        self._least_excess = inf
        self._ending = threading.Event()
        self._failure: Exception | None = None
        self._thread: threading.Thread | None = None
        self._path: VelocityPath | None = None

    # ------------------------------------------------------------------------------------ life

    def __enter__(self) -> JogServo:
        """Begin at rest; see `Servo.__enter__`."""
        super().__enter__()
        robot, limits, boundary = self._connection.robot, self._limits, self._boundary
        low, high = robot.q_min + MARGIN, robot.q_max - MARGIN
        self._path = VelocityPath(
            self.start.q,
            speed=BELOW_CEILING * limits.speed * robot.dq_max,
            acceleration=limits.acceleration * robot.ddq_max,
            q_min=low if boundary is None else np.maximum(low, boundary.q_min),
            q_max=high if boundary is None else np.minimum(high, boundary.q_max),
            reaction=self._reaction,
        )
        self._begin(self.start.q)
        self._thread = threading.Thread(target=self._run, name="heptarm-jog", daemon=True)
        self._thread.start()
        return self

    @property
    def _reaction(self) -> float:
        """How long the arm goes on with the velocity of the last target [s]: to the target, behind it, and to brake."""
        timing, robot = self._message.timing, self._connection.robot
        jerk = float((robot.ddq_max / robot.dddq_max).max())
        return timing.min_trajectory_time + timing.speed_timeout + jerk

    def _begin(self, q: Array) -> None:
        """What a subclass needs to know of the joint positions at the start, shape (7,) [rad]."""

    def _check_of_targets(self) -> None:
        """None: the path brakes before bodies, so no target of it is refused."""

    def _check_may_change(self, limit: str) -> None:
        """Refuse it: `set` has the velocity of each moment."""
        raise CommandRejected(
            f"a stream of velocities keeps its limits, got another {limit}",
            parameter=limit,
            hint="set() takes the velocity; for a higher limit leave the with block and begin another one",
        )

    def close(self) -> None:
        """End the motion at rest; raises the error that ended it early. Calling it again has no effect."""
        if self._closed:
            return
        self._ending.set()
        thread, self._thread = self._thread, None
        if thread is not None and thread is not threading.current_thread():
            thread.join(_PATIENCE)
        super().close()
        if self._failure is not None:
            raise self._failure

    def _run(self) -> None:
        """Send a target in every period."""
        clock = self._clock
        due = last = clock.nanos()
        period = round(self.period * 1e9)
        try:
            while self._active and not self._ending.is_set():
                now = clock.nanos()
                passed = min((now - last) * 1e-9, _LONGEST_STEP)
                last = now
                self._step(now, passed * self._connection.real_time_factor)
                due = max(due + period, clock.nanos())
                self._ending.wait((due - clock.nanos()) * 1e-9)
        except Exception as error:  # of the link, or of a model of bodies: no more targets, so the arm stops
            if not isinstance(error, HeptarmError) or self._connection.is_connected:
                self._failure = error
            if self._handle is not None and self._connection.is_connected:
                self._connection.cancel(self._handle)

    # -------------------------------------------------------------------------------- commands

    def _set(self, value: npt.ArrayLike) -> Array:
        command = array(value, self.size, self.name)
        if not self._active:
            _ = self.start  # raises unless it has begun
            return command
        boundary, path = self._boundary, self._path
        if boundary is not None and boundary.refuses and path is not None:
            now = path.q
            ahead = now + self._unbounded(path, command) * _LOOK_AHEAD
            if boundary.excess(ahead) > max(boundary.excess(now), TOLERANCE):
                self._command = None
                raise boundary.refusal(ahead, "the velocity", parameter=self.name)
        self._command = command, self._clock.nanos()
        return command

    @property
    def stats(self) -> ServoStats:
        """Statistics so far; also after the block. `set_median` is the cost of a target here, made by the thread."""
        return replace(
            super().stats, slowdown=self._slowdown, slowdowns=tuple(dict(self._slowdowns).values())
        )

    # --------------------------------------------------------------------------------- the thread

    def _step(self, now: int, dt: float) -> None:
        """Move the path on by a time of the robot's clock [s], and send it."""
        path = self._path
        assert path is not None
        command = self._command
        wanted = None
        if command is not None and (now - command[1]) * 1e-9 <= self.timeout:
            wanted = command[0]
        dq, done = self._velocity(path, wanted, dt)
        before = path.q
        sample = self._connection.feed.newest
        state = None if sample is None else self._connection.build(sample)
        behind = lag(path, dq, state, now=now, rate=self._connection.real_time_factor)
        held = [slowdown for slowdown in (behind, self._obstacle(path, dq), self._wall(path, dq)) if slowdown]
        least = min((*done, path.advance(dq, dt, held)), key=lambda slowdown: slowdown.factor)
        if self._leaves(path.q):
            path.stay_at(before)
            least = Slowdown("workspace", 0.0)
        self._slowdown = least
        if least.reason:
            known = self._slowdowns.get(least.reason)
            if known is None or least.factor < known.factor:
                self._slowdowns[least.reason] = least
        q, speed = path.target(self._message.timing.min_trajectory_time)
        self._send(now, wire.ServoJointsVelocity, q.tolist() + speed.tolist())

    def _velocity(self, path: VelocityPath, wanted: Array | None, dt: float) -> tuple[Array, list[Slowdown]]:
        """Joint velocities of a command, None: silence [rad/s], and what has slowed them down already."""
        return np.zeros(7) if wanted is None else wanted, []

    def _unbounded(self, path: VelocityPath, command: Array) -> Array:
        """Joint velocities of a command without ramps and walls [rad/s]."""
        return command

    def _obstacle(self, path: VelocityPath, dq: Array) -> Slowdown | None:
        """Bodies that come near."""
        model = self._terms.clear
        if model is None or not dq.any():
            return None
        scale = _LOOK_AHEAD / max(
            1.0, float(np.max(np.abs(dq)))
        )  # no joint looks farther ahead than so many radians
        then = {
            (clearance.first, clearance.second): clearance.distance
            for clearance in model.clearances(path.q + scale * dq, below=_NEAR)
        }
        least = None
        for clearance in model.clearances(path.q, below=_NEAR):
            if frozenset((clearance.first, clearance.second)) in model.allowed:
                continue
            nearing = (clearance.distance - then.get((clearance.first, clearance.second), _NEAR)) / scale
            left = np.array([clearance.distance - model.margin])
            factor = float(path.stopping_factor(dq, left, np.array([nearing]))[0])
            if factor < 1.0 and (least is None or factor < least.factor):
                least = Slowdown(f"{clearance.first} near {clearance.second}", factor)
        return least

    def _wall(self, path: VelocityPath, dq: Array) -> Slowdown | None:
        """Walls of the workspace ahead of the tool."""
        boundary = self._boundary
        if boundary is None or boundary.workspace.box is None:
            return None
        point = boundary.tool(path.q)
        below, above = boundary.walls(point)
        speed = boundary.frame.rotation.T @ (jacobian(boundary.robot, path.q, point)[:3] @ dq)
        factors = path.stopping_factor(dq, np.concatenate([below, above]), np.concatenate([-speed, speed]))
        return Slowdown("workspace", float(factors.min())) if factors.min() < 1.0 else None

    def _leaves(self, q: Array) -> bool:
        """Whether joint positions are outside of the workspace, and farther than any before."""
        if self._boundary is None:
            return False
        excess = self._boundary.excess(q)
        if excess > self._least_excess + TOLERANCE:
            return True
        self._least_excess = min(self._least_excess, excess)
        return False


class VelocityServo(JogServo):
    """A stream of joint velocities."""

    def __enter__(self) -> VelocityServo:
        """Begin at rest; see `Servo.__enter__`."""
        super().__enter__()
        return self

    def set(self, dq: npt.ArrayLike) -> Array:
        """Command joint velocities, until the next call, or for `timeout`; after the end it has no effect.

        All joints are slowed down in step where one is too fast, or near its limit, so that the direction stays.

        Args:
            dq: shape (7,) [rad/s].

        Returns:
            The same as an array.

        Raises:
            ShapeError: not seven numbers.
            LimitError: one is not finite; OutsideWorkspace if `arm.workspace` refuses the velocity.
        """
        return self._set(dq)


class TwistServo(JogServo):
    """A stream of Cartesian velocities."""

    size = 6
    name = "twist"

    def __init__(
        self,
        connection: Connection,
        terms: StreamTerms,
        limits: JogLimits,
        *,
        twist: TwistLimits,
        moving: Pose,
        elbow: Callable[[Array], ElbowTask],
        axes: Callable[[Pose], Pose],
    ) -> None:
        super().__init__(connection, terms, limits)
        self._twist_limits = twist
        self._elbow_from = elbow
        self._elbow: ElbowTask | None = None
        self._moving = moving  # pose of the motion frame in the flange frame
        self._axes = axes  # pose of the frame of the twist in the base, by that of the flange
        self._twist = np.zeros(6)

    def __enter__(self) -> TwistServo:
        """Begin at rest; see `Servo.__enter__`."""
        super().__enter__()
        return self

    def _begin(self, q: Array) -> None:
        self._elbow = self._elbow_from(q)

    def set(self, twist: npt.ArrayLike) -> Array:
        """Command a Cartesian velocity, until the next call, or for `timeout`; after the end it has no effect.

        Args:
            twist: velocity of the origin of the motion frame and angular velocity, in the axes of `frame`, shape (6,)
                [m/s, rad/s]; scaled down to `speed_mps` and `speed_radps`.

        Returns:
            The same as an array.

        Raises:
            ShapeError: not six numbers.
            LimitError: one is not finite; OutsideWorkspace if `arm.workspace` refuses the velocity.
        """
        return self._set(twist)

    def _velocity(self, path: VelocityPath, wanted: Array | None, dt: float) -> tuple[Array, list[Slowdown]]:
        limits = self._twist_limits
        goal = np.zeros(6) if wanted is None else limited_twist(wanted, limits.speed, limits.turn)
        if dt > 0.0:
            self._twist = ramped_twist(self._twist, goal, limits.acceleration * dt, limits.spin * dt)
        twist, point = self._in_base(path.q, self._twist)
        slowed, wall = self._along_walls(twist, point, path.q)
        assert self._elbow is not None
        dq, singular = resolved_twist(
            self._connection.robot, path, slowed, point, elbow=self._elbow, idle=wanted is None
        )
        return dq, [slowdown for slowdown in (singular, wall) if slowdown.reason]

    def _unbounded(self, path: VelocityPath, command: Array) -> Array:
        limits = self._twist_limits
        twist, point = self._in_base(path.q, limited_twist(command, limits.speed, limits.turn))
        return joint_velocity(self._connection.robot, path.q, twist, point)

    def _in_base(self, q: Array, twist: Array) -> tuple[Array, Array]:
        """A twist in the axes of the base, and its point: the origin of the motion frame in the base."""
        flange = Pose.from_matrix(forward(self._connection.robot, q))
        turn = self._axes(flange).rotation
        return np.concatenate([turn @ twist[:3], turn @ twist[3:]]), (flange @ self._moving).xyz

    def _along_walls(self, twist: Array, point: Array, q: Array) -> tuple[Array, Slowdown]:
        """The twist of a point of the base, with the tool braking before the walls of the workspace."""
        boundary = self._boundary
        if boundary is None or boundary.workspace.box is None:
            return twist, FREE
        tool = boundary.tool(q)
        lever = np.cross(twist[3:], tool - point)
        turn = boundary.frame.rotation
        speed = turn.T @ (twist[:3] + lever)
        clipped = wall_velocity(speed, *boundary.walls(tool), self._twist_limits.acceleration)
        if np.allclose(clipped, speed, atol=1e-9):
            return twist, FREE
        factor = float(np.linalg.norm(clipped) / np.linalg.norm(speed))
        return np.concatenate([turn @ clipped - lever, twist[3:]]), Slowdown("workspace", min(factor, 1.0))

    def _wall(self, path: VelocityPath, dq: Array) -> Slowdown | None:
        """None: the tool has been slowed down before each wall, and slides along it."""
        return None
