"""Plans a program of motions as the controller would, before it is sent.

The items that a client sends become the motions that the cabinet's doubles would give to the plant, and `plan` plans
them: there is one planner. It runs beside a robot, too: it needs neither Java nor MuJoCo.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from enum import Enum
from math import ceil, isnan
from typing import Any, TypeVar

import numpy as np

from heptarm.errors import CommandRejected, LimitError, Unreachable
from heptarm.planning import seam
from heptarm.planning.motion import PlanError
from heptarm.planning.plan import Plan
from heptarm.planning.planner import plan
from heptarm.values.checks import Array, frozen
from heptarm.values.frames import TOOL
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel
from heptarm.wire import messages as wire

_Planned = TypeVar("_Planned")

#: Time on both sides of a sample from which its velocity and acceleration are computed [s].
_STENCIL = 1e-3
#: Most samples of a program; a longer one is sampled more coarsely.
_MOST_SAMPLES = 5000
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
    robot: RobotModel, start: Array, items: Sequence[wire.Item], frames: FramesOfArm, *, step: float
) -> PlannedProgram:
    """Plan motions one after the other, as one program.

    Args:
        robot: the robot.
        start: joint positions at rest, shape (7,) [rad].
        items: of the program, in their order; their poses are in the base.
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
    while first < len(items):
        last = first
        while last + 1 < len(items) and _joins(items[last], items[last + 1]):
            last += 1
        plans.append(_planned(robot, here, items, range(first, last + 1), frames))
        here, first = plans[-1].end, last + 1
    coarse = max(step, sum(plan.duration for plan in plans) / _MOST_SAMPLES)
    samples = [PlanSamples.of(plan, coarse) for plan in plans]
    starts = np.concatenate([[0.0], np.cumsum([sample.t[-1] for sample in samples])]).tolist()
    # one ends where the next one begins: that sample counts once
    kept = [slice(0, None), *[slice(1, None)] * (len(samples) - 1)]
    both = list(zip(samples, kept, strict=True))
    return PlannedProgram(
        frozen(
            np.concatenate(
                [begin + sample.t[part] for begin, (sample, part) in zip(starts, both, strict=False)]
            )
        ),
        frozen(np.concatenate([sample.q[part] for sample, part in both])),
        frozen(np.concatenate([sample.dq[part] for sample, part in both])),
        frozen(np.concatenate([sample.ddq[part] for sample, part in both])),
        tuple(begin + own for begin, sample in zip(starts, samples, strict=False) for own in sample.begins),
        tuple(fact for sample in samples for fact in sample.is_blended),
    )


@dataclass(frozen=True, slots=True)
class PlanSamples:
    """A plan over time; n samples.

    Attributes:
        t: times [s], from 0 on, shape (n,).
        q: joint positions, shape (n, 7) [rad].
        dq: joint velocities, shape (n, 7) [rad/s].
        ddq: joint accelerations, shape (n, 7) [rad/s²].
        begins: time at which each of its motions begins [s].
        is_blended: whether each of its motions is blended into the next one.
    """

    t: Array
    q: Array
    dq: Array
    ddq: Array
    begins: tuple[float, ...]
    is_blended: tuple[bool, ...]

    @classmethod
    def of(cls, planned: Plan, step: float) -> PlanSamples:
        """Sample a plan at even times, its ends included."""
        motion = planned.motion
        count = len(motion.motions) if isinstance(motion, seam.Batch) else 1
        if planned.path is None or planned.timing is None:
            hold = planned.duration if isinstance(motion, seam.Hold) else 0.0
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
        marks = planned.marks if isinstance(motion, seam.Batch) else ()
        begins = [0.0, *np.interp(marks, places, t).tolist()]
        moves = [profile.at(begin)[1] > _RESTS for begin in begins[1:]]
        return cls(t, q, dq, ddq, tuple(begins), (*moves, False))


# ------------------------------------------------------------------------------------ items as the plant's motions


def _joins(item: wire.Item, following: wire.Item) -> bool:
    """Whether the cabinet sends two motions to the robot as one batch: the first one is blended into the second."""
    zone = getattr(item.motion, "blending", None)
    if zone is None or not hasattr(following.motion, "blending"):
        return False
    has_zone = zone.relative > 0 or zone.distance > 0 or zone.orientation > 0
    return has_zone and item.frame == following.frame


def _planned(
    robot: RobotModel, start: Array, items: Sequence[wire.Item], which: range, frames: FramesOfArm
) -> Plan:
    """The plan of some of the items, which the controller executes together."""
    tcp = frames.tip(items[which[0]].frame or TOOL)
    place = _place(which, items)
    try:
        motions = tuple(_motion(items[index], tcp, frames) for index in which)
    except CommandRejected as error:
        if place:
            error.parameter = ""  # it is the whole motion
        raise error.inside(place) from None
    motion = motions[0] if len(motions) == 1 else seam.Batch(motions=motions)
    try:
        return plan(robot, motion, start, tcp=tuple(tcp.array.tolist()))
    except PlanError as error:
        kind = _ERRORS.get(error.kind, CommandRejected)
        parameter = "" if place else "motion"
        raise kind(str(error), parameter=parameter, hint=_REMEDIES[kind]).inside(place) from None


def _place(which: range, items: Sequence[wire.Item]) -> str:
    """The motions of a program of several; "": it has only one."""
    if len(items) == 1:
        return ""
    return f"motions[{which[0]}]" if len(which) == 1 else f"motions[{which[0]}:{which[-1] + 1}]"


def _motion(item: wire.Item, tcp: Pose, frames: FramesOfArm) -> seam.PlantMotion:
    """The motion that the plant would get for an item.

    A motion of the plant has mostly the name and the fields of its message; what differs stands here.
    """
    motion = item.motion
    if isinstance(motion, wire.PtpHome):
        return _same(seam.Ptp, motion, q=(0.0,) * 7)
    if isinstance(motion, wire.LinRel):
        return _same(seam.LinRel, motion, **_relative(motion, item.frame, tcp, frames))
    if isinstance(motion, wire.Spline):
        segments = (
            _same(getattr(seam, type(segment).__name__.removesuffix("Segment")), segment)
            for segment in motion.segments
        )
        return _same(seam.Spline, motion, segments=tuple(segments))
    if isinstance(motion, wire.JointSpline):
        points = (_same(seam.Ptp, point) for point in motion.points)
        return _same(seam.JointSpline, motion, points=tuple(points))
    if isinstance(motion, wire.HandGuide):
        raise CommandRejected(
            "hand guiding has no path to look ahead along: the person chooses it",
            parameter="motion",
            hint="leave it out of the program",
        )
    if isinstance(motion, wire.Hold) and isnan(motion.duration):
        raise CommandRejected(
            "a hold without a duration has no end to look ahead to",
            parameter="motion",
            hint="give it a duration, such as hold(2.0)",
        )
    kind: type[seam.PlantMotion] = getattr(seam, type(motion).__name__)
    return _same(kind, motion)


def _same(kind: type[_Planned], message: Any, **given: Any) -> _Planned:
    """A value of the seam with the fields that a message has under the same names, and the `given` ones."""
    same = {
        field.name: _converted(getattr(message, field.name))
        for field in fields(kind)  # type: ignore[arg-type]
        if field.name not in given and hasattr(message, field.name)
    }
    return kind(**same, **given)


def _converted(value: Any) -> Any:
    if isinstance(value, Enum):
        return getattr(seam, type(value).__name__)[value.name]
    if isinstance(value, float | int | str | bool | tuple):
        return value
    return _same(getattr(seam, type(value).__name__), value)


def _relative(motion: wire.LinRel, moving: str, tcp: Pose, frames: FramesOfArm) -> dict[str, Any]:
    """Offset and axes of a relative line: in the axes of the motion frame, or of a fixed frame."""
    if motion.reference in ("", moving):
        return {}
    fixed = frames.fixed(motion.reference)
    if fixed is not None:
        return {"axes": tuple(fixed.quat.tolist())}
    # a frame on the flange turns with the motion frame
    turn = Pose.of((0.0, 0.0, 0.0), (tcp.inverse() @ frames.tip(motion.reference)).quat)
    offset = turn @ Pose.of(motion.offset.xyz, motion.offset.quat) @ turn.inverse()
    return {"offset": seam.Pose(xyz=tuple(offset.xyz.tolist()), quat=tuple(offset.quat.tolist()))}
