"""Set-points of a servo motion: the newest target wins, and every limit holds.

`SmartFollower` and `DirectFollower` follow joint targets and poses, `StraightFollower` moves on straight lines as
SmartServoLIN does; all of them plan online with `OnlineTrajectory`.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from math import cos, sin, sqrt

import numpy as np
import numpy.typing as npt
from ruckig import ControlInterface, InputParameter, Result, Ruckig, RuckigError, Synchronization, Trajectory

from heptarm.errors import Unreachable
from heptarm.model.inverse_kinematics import PathInverse
from heptarm.model.kinematics import forward
from heptarm.planning.geometry import Quat, product
from heptarm.planning.motion import CARTESIAN_DEFAULT, ORIENTATION_DEFAULT, TICK, ServoMotion, fractions
from heptarm.planning.seam import ServoDirect, ServoStraight, ServoTiming
from heptarm.planning.targets import goes_on
from heptarm.sim.controller.line_speed import HORIZON, AxisLimits, RateProfile
from heptarm.sim.controller.setpoints import stoppable
from heptarm.values.checks import Array
from heptarm.values.pose import Pose, is_half_turn, rotation, turn_between
from heptarm.values.robot import RobotModel

#: Of a follower that only comes to rest.
_NO_TIMING = ServoTiming()
#: Position, velocity and acceleration.
OtgState = tuple[Array, Array, Array]


class OnlineTrajectory:
    """Online trajectory generation of a servo motion.

    Args:
        axes: number of coordinates.
        synchronization: of the coordinates on the way to a target.
        halting: of the coordinates while they come to rest.

    Attributes:
        time: since the trajectory began [s].
    """

    def __init__(self, axes: int, *, synchronization: Synchronization, halting: Synchronization) -> None:
        self._axes = axes
        self._planner = Ruckig(axes)
        self._input = InputParameter(axes)
        self._synchronization, self._halting = synchronization, halting
        self._plan: Trajectory | None = None
        self._velocity = np.full(axes, np.inf)
        # the plan is relative to a point that is here at time 0 and has this velocity; None: to the origin
        self._frame: tuple[Array, Array] | None = None
        self.time = 0.0

    def limit(self, acceleration: Array, jerk: Array, *, velocity: Array | None = None) -> None:
        """Set the limits of each coordinate for the next trajectories; without a velocity that limit stays."""
        if velocity is not None:
            self._velocity = velocity
        self._input.max_acceleration, self._input.max_jerk = acceleration.tolist(), jerk.tolist()

    @property
    def has_begun(self) -> bool:
        """Whether there is a trajectory."""
        return self._plan is not None

    @property
    def duration(self) -> float:
        """Of the trajectory [s]; without one 0."""
        return 0.0 if self._plan is None else self._plan.duration

    @property
    def over(self) -> float:
        """Time since the end of the trajectory, negative before it [s]; without one infinite."""
        return float("inf") if self._plan is None else self.time - self._plan.duration

    @property
    def remaining(self) -> float:
        """Time until the target is reached [s]; NaN without one."""
        return float("nan") if self._plan is None else max(0.0, -self.over)

    def at(self, time: float) -> OtgState:
        """State of the trajectory at a time [s]."""
        assert self._plan is not None
        q, dq, ddq = (np.array(values) for values in self._plan.at_time(time))
        if self._frame is not None:
            origin, speed = self._frame
            q, dq = q + origin + speed * time, dq + speed
        return q, dq, ddq

    def position(self, time: float) -> list[float]:
        """Coordinates at a time [s]."""
        assert self._plan is not None
        place: list[float] = self._plan.at_time(time)[0]
        if self._frame is not None:
            origin, speed = self._frame
            place = (origin + speed * time + place).tolist()
        return place

    def aim(
        self,
        state: OtgState,
        target: Array,
        *,
        speed: Array,
        minimum: float,
        within: tuple[Array, Array] | None = None,
    ) -> bool:
        """Plan from a state to a target.

        Args:
            state: its start.
            target: its end.
            speed: velocity at the target.
            minimum: least duration [s].
            within: lowest and highest coordinates; the trajectory may take a run-up, or has to turn round.

        Returns:
            False if that cannot be planned: the last trajectory continues.
        """
        plan = self._to(state, target, speed=speed, minimum=minimum)
        if plan is None or not (within is None or _stays(plan, state[0], within)):
            return False
        self._plan, self._frame, self.time = plan, None, 0.0
        return True

    def meet(
        self,
        state: OtgState,
        target: Array,
        *,
        speed: Array,
        minimum: float,
        latest: float,
        within: tuple[Array, Array],
    ) -> bool:
        """Plan from a state to a target that goes on moving, and go on with it.

        An axis that cannot be at the target at that time meets it farther on. To be at the target itself, in motion, it
        would have to turn back and take a run-up, or be behind the next targets as well.

        Args:
            state: its start.
            target: where the target is after the least duration.
            speed: of the target.
            minimum: least duration [s].
            latest: until which they meet [s].
            within: lowest and highest coordinates.

        Returns:
            False if they cannot meet in time, or not within: the last trajectory continues.
        """
        q, dq, ddq = state
        origin = target - minimum * speed
        here, rest = q - origin, np.zeros_like(q)
        plan = self._to((here, dq - speed, ddq), rest, speed=rest, frame=speed, minimum=minimum)
        if plan is None or plan.duration > latest:
            return False
        moved = speed * plan.duration
        low, high = within[0] - origin - np.minimum(moved, 0.0), within[1] - origin - np.maximum(moved, 0.0)
        if not _stays(plan, here, (low, high)):
            return False
        self._plan, self._frame, self.time = plan, (origin, speed), 0.0
        return True

    def halt(self, state: OtgState) -> bool:
        """Plan from a state to rest, wherever that is; returns as `aim` does."""
        parameters = self._input
        parameters.control_interface, parameters.synchronization = ControlInterface.Velocity, self._halting
        parameters.target_velocity = [0.0] * self._axes
        parameters.minimum_duration = None
        plan = self._planned(state)
        if plan is None:
            return False
        self._plan, self._frame, self.time = plan, None, 0.0
        return True

    def _to(
        self, state: OtgState, target: Array, *, speed: Array, minimum: float, frame: Array | float = 0.0
    ) -> Trajectory | None:
        """A trajectory to a target, in a frame that moves [rad/s, m/s]; None: there is none."""
        parameters = self._input
        parameters.control_interface, parameters.synchronization = (
            ControlInterface.Position,
            self._synchronization,
        )
        parameters.max_velocity = (self._velocity - frame).tolist()
        parameters.min_velocity = (-self._velocity - frame).tolist()
        parameters.target_position, parameters.target_velocity = target.tolist(), speed.tolist()
        parameters.minimum_duration = minimum
        return self._planned(state)

    def _planned(self, state: OtgState) -> Trajectory | None:
        parameters = self._input
        parameters.current_position, parameters.current_velocity, parameters.current_acceleration = (
            values.tolist() for values in state
        )
        acceleration = parameters.max_acceleration
        try:
            for factor in _SLIGHTLY:
                parameters.max_acceleration = [factor * limit for limit in acceleration]
                plan = Trajectory(self._axes)
                # a ValueError: a result that its Python has no name for
                with suppress(RuckigError, ValueError):
                    if self._planner.calculate(parameters, plan) in (Result.Working, Result.Finished):
                        return plan
        finally:
            parameters.max_acceleration = acceleration
        return None


def _stays(plan: Trajectory, start: Array, within: tuple[Array, Array]) -> bool:
    """Whether a trajectory stays within coordinates, or does not leave them further than at its start."""
    low, high = np.minimum(within[0], start) - _TINY, np.maximum(within[1], start) + _TINY
    return not any(
        extremes.min < a or extremes.max > b
        for extremes, a, b in zip(plan.position_extrema, low, high, strict=True)
    )


#: Ruckig finds no trajectory where two of its kinds meet exactly, as with 0.1 rad at 5 rad/s²; beside that it does.
_SLIGHTLY = (1.0, 1.0 - 1e-6)
#: Time step for the angular acceleration, by differences of the angular velocity [s].
_STEP = 1e-5
#: Angles below it [rad] do not determine their axis.
_TINY = 1e-9
#: Below this rate of a trajectory's time the samples are the set-points.
_SLOW = 0.05
#: A target that no trajectory leads to yet is tried again after this time [s]; and these are the times of a trajectory
#: after which the axes try to be at rest [s].
_AGAIN, _STOPS = 0.01, (0.02, 0.05, 0.1, 0.2)
#: An acceleration whose square is at most this times speed and jerk ends before the speed does.
_SOONER = 1.9
#: A velocity or acceleration perpendicular to the line that is smaller than this [m/s, rad/s, ...] is rounding.
_ASIDE = 1e-6


@dataclass(frozen=True, slots=True)
class StraightServoLimits:
    """Limits of a straight servo motion; x y z, then about x y z, along the axes of a fixed frame.

    Attributes:
        velocity: shape (6,) [m/s, rad/s].
        acceleration: shape (6,) [m/s², rad/s²].
        jerk: shape (6,) [m/s³, rad/s³].
        axes: that frame's axes as columns in the base, shape (3, 3).
        timing: times of the motion.
    """

    velocity: Array
    acceleration: Array
    jerk: Array
    axes: Array
    timing: ServoTiming

    @staticmethod
    def of(motion: ServoStraight) -> StraightServoLimits:
        """Limits of a motion; defaults are those of a linear motion, and jerk scales with acceleration."""
        default = np.repeat((CARTESIAN_DEFAULT, ORIENTATION_DEFAULT), 3, axis=0).T
        velocity = np.where(np.isnan(motion.velocity), default[0], motion.velocity)
        acceleration = np.where(np.isnan(motion.acceleration), default[1], motion.acceleration)
        axes = np.eye(3) if motion.axes is None else rotation(motion.axes)
        return StraightServoLimits(
            velocity, acceleration, acceleration * default[2] / default[1], axes, motion.timing
        )

    @property
    def hardest(self) -> tuple[Array, ...]:
        """Acceleration and jerk of braking: at least those of a linear motion."""
        default = np.repeat((CARTESIAN_DEFAULT, ORIENTATION_DEFAULT), 3, axis=0).T
        return np.maximum(self.acceleration, default[1]), np.maximum(self.jerk, default[2])


@dataclass(frozen=True, slots=True)
class _Trajectory:
    """A trajectory of the tool frame that is followed, and how fast.

    Attributes:
        otg: position and rotation from the centre over its own time, along the axes of the limits.
        centre: orientation from which rotations are measured.
        profile: rate of its time.
    """

    otg: OnlineTrajectory
    centre: Quat
    profile: RateProfile


class StraightFollower:
    """Follows poses of the tool frame on straight lines, as fast as the axes can.

    A trajectory is taken up only if all axes can brake on it before a limit; until then the last one goes on, which
    ends at rest.

    Args:
        robot: the robot.
        motion: the servo motion.
        here: first set-point, at rest, shape (7,) [rad].
        tcp: flange to motion frame, x y z [m], quaternion.

    Attributes:
        resting: time since the target was reached [s]; 0 while it is not.
    """

    def __init__(
        self, robot: RobotModel, motion: ServoStraight, here: Array, *, tcp: tuple[float, ...]
    ) -> None:
        frame = Pose.of(tcp[:3], tcp[3:])
        origin = Pose.from_matrix(forward(robot, here)) @ frame
        limits = self._limits = StraightServoLimits.of(motion)
        self._robot = robot
        self._axes = AxisLimits(robot)
        self._turned_axes = None if (limits.axes == np.eye(3)).all() else limits.axes
        self._inverse, self._a3 = PathInverse(robot, frame), float(here[2])
        self._q = here.copy()
        self._speed = np.zeros(7)  # of the axes, in the motion's own time
        self._step = np.zeros(7)  # the last one of the set-points [rad]
        self._place = limits.axes.T @ origin.xyz  # position at rest, along the axes of the limits
        self._centre: Quat = tuple(origin.quat.tolist())  # orientation at rest
        self._followed: _Trajectory | None = None
        self._goal: Array | None = None  # that no trajectory leads to yet
        self._elapsed = 0.0  # since the profile began [s]
        self._waited = 0.0  # since the last target [s]
        self._stopping = False
        self.resting = 0.0

    @property
    def remaining(self) -> float:
        """Time until the target is reached, at full speed [s]; NaN without a target."""
        return float("nan") if self._followed is None else self._followed.otg.remaining

    def aim(self, goal: Array, dq: Array | None = None) -> None:
        """Set the target pose of the tool frame in the base: x y z [m], quaternion x y z w; shape (7,)."""
        if not self._stopping:
            self._goal = None if self._leads_to(goal) else goal
            self._waited = 0.0

    def ahead(self, dt: float) -> Array:
        """What `advance` would return if no further target came, shape (7,) [rad]; raises as it does."""
        trajectory = self._followed
        return self._q if trajectory is None else self._set_point(trajectory, self._elapsed + dt)

    def advance(self, dt: float) -> Array:
        """The set-point after `dt` seconds of the motion's own time, shape (7,) [rad].

        Raises:
            Unreachable: the line leaves the workspace.
        """
        self._waited += dt
        trajectory, before = self._followed, self._q
        if trajectory is None:
            self.resting += dt
        else:
            elapsed = self._elapsed
            step, self._q = self._axes.followable(
                lambda step: self._set_point(trajectory, elapsed + step), before, self._step, dt
            )
            self._elapsed += step
            trajectory.otg.time = trajectory.profile.at(self._elapsed)[0]
            self.resting = 0.0 if self._goal is not None else max(0.0, trajectory.otg.over)
            if dt > 0.0:
                self._speed = (self._q - before) / dt
            if (
                not (trajectory.profile.is_whole or self._stopping)
                and self._elapsed > trajectory.profile.next_look
            ):
                self._go_on(trajectory, rate=trajectory.profile.at(self._elapsed)[1])
        if self._goal is not None and self._waited >= _AGAIN:
            self.aim(self._goal)
        self._step = self._q - before
        return self._q

    def brake(self, *, scale: float, rate: float) -> None:
        """Come to rest along the line; ends when `is_still`.

        Args:
            scale: speed as a fraction of full speed; the stop itself runs at full speed.
            rate: change of that fraction [1/s].
        """
        if self._stopping:
            return
        self._stopping, self._goal = True, None
        trajectory = self._followed
        if trajectory is None:
            return
        if self._elapsed >= trajectory.profile.duration:  # at rest already
            self._followed = None
            return
        place, turn, speed, change = self._state()
        speed, change = speed * scale, change * scale * scale + speed * rate
        (acceleration, jerk), along, by = _along(speed, self._limits.hardest, speed, change)
        otg = self._new_trajectory()
        otg.limit(acceleration, jerk)
        centre = self._turned(turn)
        if otg.halt((_unrotated(place), along, by)) and self._follow(otg, centre, scale=scale):
            return
        # the axes cannot brake that hard: as soon as they can, on the trajectory they follow
        now = trajectory.profile.at(self._elapsed)[1] * scale
        for horizon in _STOPS:
            if self._go_on(trajectory, rate=now, horizon=horizon):
                return

    @property
    def is_still(self) -> bool:
        """Whether a braked motion has come to rest."""
        trajectory = self._followed
        return self._stopping and (trajectory is None or self._elapsed >= trajectory.profile.duration)

    # ------------------------------------------------------------------------- trajectories ahead

    def _leads_to(self, goal: Array) -> bool:
        """Follow a trajectory to a target; False: from here the axes could not brake on it."""
        place, turn, speed, change = self._state()
        centre = self._turned(turn)
        inward = self._limits.axes.T
        target = np.concatenate([inward @ goal[:3], inward @ self._turn_to(goal, place, centre)])
        distance = target - _unrotated(place)
        free = (self._limits.velocity, self._limits.acceleration, self._limits.jerk)
        (velocity, acceleration, jerk), speed, change = _along(distance, free, speed, change)
        otg = self._new_trajectory()
        otg.limit(acceleration, jerk, velocity=velocity)
        start = (_unrotated(place), speed, change)
        minimum = self._limits.timing.min_trajectory_time
        return otg.aim(start, target, speed=np.zeros(6), minimum=minimum) and self._follow(otg, centre)

    def _turn_to(self, goal: Array, place: Array, centre: Quat) -> Array:
        """Rotation vector to a target in the base, shape (3,) [rad]; half a turn goes where the arm can follow.

        Args:
            goal: the target pose.
            place: position now, along the axes of the limits, shape (3,) [m].
            centre: orientation now.
        """
        start, end, here = np.array(centre), goal[3:], self._limits.axes @ place
        turn = turn_between(start, end)
        if not is_half_turn(start, end):
            return turn
        other = turn_between(start, end, is_other=True)

        def can_turn(by: Array) -> bool:
            def at(s: float, near: Array) -> Array:
                point = (here + s * (goal[:3] - here)).tolist()
                return self._inverse.joints(point, _rotated(centre, (s * by).tolist()), near, a3=self._a3)

            return goes_on(self._robot, at, self._q)

        return other if not can_turn(turn) and can_turn(other) else turn

    def _follow(self, otg: OnlineTrajectory, centre: Quat, *, scale: float = 1.0) -> bool:
        """Follow a trajectory from its start; False: the axes could not brake on it, or not get on to it."""
        profile = self._profile(otg, centre, rate=1.0)
        if profile is None:
            return False
        trajectory, ahead = _Trajectory(otg, centre, profile), [self._q]
        try:
            ahead += [self._set_point(trajectory, elapsed) for elapsed in profile.first_ticks]
        except Unreachable:  # between the samples of the profile
            return False
        if not self._axes.joins(scale * self._speed, *ahead):
            return False
        self._followed, self._elapsed, self.resting = trajectory, 0.0, 0.0
        return True

    def _go_on(self, trajectory: _Trajectory, *, rate: float, horizon: float = HORIZON) -> bool:
        """Look farther ahead; False: that shows nothing better, so the arm comes to rest where it was to."""
        profile = self._profile(trajectory.otg, trajectory.centre, rate=rate, horizon=horizon)
        if profile is None:
            return False
        self._followed, self._elapsed = replace(trajectory, profile=profile), 0.0
        return True

    def _profile(
        self, otg: OnlineTrajectory, centre: Quat, *, rate: float, horizon: float = HORIZON
    ) -> RateProfile | None:
        return self._axes.profile(
            partial(self._joints, otg, centre),
            self._q,
            start=otg.time,
            end=otg.duration,
            rate=rate,
            horizon=horizon,
        )

    def _new_trajectory(self) -> OnlineTrajectory:
        return OnlineTrajectory(6, synchronization=Synchronization.Phase, halting=Synchronization.Phase)

    def _set_point(self, trajectory: _Trajectory, elapsed: float) -> Array:
        """Joint positions of a trajectory when so much time of its profile has passed, shape (7,) [rad]."""
        time, rate = trajectory.profile.at(elapsed)
        near = trajectory.profile.near(time)
        # where the axes are that slow, the samples are dense, and the noise of the inverse kinematics is not
        return near if rate < _SLOW else self._joints(trajectory.otg, trajectory.centre, time, near)

    def _joints(self, otg: OnlineTrajectory, centre: Quat, time: float, near: Array) -> Array:
        """Joint positions at a time of a trajectory, next to others.

        Raises:
            Unreachable: there are none.
        """
        x, y, z, *turn = otg.position(time)
        if self._turned_axes is not None:
            x, y, z = (self._turned_axes @ (x, y, z)).tolist()
            turn = (self._turned_axes @ turn).tolist()
        i, j, k, w = _rotated(centre, turn)
        return self._inverse.joints((x, y, z), (i, j, k, w), near, a3=self._a3)

    def _turned(self, turn: Array) -> Quat:
        """Orientation at a rotation from the centre, quaternion."""
        centre = self._centre if self._followed is None else self._followed.centre
        return _rotated(centre, (self._limits.axes @ turn).tolist())

    def _state(self) -> tuple[Array, Array, Array, Array]:
        """Position and rotation from the centre, shape (3,) each; velocity and acceleration, shape (6,)."""
        trajectory = self._followed
        if trajectory is None:
            return self._place, np.zeros(3), np.zeros(6), np.zeros(6)
        otg, time = trajectory.otg, trajectory.otg.time
        x, v, a = otg.at(time)
        if np.abs(np.cross(x[3:], v[3:])).max() < _TINY and np.abs(np.cross(x[3:], a[3:])).max() < _TINY:
            change = np.array(a[3:])  # about one axis; exact also where the acceleration has a kink
        else:
            low, high = max(0.0, time - _STEP), time + _STEP
            change = (_spin(otg, high) - _spin(otg, low)) / (high - low)
        rate, growth = trajectory.profile.at(self._elapsed)[1], trajectory.profile.change(self._elapsed)
        speed = np.concatenate([v[:3], _spin(otg, time)])
        change = rate * rate * np.concatenate([a[:3], change]) + growth * speed
        speed = rate * speed
        # the axes may brake harder than the limits of the tool frame: what would turn the motion round is left out
        braking = speed * change < -_TINY
        if braking.any():
            most = np.sqrt(_SOONER * np.abs(speed) * self._limits.jerk)
            change = change * min(1.0, float((most[braking] / np.abs(change[braking])).min()))
        return x[:3], x[3:], speed, change


def _rotated(centre: Quat, vector: Sequence[float]) -> Quat:
    """A quaternion turned by a rotation vector in the base; plain floats, since every sample asks for it."""
    x, y, z = vector
    angle = sqrt(x * x + y * y + z * z)
    if angle < _TINY:
        return centre
    part = sin(angle / 2) / angle
    return product((x * part, y * part, z * part, cos(angle / 2)), centre)


def _spin(otg: OnlineTrajectory, time: float) -> Array:
    """Angular velocity at a time of a trajectory, shape (3,) [rad/s]."""
    x, v, _ = otg.at(time)
    turn, speed = x[3:], v[3:]
    angle = sqrt(float(turn @ turn))
    if angle < 1e-6:
        almost: Array = speed + 0.5 * np.cross(turn, speed)
        return almost
    # left Jacobian of the rotation group, e.g. Sola et al., "A micro Lie theory", 2018, (145)
    once = np.cross(turn, speed)
    twice = np.cross(turn, once)
    spin: Array = speed + (1.0 - cos(angle)) / angle**2 * once + (angle - sin(angle)) / angle**3 * twice
    return spin


def _unrotated(place: Array) -> Array:
    """Coordinates of a position without rotation from the centre, shape (6,)."""
    return np.concatenate([place, np.zeros(3)])


def _along(
    distance: Array, free: tuple[Array, ...], speed: Array, change: Array
) -> tuple[tuple[Array, ...], Array, Array]:
    """Limits for a displacement, then velocity and acceleration.

    If these are parallel to it, the limits get the ratio of its coordinates, so that the motion is straight.
    """
    length = sqrt(float(distance @ distance))
    if length < _TINY:
        return free, speed, change
    unit = distance / length
    straight = (unit * (unit @ speed), unit * (unit @ change))
    if np.abs(speed - straight[0]).max() > _ASIDE or np.abs(change - straight[1]).max() > _ASIDE:
        return free, speed, change
    ratio = np.maximum(np.abs(unit), _TINY)
    bound = (np.where(ratio > _TINY, ratio * float((limit / ratio).min()), limit) for limit in free)
    return tuple(bound), *straight


#: Time constant of the final exponential approach of a direct follower [s].
APPROACH = 0.01
#: Largest velocity at a target relative to the axis' limit: Ruckig needs a margin to reach it.
MARGIN = 0.999
#: An axis that has passed its target brakes at the latest after this time [s].
_BRAKES_LATER = 4.0 * TICK
#: Before a limit an axis brakes with up to so many times the acceleration of planned motions.
HARDEST = 5.0


@dataclass(frozen=True, slots=True)
class ServoLimits:
    """Limits and times of a servo motion.

    Attributes:
        velocity: largest speed of each axis, shape (7,) [rad/s].
        acceleration: shape (7,) [rad/s²].
        jerk: shape (7,) [rad/s³].
        lowest: positions, shape (7,) [rad].
        highest: likewise.
        timing: times of the motion.
    """

    velocity: Array
    acceleration: Array
    jerk: Array
    lowest: Array
    highest: Array
    timing: ServoTiming

    def within(self, q: Array) -> Array:
        """The positions nearest to others that no axis is beyond, shape (7,) [rad]."""
        inside: Array = np.clip(q, self.lowest, self.highest)
        return inside

    def bounded(self, q: Array, dq: Array, later: float) -> Array:
        """Velocities with which every axis comes to rest before the limits of its position, shape (7,) [rad/s].

        Args:
            q: positions, shape (7,) [rad].
            dq: wanted velocities, shape (7,) [rad/s].
            later: time after which it brakes [s].
        """
        late, room = self._late(later), self._room(q, dq)
        most = np.minimum(MARGIN * self.velocity, np.sqrt(late**2 + 2.0 * self.acceleration * room) - late)
        bounded: Array = np.clip(dq, -most, most)
        return bounded

    def time_to_brake(self, q: Array, dq: Array, later: float) -> float:
        """How long axes may go on before they have to brake for the limits of their positions [s].

        Args:
            q: positions, shape (7,) [rad].
            dq: velocities, shape (7,) [rad/s].
            later: time after which they brake [s].
        """
        late, speed = self._late(later), np.abs(dq)
        left = self._room(q, dq) - ((speed + late) ** 2 - late**2) / (2.0 * self.acceleration)
        return float((left[speed > 0.0] / speed[speed > 0.0]).min(initial=np.inf))

    def _late(self, later: float) -> Array:
        # from v at no acceleration it takes at most v² / 2 a + v a / 2 j to come to rest
        late: Array = self.acceleration * later + self.acceleration**2 / (2.0 * self.jerk)
        return late

    def _room(self, q: Array, dq: Array) -> Array:
        return np.maximum(np.where(dq > 0.0, self.highest - q, q - self.lowest), 0.0)

    @staticmethod
    def of(
        robot: RobotModel,
        *,
        velocity: tuple[float, ...],
        acceleration: tuple[float, ...],
        timing: ServoTiming = _NO_TIMING,
    ) -> ServoLimits:
        """From fractions of a robot's limits, seven each; jerk scales with acceleration."""
        return ServoLimits(
            np.array(velocity) * robot.dq_max,
            np.array(acceleration) * robot.ddq_max,
            np.array(acceleration) * robot.dddq_max,
            robot.q_min,
            robot.q_max,
            timing,
        )


class _HardBrake:
    """Axes that brake with their acceleration at once.

    Args:
        axes: which ones, shape (7,).
        here: set-point, shape (7,) [rad].
        speed: that has led there, shape (7,) [rad/s].
        acceleration: shape (7,) [rad/s²].
    """

    def __init__(
        self, axes: npt.NDArray[np.bool_], *, here: Array, speed: Array, acceleration: Array
    ) -> None:
        self._axes, self._q, self._dq, self._acceleration = axes, here, speed, acceleration

    def advance(self, dt: float, others: Array) -> Array:
        """The next set-point, shape (7,) [rad], with other axes as they are given."""
        step = self._acceleration * dt
        self._dq = self._dq - np.clip(self._dq, -step, step)
        self._q = self._q + self._dq * dt
        return np.where(self._axes, self._q, others)


def _hardest(speed: Array, room: Array, usual: Array) -> Array:
    """Acceleration with which axes come to rest within a distance: the usual one, or up to `HARDEST` times that.

    Args:
        speed: of the last tick, shape (7,) [rad/s].
        room: distance, shape (7,) [rad].
        usual: acceleration of planned motions, shape (7,) [rad/s²].
    """
    now = np.abs(speed)
    passes = now - usual * TICK > stoppable(room, usual) + _TINY
    # in steps an axis gets half a step less far, but for an eighth of that of its acceleration
    within = room + 0.5 * TICK * now - 0.125 * HARDEST * usual * TICK**2
    needed = 0.5 * now**2 / np.maximum(within, _TINY)
    return np.where(passes, np.clip(needed, usual, HARDEST * usual), usual)


class SmartFollower:
    """Follows targets with a velocity-, acceleration- and jerk-limited trajectory to each.

    Args:
        limits: limits and times.
        here: first set-point, at rest, shape (7,) [rad].

    Attributes:
        resting: time since the target was reached [s]; 0 while it is not.
    """

    def __init__(self, limits: ServoLimits, here: Array) -> None:
        self._limits = limits
        self._otg = self._new_trajectory()
        self._still = here.copy()
        self._goal: tuple[Array, Array | None] | None = None
        self._waits = False  # no trajectory leads to the target yet
        self._waited = 0.0  # since that was tried [s]
        self._passes = False
        self._until = 0.0  # time of the trajectory until which the velocity at the target is kept [s]
        self._stopping = False
        self._hard: _HardBrake | None = None
        self.resting = 0.0

    def restart(self, here: Array) -> None:
        """Go on from a set-point at rest, shape (7,) [rad], to the target."""
        self._still = here.copy()
        self._otg = self._new_trajectory()
        if self._goal is not None:
            self.aim(*self._goal)

    @property
    def remaining(self) -> float:
        """Time until the target is reached [s]; NaN without a target."""
        return self._otg.remaining

    def aim(self, q: Array, dq: Array | None = None) -> None:
        """Set the target, shape (7,) [rad], and the velocity at it [rad/s]; beyond a limit of the axes: on it."""
        if self._stopping:
            return
        q = self._limits.within(q)
        self._goal, self._waited = (q, dq), 0.0
        pass_at = np.zeros(7) if dq is None else self._limits.bounded(q, dq, _BRAKES_LATER)
        self._waits = not (
            (pass_at.any() and (self._meets(q, pass_at) or self._leads_to(q, pass_at)))
            or self._leads_to(q, np.zeros(7))
        )

    def _meets(self, q: Array, speed: Array) -> bool:
        """Follow a trajectory to a target that goes on until its velocity is no longer valid; False: there is none."""
        limits, least = self._limits, self._limits.timing.min_trajectory_time
        going_on = min(limits.timing.speed_timeout, limits.time_to_brake(q, speed, _BRAKES_LATER))
        if not self._otg.meet(
            self._state(),
            q,
            speed=speed,
            minimum=least,
            latest=least + going_on,
            within=(limits.lowest, limits.highest),
        ):
            return False
        self._passes, self._until, self.resting = True, least + limits.timing.speed_timeout, 0.0
        return True

    def _leads_to(self, q: Array, speed: Array) -> bool:
        """Follow a trajectory to a target; False: none does from here, or an axis would leave its range on it."""
        limits = self._limits
        if not self._otg.aim(
            self._state(),
            q,
            speed=speed,
            minimum=limits.timing.min_trajectory_time,
            within=(limits.lowest, limits.highest),
        ):
            return False
        self._passes, self.resting = bool(speed.any()), 0.0
        self._until = self._otg.duration + limits.timing.speed_timeout
        return True

    def ahead(self, dt: float) -> Array:
        """What `advance` would return if no further target came, shape (7,) [rad]."""
        return np.array(self._otg.position(self._otg.time + dt)) if self._otg.has_begun else self._still

    def advance(self, dt: float) -> Array:
        """The set-point after `dt` seconds of the motion's own time, shape (7,) [rad]."""
        if not self._otg.has_begun:
            self.resting += dt
            return self._still
        self._otg.time += dt
        over = self._otg.over
        if over >= 0.0:
            if self._passes and (self._otg.time > self._until or self._nears_limit()):
                self._halt(self._state())
            elif not self._passes:
                self.resting = over
        there = self._state()[0]
        if self._waits and self._goal is not None and not self._stopping:
            self.resting, self._waited = 0.0, self._waited + dt
            if self._waited >= _AGAIN:
                self.aim(*self._goal)
        return there if self._hard is None else self._hard.advance(dt, there)

    def brake(self, *, scale: float, rate: float, speed: Array | None = None) -> None:
        """Come to rest as fast as the axes may, ignoring further targets; ends when `is_still`.

        An axis that would get beyond its range by the limit of its jerk brakes without that, and harder than planned
        motions do where that would not be enough: only one that was pushed is so fast there.

        Args:
            scale: speed as a fraction of full speed; the stop itself runs at full speed.
            rate: change of that fraction [1/s].
            speed: velocity instead of the planned one, shape (7,) [rad/s].
        """
        if self._stopping:
            return
        q, dq, ddq = self._state()
        if speed is not None:
            dq = speed
        limit = self._limits.acceleration  # beyond it the axis would reverse at the end of braking
        dq = dq * scale
        self._halt((q, dq, np.clip(ddq * scale * scale + dq * rate, -limit, limit)))
        self._stopping = True
        end = self._otg.at(self._otg.duration)[0] if self._otg.has_begun else q
        low, high = np.minimum(self._limits.lowest, q), np.maximum(self._limits.highest, q)
        outside = (end < low - _TINY) | (end > high + _TINY)
        if outside.any():
            room = np.where(dq > 0.0, high - q, q - low)
            self._hard = _HardBrake(outside, here=q, speed=dq, acceleration=_hardest(dq, room, limit))

    @property
    def is_still(self) -> bool:
        """Whether a braked motion has come to rest."""
        return self._stopping and self._otg.over >= 0.0

    def _new_trajectory(self) -> OnlineTrajectory:
        otg = OnlineTrajectory(7, synchronization=Synchronization.Time, halting=Synchronization.No)
        otg.limit(self._limits.acceleration, self._limits.jerk, velocity=self._limits.velocity)
        return otg

    def _nears_limit(self) -> bool:
        """Whether an axis has to brake now, since it passed its target with a velocity."""
        q, dq, _ = self._state()
        return bool((np.abs(self._limits.bounded(q, dq, 2.0 * TICK)) < np.abs(dq) - _TINY).any())

    def _halt(self, state: OtgState) -> None:
        self._passes = False
        self._otg.halt(state)

    def _state(self) -> OtgState:
        if self._otg.has_begun:
            return self._otg.at(self._otg.time)
        return self._still, np.zeros(7), np.zeros(7)


class DirectFollower:
    """Follows targets directly, within velocity and acceleration limits only; interface of `SmartFollower`."""

    def __init__(self, limits: ServoLimits, here: Array) -> None:
        self._limits = limits
        self._q = here.copy()
        self._dq = np.zeros(7)
        self._target = here.copy()
        self._left = 0.0
        self._brake: SmartFollower | None = None
        self.resting = 0.0

    def restart(self, here: Array) -> None:
        """Go on from a set-point at rest, shape (7,) [rad], to the target."""
        self._q, self._dq = here.copy(), np.zeros(7)
        self.aim(self._target)

    @property
    def remaining(self) -> float:
        """Approximate time until the target is reached [s]."""
        return self._left

    def aim(self, q: Array, dq: Array | None = None) -> None:
        """Set the target, shape (7,) [rad], beyond a limit: on it; its velocity follows from the next targets."""
        self._target = q = self._limits.within(q)
        least = float((np.abs(q - self._q) / self._limits.velocity).max())
        self._left = max(self._limits.timing.min_trajectory_time, least)
        self.resting = 0.0

    def ahead(self, dt: float) -> Array:
        """What `advance` would return if no further target came, shape (7,) [rad]."""
        return self._next(dt)[0] if self._brake is None else self._brake.ahead(dt)

    def advance(self, dt: float) -> Array:
        """The set-point after `dt` seconds of the motion's own time, shape (7,) [rad]."""
        if self._brake is not None:
            return self._brake.advance(dt)
        self._q, self._dq = self._next(dt)
        if dt > 0.0:
            self._left = max(0.0, self._left - dt)
            self.resting = self.resting + dt if self._left == 0.0 else 0.0
        return self._q

    def _next(self, dt: float) -> tuple[Array, Array]:
        """Set-point and its velocity after `dt` seconds of the motion's own time, shape (7,) each [rad, rad/s]."""
        if dt <= 0.0:
            return self._q, self._dq
        limits, distance = self._limits, self._target - self._q
        ceiling = np.minimum(limits.velocity, stoppable(np.abs(distance), limits.acceleration))
        # an axis that had to pass its target, since that came too near, stays within its range
        below = np.minimum(limits.lowest - self._q, 0.0)
        above = np.maximum(limits.highest - self._q, 0.0)
        velocity = np.clip(
            np.clip(distance / max(self._left, APPROACH), -ceiling, ceiling),
            -stoppable(-below, limits.acceleration),
            stoppable(above, limits.acceleration),
        )
        dq = self._dq + np.clip(velocity - self._dq, -limits.acceleration * dt, limits.acceleration * dt)
        return self._q + np.clip(dq * dt, below, above), dq

    def brake(self, *, scale: float, rate: float) -> None:
        """Come to rest as fast as the axes may."""
        if self._brake is None:
            self._brake = SmartFollower(self._limits, self._q)
            self._brake.brake(scale=1.0, rate=0.0, speed=self._dq * scale)

    @property
    def is_still(self) -> bool:
        """Whether a braked motion has come to rest."""
        return self._brake is not None and self._brake.is_still


Follower = SmartFollower | DirectFollower | StraightFollower


def braking_axes(robot: RobotModel, here: Array, speed: Array, *, jerk: float = 1.0) -> SmartFollower:
    """A follower whose axes brake, each by itself and as hard as it may; arguments as of `AxisStop`."""
    limits = ServoLimits(
        robot.dq_max, robot.ddq_max, jerk * robot.dddq_max, robot.q_min, robot.q_max, _NO_TIMING
    )
    braking = SmartFollower(limits, here)
    braking.brake(scale=1.0, rate=0.0, speed=np.clip(speed, -robot.dq_max, robot.dq_max))
    return braking


class AxisStop:
    """Brakes every axis by itself: how a safety stop acts on a servo motion, which has no path to keep.

    Args:
        robot: the robot, whose highest accelerations it uses.
        here: present set-point, shape (7,) [rad].
        speed: its velocity, shape (7,) [rad/s].
        jerk: as a multiple of that of motions.
    """

    def __init__(self, robot: RobotModel, here: Array, speed: Array, *, jerk: float) -> None:
        self._stop = braking_axes(robot, here, speed, jerk=jerk)

    @property
    def is_over(self) -> bool:
        """Whether the axes are at rest."""
        return self._stop.is_still

    def advance(self) -> Array:
        """The next set-point, shape (7,) [rad]."""
        return self._stop.advance(TICK)


def follower(robot: RobotModel, motion: ServoMotion, here: Array, *, tcp: tuple[float, ...]) -> Follower:
    """The follower of a servo motion that begins at rest, at a set-point of shape (7,) [rad]."""
    if isinstance(motion, ServoStraight):
        return StraightFollower(robot, motion, here, tcp=tcp)
    limits = ServoLimits.of(
        robot,
        velocity=fractions(motion.dynamics.velocity),
        acceleration=fractions(motion.dynamics.acceleration),
        timing=motion.timing,
    )
    return (DirectFollower if isinstance(motion, ServoDirect) else SmartFollower)(limits, here)
