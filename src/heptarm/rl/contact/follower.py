"""A policy of a task with contacts driven by messages: states and targets in, set-points out. For ROS nodes, say."""

from __future__ import annotations

from math import nan
from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError, NotReady
from heptarm.rl.contact.pilot import ContactPilot
from heptarm.rl.contact.task import ContactTask
from heptarm.rl.deploy_contact import ContactSettings
from heptarm.rl.policy import Policy
from heptarm.rl.tasks import deployed_task
from heptarm.values.checks import Array, array, instance
from heptarm.values.pose import Pose, check_pose

#: Set-points a decision: 100 a second at 20 decisions.
_FINE = 5
#: The zero of the wrench is its mean over so long at rest [ns]; the tip is at rest while it moves less than this [m].
_ZEROING, _AT_REST = 500_000_000, 1e-3
#: An episode does not go on after so long without a state [s].
_LOST = 2.0
#: Joint positions, which no policy looks at here.
_UNSEEN = np.zeros(7)


class ContactFollower:
    """Does a task with contacts once for each target; before and after it sends nothing, and the arm rests.

    The wrench is zeroed for half a second first, with the arm at rest and in touch with nothing. Not thread-safe.

    Args:
        policy: of a task with contacts that needs neither gripper, camera nor joint positions.
        settings: `force`, `peak` and `seconds` are those of a deployment; without a state for `stale` nothing is sent,
            and after two seconds the episode is over.

    Attributes:
        task: the policy's.
        rate: how often a second `command` is called [Hz].
        settings: see above.
        ended: how the last episode ended: "success", "time", "force", "stale", "failure", or "": it has not.

    Raises:
        CommandRejected: the policy is of another task, or its task looks at bodies or joint positions, uses a gripper
            or chooses the stiffness.
    """

    def __init__(self, policy: Policy[Any], *, settings: ContactSettings | None = None) -> None:
        given = instance(policy, Policy, "policy").task
        task = self.task = deployed_task(given, ContactTask, given.model)  # type: ignore[type-abstract]
        if task.look_size or task.has_gripper or task.has_stiffness or task.shows("joints"):
            raise CommandRejected(
                "the policy must need neither gripper, camera, joint positions nor a stiffness of its own, "
                f"got one of {task.name}",
                parameter="policy",
                value=task.name,
                hint="heptarm.rl.deploy_contact.deploy_contact deploys it",
            )
        self.rate, self.settings, self.ended = task.rate * _FINE, settings or ContactSettings(), ""
        self._pilot = ContactPilot(policy, steps=self.settings.timed(task).steps)
        self._goal = np.zeros(task.targets(np.random.default_rng(0), 1).shape[1])
        self._origin: Pose | None = None
        self._tip: Pose | None = None
        self._stamp, self._seen = 0, -np.inf
        self._loads: list[Array] = []  # since the zeroing, or the last decision, began
        self._rested_at, self._rested_from = np.zeros(3), 0
        # of an episode under way
        self._is_under_way = False
        self._zero = self._last = self._next = np.zeros(6)
        self._started = self._decided = 0

    @property
    def distance(self) -> float:
        """What is missing by the newest decision [m]; NaN before an episode."""
        return self._pilot.missing if self._is_under_way or self.ended else nan

    def on_state(self, tip: Pose, wrench: npt.ArrayLike, stamp: int, now: float) -> None:
        """Take a state of the arm.

        Args:
            tip: pose of what is held, where the site `tip` of the task's scene is, in the base.
            wrench: on it, in base axes, shape (6,) [N, Nm].
            stamp: time of the robot's clock [ns].
            now: the time [s].
        """
        load = array(wrench, 6, "wrench")
        is_new = stamp != self._stamp
        self._tip, self._stamp, self._seen = tip, stamp, now
        if not self._is_under_way and np.linalg.norm(tip.xyz - self._rested_at) > _AT_REST:
            self._rest()
        if is_new and self._origin is not None:
            self._loads.append(load)
        if self._is_under_way and np.linalg.norm((load - self._zero)[:3]) > self.settings.peak:
            self._end("force")

    def check(self, origin: Pose) -> Pose:
        """Return a frame of the task in the base, if an episode can begin where the tip is.

        Raises:
            LimitError: the tip is outside the task's box.
            NotReady: no state has arrived yet.
            ShapeError: it is no pose.
        """
        check_pose(origin, "target")
        if self._tip is None:
            raise NotReady(
                "no robot state received yet", hint="check the driver's name, and that it is active"
            )
        start = _in(origin, self._tip)
        low, high = self.task.box
        axes = np.array(self.task.axes)
        if not ((start >= low) & (start <= high))[axes].all():
            raise LimitError(
                f"the tip must be in the box of the task {self.task.name} when an episode begins, got "
                f"{np.round(start, 3).tolist()} m and rad in the frame of the task",
                parameter="target",
                value=start.tolist(),
                allowed=f"{np.round(low, 3).tolist()} to {np.round(high, 3).tolist()}",
                hint="move the tip above the work first, or correct the target",
            )
        return origin

    def on_target(self, origin: Pose | None) -> None:
        """Begin an episode, as soon as the wrench is zeroed.

        Args:
            origin: frame of the task in the base, such as the presumed hole; None: end the episode.

        Raises:
            LimitError: as `check`; what is under way goes on.
            NotReady: likewise.
            ShapeError: likewise.
        """
        self._origin = None if origin is None else self.check(origin)
        self._is_under_way, self.ended = False, ""
        self._rest()

    def command(self, now: float) -> Pose | None:
        """The next set-point of the tip in the base; call it `rate` times a second.

        None: no episode, it has not begun yet, or no fresh state; then send nothing.

        Raises:
            CommandRejected: the policy diverges; the episode is over.
        """
        if self._origin is None or self._tip is None:
            return None
        if not now - self._seen <= self.settings.stale:
            if now - self._seen > _LOST:
                self._end("stale")
            return None
        try:
            return self._set_point(self._origin, self._tip)
        except CommandRejected:
            self._end("failure")
            raise

    def _set_point(self, origin: Pose, tip: Pose) -> Pose | None:
        if not self._is_under_way:
            if self._stamp - self._rested_from < _ZEROING or not self._loads:
                return None
            self._zero, self._started, self._decided = np.mean(self._loads, axis=0), self._stamp, 0
            self._is_under_way = True
            self._pilot.begin(_in(origin, tip), self._goal, {}, q=_UNSEEN)
            self._decide()
        # by the robot's clock; a machine that is late decides less often
        passed = (self._stamp - self._started) * 1e-9 * self.task.rate - self._decided
        if passed >= 1.0:
            self._decided += int(passed)
            passed -= int(passed)
            load = np.mean(self._loads, axis=0) - self._zero
            axes = origin.rotation
            felt = np.concatenate([load[:3] @ axes, load[3:] @ axes])
            self._pilot.measure(_in(origin, tip), felt, {}, q=_UNSEEN)
            if self._pilot.is_over:
                self._end("success" if self._pilot.missing <= self.task.radius else "time")
                return None
            self._decide()
        part = self._last + (self._next - self._last) * min(passed + 1.0 / _FINE, 1.0)
        return origin @ Pose.from_rotvec(part[:3], part[3:6])

    def _decide(self) -> None:
        self._last, self._next = self._pilot.decide()
        self._loads.clear()

    def _end(self, how: str) -> None:
        self._origin, self._is_under_way, self.ended = None, False, how

    def _rest(self) -> None:
        """Zero the wrench from here on."""
        self._rested_at = np.zeros(3) if self._tip is None else self._tip.xyz
        self._rested_from = self._stamp
        self._loads.clear()


def _in(origin: Pose, pose: Pose) -> Array:
    """A pose in the frame of the task, shape (6,) [m, rad]."""
    seen = origin.inverse() @ pose
    return np.concatenate([seen.xyz, seen.rotvec])
