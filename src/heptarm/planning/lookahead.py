"""Plans a program of motions as the controller would, before it is sent.

The values that a client sends become the orders that the cabinet's doubles would give to the plant, and `plan` plans
them: there is one planner. It runs beside a robot, too: it needs neither Java nor MuJoCo.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import ceil, isinf, nan

import numpy as np

from heptarm.errors import CommandRejected, LimitError, Unreachable
from heptarm.model.inverse_kinematics import redundancy
from heptarm.planning.command import Order, PlanError, Seven
from heptarm.planning.plan import Plan
from heptarm.planning.planner import plan
from heptarm.values.arrays import Array, frozen
from heptarm.values.frames import TOOL
from heptarm.values.motion.circle import Circ
from heptarm.values.motion.dynamics import Blended, Dynamics
from heptarm.values.motion.hand_guiding import HandGuide
from heptarm.values.motion.line import Lin, LinRel
from heptarm.values.motion.motion import Hold, Motion
from heptarm.values.motion.ptp import Ptp, PtpHome, PtpPose
from heptarm.values.motion.spline import JointSpline, Segment, Spline
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel

#: Time on both sides of a sample from which its velocity and acceleration are computed [s].
_STENCIL = 1e-3
#: Most samples of a program; a longer one is sampled more coarsely.
_MOST_SAMPLES = 5000
_KEEP = (nan, -1, -1)
#: Slowest speed ds/dt that is no rest [1/s].
_RESTS = 1e-6
#: The errors of what a plan is refused for, and their remedies.
_ERRORS: dict[str, type[CommandRejected]] = {"joint_limit": LimitError, "unreachable": Unreachable}
_REMEDIES: dict[type[CommandRejected], str] = {
    LimitError: "choose another arm angle or another path: the robot would refuse this one",
    Unreachable: "choose a nearer target, or another start",
    CommandRejected: "choose another path: the robot would refuse this one",
}


@dataclass(frozen=True, slots=True)
class FramesOfArm:
    """The frames that motions name.

    Attributes:
        tip: pose of a motion frame in the flange frame, by its name.
        fixed: pose of a reference frame in the base, by its name; None: it is a frame on the flange.
    """

    tip: Callable[[str], Pose]
    fixed: Callable[[str], Pose | None]


@dataclass(frozen=True, slots=True)
class PlannedProgram:
    """A program over time, from rest at its start to rest at its end; n samples.

    Attributes:
        t: times [s], from 0 on, shape (n,).
        q: joint positions, shape (n, 7) [rad].
        dq: joint velocities, shape (n, 7) [rad/s].
        ddq: joint accelerations, shape (n, 7) [rad/s²].
        begins: time at which each motion begins; of a blended one the middle of the blend [s].
        is_blended: whether each motion is blended into the next one.
    """

    t: Array
    q: Array
    dq: Array
    ddq: Array
    begins: tuple[float, ...]
    is_blended: tuple[bool, ...]

    @property
    def duration(self) -> float:
        """Time at full override [s]."""
        return float(self.t[-1])


def look_ahead(
    robot: RobotModel, start: Array, motions: Sequence[Motion], frames: FramesOfArm, *, step: float
) -> PlannedProgram:
    """Plan motions one after the other, as one program.

    Args:
        robot: the robot.
        start: joint positions at rest, shape (7,) [rad].
        motions: in their order.
        frames: what the names of frames mean.
        step: largest time between two samples [s].

    Raises:
        LimitError: a joint would leave its limits; the text names motion, joint and place.
        Unreachable: a pose is out of reach.
        CommandRejected: another reason for which the controller would not execute it, such as a singularity, or a
            motion without a path of its own.
    """
    plans: list[Plan] = []
    here, first = start, 0
    while first < len(motions):
        last = first
        while last + 1 < len(motions) and _joins(motions[last], motions[last + 1]):
            last += 1
        plans.append(_planned(robot, here, motions, range(first, last + 1), frames))
        here, first = plans[-1].end, last + 1
    coarse = max(step, sum(one.duration for one in plans) / _MOST_SAMPLES)
    samples = [_Samples.of(one, coarse) for one in plans]
    starts = np.concatenate([[0.0], np.cumsum([one.t[-1] for one in samples])]).tolist()
    # one ends where the next one begins: that sample counts once
    kept = [slice(0, None), *[slice(1, None)] * (len(samples) - 1)]
    both = list(zip(samples, kept, strict=True))
    return PlannedProgram(
        frozen(
            np.concatenate([begin + one.t[part] for begin, (one, part) in zip(starts, both, strict=False)])
        ),
        frozen(np.concatenate([one.q[part] for one, part in both])),
        frozen(np.concatenate([one.dq[part] for one, part in both])),
        frozen(np.concatenate([one.ddq[part] for one, part in both])),
        tuple(begin + own for begin, one in zip(starts, samples, strict=False) for own in one.begins),
        tuple(fact for one in samples for fact in one.is_blended),
    )


@dataclass(frozen=True, slots=True)
class _Samples:
    """A plan over time; begins and is_blended have an entry for each of its motions."""

    t: Array
    q: Array
    dq: Array
    ddq: Array
    begins: tuple[float, ...]
    is_blended: tuple[bool, ...]

    @classmethod
    def of(cls, planned: Plan, step: float) -> _Samples:
        """Sample a plan at even times, its ends included."""
        count = len(planned.order.parts) if planned.order.kind == "batch" else 1
        if planned.path is None or planned.timing is None:
            hold = planned.duration if planned.order.kind == "hold" else 0.0
            t, still = np.array([0.0, hold]), np.zeros((2, 7))
            q = np.tile(planned.start, (2, 1))
            return cls(t, q, still, still, (0.0,) * count, (False,) * count)
        path, profile = planned.path, planned.timing.profile
        t = np.linspace(0.0, profile.duration, max(2, ceil(profile.duration / step) + 1))
        h = min(_STENCIL, profile.duration / 4)
        near, places, joints = planned.start, [], []
        for time in t.tolist():
            row = []
            for moment in (time - h, time, time + h):
                near = path.at(min(1.0, profile.at(min(max(0.0, moment), profile.duration))[0]), near)
                row.append(near)
            joints.append(row)
            places.append(profile.at(time)[0])
        before, q, after = np.array(joints).transpose(1, 0, 2)
        dq, ddq = (after - before) / (2 * h), (after - 2 * q + before) / h**2
        dq[[0, -1]] = ddq[[0, -1]] = 0.0  # at rest
        marks = planned.marks if planned.order.kind == "batch" else ()
        begins = [0.0, *np.interp(marks, places, t).tolist()]
        moves = [profile.at(begin)[1] > _RESTS for begin in begins[1:]]
        return cls(t, q, dq, ddq, tuple(begins), (*moves, False))


# --------------------------------------------------------------------------------------- motions as orders


def _joins(motion: Motion, following: Motion) -> bool:
    """Whether the cabinet sends two motions to the robot as one batch: the first one is blended into the second."""
    if not isinstance(motion, Blended) or not isinstance(following, Blended):
        return False
    blending = motion.blending
    has_zone = blending.relative > 0 or blending.distance > 0 or blending.orientation > 0
    return has_zone and _moving(motion) == _moving(following)


def _moving(motion: Motion) -> str:
    return getattr(motion, "moving", TOOL)


def _planned(
    robot: RobotModel, start: Array, motions: Sequence[Motion], which: range, frames: FramesOfArm
) -> Plan:
    """The plan of some of the motions, which the controller executes together."""
    try:
        parts = tuple(_order(robot, motions[index], frames) for index in which)
    except CommandRejected as error:
        if place := _place(which, motions):
            error.parameter = ""  # it is the whole motion
        raise error.inside(place) from None
    order = parts[0]
    if len(parts) > 1:
        order = Order(0, "batch", tcp=parts[0].tcp, parts=parts)
    try:
        return plan(robot, order, start)
    except PlanError as error:
        kind = _ERRORS.get(error.kind, CommandRejected)
        place = _place(which, motions)
        parameter = "" if place else "motion"
        raise kind(str(error), parameter=parameter, hint=_REMEDIES[kind]).inside(place) from None


def _place(which: range, motions: Sequence[Motion]) -> str:
    """The motions of a program of several; "": it has only one."""
    if len(motions) == 1:
        return ""
    return f"motions[{which[0]}]" if len(which) == 1 else f"motions[{which[0]}:{which[-1] + 1}]"


def _order(robot: RobotModel, motion: Motion, frames: FramesOfArm) -> Order:
    """The order that the plant would get for a motion."""
    tcp = frames.tip(_moving(motion))
    base = Order(0, "hold", tcp=_seven(tcp))
    if isinstance(motion, Hold):
        if isinf(motion.duration):
            raise CommandRejected(
                "a hold without a duration has no end to look ahead to",
                parameter="motion",
                hint="give it a duration, such as hold(2.0)",
            )
        return replace(base, duration=motion.duration)
    if isinstance(motion, HandGuide):
        raise CommandRejected(
            "hand guiding has no path to look ahead along: the person chooses it",
            parameter="motion",
            hint="leave it out of the program",
        )
    if isinstance(motion, Spline):
        parts = tuple(_segment(base, one, motion.dynamics) for one in motion.segments)
        return _limited(replace(base, kind="spline", parts=parts), motion.dynamics)
    if isinstance(motion, JointSpline):
        for index, point in enumerate(motion.points):
            robot.check(point.q, f"points[{index}].q")
        points = tuple(
            _limited(
                replace(base, kind="ptp", joints=tuple(one.q.tolist())),
                one.dynamics.filled_from(motion.dynamics),
            )
            for one in motion.points
        )
        return _limited(replace(base, kind="spline_joints", parts=points), motion.dynamics)
    if not isinstance(motion, Blended):
        raise CommandRejected(
            f"{type(motion).__name__} cannot be looked ahead",
            parameter="motion",
            hint="leave it out of the program",
        )
    order = _limited(_aimed(base, robot, motion, tcp, frames), motion.dynamics)
    zone = motion.blending
    return replace(order, blending=(zone.relative, zone.distance, zone.orientation))


def _aimed(order: Order, robot: RobotModel, motion: Blended, tcp: Pose, frames: FramesOfArm) -> Order:
    """An order with kind and target of a motion from one place to another."""
    if isinstance(motion, Ptp):
        robot.check(motion.q)
        return replace(order, kind="ptp", joints=tuple(motion.q.tolist()))
    if isinstance(motion, PtpHome):
        return replace(order, kind="ptp", joints=(0.0,) * 7)
    if isinstance(motion, LinRel):
        return _relative(replace(order, orientation=motion.orientation), motion, tcp, frames)
    target = replace(order, redundancy=_redundancy(robot, motion))
    if isinstance(motion, PtpPose):
        return replace(target, kind="ptp", pose=_seven(motion.target))
    if isinstance(motion, Lin):
        return replace(target, kind="lin", pose=_seven(motion.target), orientation=motion.orientation)
    assert isinstance(motion, Circ)
    return replace(
        target,
        kind="circ",
        via=_seven(motion.via),
        pose=_seven(motion.end),
        orientation=motion.orientation,
    )


def _relative(order: Order, motion: LinRel, tcp: Pose, frames: FramesOfArm) -> Order:
    """The order of a relative line: its offset in the axes of the motion frame, or of a fixed frame."""
    order = replace(order, kind="lin_rel", offset=_seven(motion.offset))
    if motion.frame in (TOOL, motion.moving):
        return order
    fixed = frames.fixed(motion.frame)
    if fixed is not None:
        return replace(order, reference=tuple(fixed.quat.tolist()))
    # a frame on the flange turns with the motion frame
    turn = Pose.of((0.0, 0.0, 0.0), (tcp.inverse() @ frames.tip(motion.frame)).quat)
    return replace(order, offset=_seven(turn @ motion.offset @ turn.inverse()))


def _segment(order: Order, one: Segment, whole: Dynamics) -> Order:
    """The order of a segment of a spline."""
    if isinstance(one, Circ):
        made = replace(order, kind="circ", via=_seven(one.via), pose=_seven(one.end))
    else:
        made = replace(order, kind="lin" if isinstance(one, Lin) else "spl", pose=_seven(one.target))
    return _limited(replace(made, orientation=one.orientation), one.dynamics.filled_from(whole))


def _limited(order: Order, dynamics: Dynamics) -> Order:
    """An order with the limits of a motion."""
    return replace(
        order,
        joint_velocity=_fractions(dynamics.joint_speed),
        joint_acceleration=_fractions(dynamics.joint_acceleration),
        joint_jerk=_fractions(dynamics.joint_jerk),
        cart_velocity=dynamics.speed_mps,
        cart_acceleration=dynamics.acceleration_mps2,
        cart_jerk=dynamics.jerk_mps3,
        ori_velocity=dynamics.speed_radps,
        ori_acceleration=dynamics.acceleration_radps2,
        ori_jerk=dynamics.jerk_radps3,
    )


def _fractions(values: Array) -> Seven:
    return tuple(np.where(np.isnan(values), 1.0, values).tolist())


def _redundancy(robot: RobotModel, motion: Blended) -> tuple[float, int, int]:
    """Arm angle, Status and Turn of a target: as given, as near joint positions, or as now."""
    near, given = getattr(motion, "near", None), getattr(motion, "redundancy", None)
    if near is not None:
        robot.check(near, "near")
        own = redundancy(robot, near.tolist())
        return own.e1, own.status, -1
    return _KEEP if given is None else (given.e1, given.status, given.turn)


def _seven(pose: Pose) -> Seven:
    """Position [m] and quaternion."""
    return (*pose.xyz.tolist(), *pose.quat.tolist())
