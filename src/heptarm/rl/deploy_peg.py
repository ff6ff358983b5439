"""Deployment of a peg-in-hole policy on a virtual or real arm, with the observations and set-points of training.

The policy decides at the task's rate; between two decisions the set-point of the Cartesian impedance moves in small
steps over a servo motion. The task's leash and box bound the forces, and the largest force of the impedance, which the
cabinet keeps. Nothing here needs torch or MuJoCo.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError, ShapeError, StreamError
from heptarm.rl.deploy import fresh
from heptarm.rl.peg import PegInHole
from heptarm.rl.policy import Policy
from heptarm.rl.report import EpisodeReport
from heptarm.values.checks import Array, instance, within
from heptarm.values.frames import check_name
from heptarm.values.mode.impedance import CartesianImpedance
from heptarm.values.motion.line import lin, lin_rel
from heptarm.values.pose import Pose, check_pose

if TYPE_CHECKING:
    from heptarm.arm.verbs import ArmVerbs
    from heptarm.values.state import State

#: Ticks of the servo motion a decision: 100 a second at 20 decisions.
_FINE = 5
#: Damping ratio of the impedance, as in training.
_RATIO = 0.7
#: The tip is brought so far above the presumed rim, and out of the hole [m].
_CLEAR = 0.02
#: Speeds to the start and out of the hole [m/s].
_APPROACH, _RETREAT = 0.1, 0.05


@dataclass(frozen=True, slots=True)
class InsertionSettings:
    """Settings of a deployment.

    Attributes:
        frame: of the tool or workpiece, at the middle of the peg's end, its z axis out of the peg.
        force: largest that the control exerts in each direction [N]; the arm is held compliant at it.
        latency: added between seeing and commanding [s].
        stale: an older state ends the deployment [s].
    """

    _: KW_ONLY
    frame: str = "tip"
    force: float = 25.0
    latency: float = 0.0
    stale: float = 0.25

    def __post_init__(self) -> None:
        check_name(self.frame, "frame")
        within(self.force, "force", 1.0, 100.0, unit="N")
        within(self.latency, "latency", 0.0, 0.5, unit="s")
        within(self.stale, "stale", 0.0, 60.0, above=True, unit="s")


@dataclass(frozen=True, slots=True)
class _Episode:
    poses: Array
    joints: Array
    forces: Array


def deploy_peg(
    arm: ArmVerbs,
    policy: Policy[PegInHole],
    hole: Pose,
    errors: npt.ArrayLike | None = None,
    *,
    settings: InsertionSettings | None = None,
    progress: Callable[[int, float], object] | None = None,
) -> EpisodeReport:
    """Insert a peg that the arm holds, one episode per error of the presumed hole; each ends with the peg outside.

    Args:
        arm: in control, the peg in its gripper and attached, its tip above the hole and free to move there in a line.
        policy: of the peg-in-hole task for this robot.
        hole: where the hole is: origin in the middle of the rim, z into it; base frame.
        errors: where it truly is in the frame that the policy presumes, as `PegInHole.targets` draws them, shape (n, 6)
            [m, rad]; None: one episode, presumed where `hole` is.
        settings: frame, force and so on.
        progress: called after each episode with its number and the depth that is missing [m].

    Returns:
        The report; missing depths count from `hole`, forces are those of the arm's own estimate.

    Raises:
        CommandRejected: a policy of another task, or no such frame.
        LimitError: a robot that is not the task's.
        ShapeError: errors of another shape, or not finite.
        StaleState: no more states arrived; the arm was stopped.
        StreamError: the servo stream ended early.
    """
    task, chosen = instance(policy, Policy, "policy").task, settings or InsertionSettings()
    if not isinstance(task, PegInHole):
        raise CommandRejected(
            f"the policy must be of the task {PegInHole.name}, got one of {task.name}",
            parameter="policy",
            value=task.name,
        )
    if arm.robot.name != task.model.name:
        raise LimitError(
            f"the policy was trained for the {task.model.title}; this is a {arm.robot.title}",
            parameter="policy",
            value=task.robot,
            hint=f"train one with --robot {arm.robot.name}",
        )
    check_pose(hole)
    holes = np.zeros((1, 6)) if errors is None else np.atleast_2d(np.asarray(errors, dtype=np.float64))
    if holes.shape[1:] != (6,) or not len(holes) or not np.isfinite(holes).all():
        raise ShapeError(
            f"errors must have shape (n, 6) and be finite, got shape {holes.shape}", parameter="errors"
        )
    arm.subscribe(rate=2.0 * _FINE * task.rate)
    arm.pose(chosen.frame)  # refuses a frame that is not there before anything moves
    spring = CartesianImpedance(
        np.repeat([task.stiffness, task.turn_stiffness], 3),
        damping=_RATIO,
        max_force={"xyz": chosen.force},
    )
    episodes = []
    late = 0
    for number, error in enumerate(holes):
        presumed = hole @ Pose.from_rotvec(error[:3], error[3:]).inverse()
        episode, ticks = _run(arm, policy, presumed, spring, chosen)
        episodes.append(episode)
        late += ticks
        if progress is not None:
            progress(number, float(_missing(task, episode.poses[-1], error)))
    poses = np.array([one.poses for one in episodes])
    facts = {
        "engine": "arm",
        "robot": arm.robot.title,
        "virtual": arm.is_virtual,
        "latency": chosen.latency,
        "late_ticks": late,
    }
    return EpisodeReport(
        task,
        holes,
        _missing(task, poses[:, 1:], holes[:, None]),
        poses[..., :3],
        joints=np.array([one.joints for one in episodes]),
        forces=np.array([one.forces for one in episodes]),
        facts=facts,
    )


def _run(
    arm: ArmVerbs,
    policy: Policy[PegInHole],
    presumed: Pose,
    spring: CartesianImpedance,
    settings: InsertionSettings,
) -> tuple[_Episode, int]:
    """One episode and the way out; its record and the number of late ticks."""
    task, frame = policy.task, settings.frame
    above = presumed.shifted(z=-_CLEAR, frame="tool")
    start = presumed.shifted(z=-float(np.mean(task.above)), frame="tool")
    arm.move([lin(one, moving=frame, speed_mps=_APPROACH) for one in (above, start)])
    arm.wait_for_rest()
    rate = task.rate * _FINE * arm.real_time_factor
    with arm.servo("lin", rate=rate, mode=spring, moving=frame) as sv:
        tip = _Tip(arm, presumed, frame, sv.start)
        command = pose = tip.pose(sv.start)
        delay = round(settings.latency * task.rate * _FINE)
        waiting = deque([command] * (delay + 1), maxlen=delay + 1)
        frames = deque([task.frame(pose, pose, np.zeros(6))] * (max(task.history) + 1))
        poses, joints, forces = [pose], [sv.start.q], []
        for _ in range(task.steps):
            last, command = (
                command,
                task.advance(command, pose, policy(task.observe(np.array(frames))).astype(np.float64)),
            )
            wrenches = []
            for tick in range(1, _FINE + 1):
                waiting.append(last + (command - last) * tick / _FINE)
                sv.set(presumed @ Pose.from_rotvec(waiting[0][:3], waiting[0][3:]))
                if sv.tick() is None:
                    raise StreamError(
                        "the servo stream ended before the episode did", hint="look at the cabinet's log"
                    )
                state = fresh(arm, settings.stale)
                wrenches.append(tip.wrench(state))
            pose, wrench = tip.pose(state), np.mean(wrenches, axis=0)
            frames.appendleft(task.frame(pose, command, wrench))
            frames.pop()
            poses.append(pose)
            joints.append(state.q)
            forces.append(float(np.linalg.norm(wrench[:3])))
        late = sv.stats.late_ticks
    out = lin_rel(z=-max(float(poses[-1][2]), 0.0) - _CLEAR, frame=presumed, moving=frame, speed_mps=_RETREAT)
    arm.move(out, mode=spring)
    return _Episode(np.array(poses), np.array(joints), np.array(forces)), late


def _missing(task: PegInHole, poses: Array, holes: Array) -> Array:
    """Depth that is missing, shape (...,) [m].

    Beside the hole an arm cannot be deep. How far aside the tip seems to be does not count, since a peg turns in its
    gripper.
    """
    return task.depth - np.minimum(task.offset(poses, holes)[..., 2], task.depth)


class _Tip:
    """Pose of the tip and wrench on it in the frame of the presumed hole, the wrench zeroed at the start."""

    def __init__(self, arm: ArmVerbs, presumed: Pose, frame: str, start: State) -> None:
        self._arm, self._frame = arm, frame
        self._to_hole, self._axes = presumed.inverse(), presumed.rotation
        self._zero = np.zeros(6)
        self._zero = self.wrench(start)

    def pose(self, state: State) -> Array:
        """Shape (6,) [m, rad]."""
        seen = self._to_hole @ self._arm.pose(self._frame, state=state)
        return np.concatenate([seen.xyz, seen.rotvec])

    def wrench(self, state: State) -> Array:
        """Shape (6,) [N, Nm]."""
        load = self._arm.wrench(self._frame, state=state)
        result: Array = np.concatenate([load.force @ self._axes, load.torque @ self._axes]) - self._zero
        return result
