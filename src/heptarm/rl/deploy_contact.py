"""Deployment of a policy of a task with contacts on an arm, with the observations and set-points of training.

The policy decides at the task's rate; between two decisions the set-point of the Cartesian impedance moves in small
steps. The impedance is the cabinet's, with set-points over a servo motion, or a law of torques over FRI. All times are
of the robot's clock, so that a simulator may run at any speed. The task's leash and box bound the forces, and the
largest force of the impedance. Nothing here needs torch or MuJoCo.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import KW_ONLY, dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError, ShapeError, StaleState, StreamError, Timeout, inside
from heptarm.laws.ready import cartesian_impedance
from heptarm.model.inverse_kinematics import solve
from heptarm.rl.contact.pilot import ContactPilot
from heptarm.rl.contact.task import ContactTask
from heptarm.rl.deploy import marked
from heptarm.rl.policy import Policy
from heptarm.rl.report import EpisodeReport
from heptarm.rl.tasks import deployed_task
from heptarm.values.checks import Array, instance, within, word
from heptarm.values.condition.force import ForceAbove
from heptarm.values.frames import check_name
from heptarm.values.mode.impedance import CartesianImpedance
from heptarm.values.motion.line import lin, lin_rel
from heptarm.values.pose import Pose, check_pose
from heptarm.values.result import Cause

if TYPE_CHECKING:
    from heptarm.arm.fri.session import Fri
    from heptarm.arm.verbs import ArmVerbs
    from heptarm.skills.gripper import Gripper
    from heptarm.values.state import State

#: Ticks of the servo motion a decision: 100 a second at 20 decisions.
_FINE = 5
#: What the arm is driven through, and the period of FRI [ms].
THROUGH, _PERIOD = ("servo", "fri"), 2
#: Damping ratio of the impedance, as in training.
_RATIO = 0.7
#: The tip is brought so far above where an episode begins, and at the end [m].
_CLEAR = 0.02
#: Speeds to the start and back [m/s].
_APPROACH, _RETREAT = 0.1, 0.05
#: The zero of the wrench is the mean of so many seconds at rest: a single reading is as uncertain as what it measures.
_ZEROING = 0.5
#: So many times as long as in training may an episode take: an arm is slower now and then, and nobody waits in vain.
_PATIENT = 2
#: Longest wait for these, and longest time of an episode [s].
_PATIENCE, _LONGEST = 30.0, 600.0
#: A tick that is so late on the robot's clock is counted [ns].
_LATE = 10_000_000


@dataclass(frozen=True, slots=True)
class ContactSettings:
    """Settings of a deployment.

    Attributes:
        frame: of the tool or workpiece, where the site `tip` of the task's scene is.
        through: "servo": a servo motion in the cabinet's Cartesian impedance, 100 set-points a second; "fri": the law
            `laws.cartesian_impedance` at that frame, torques 500 times a second.
        force: largest that the control exerts in each direction [N]; the arm is held compliant at it.
        peak: a larger force on the tip ends the episode: the arm stops [N]. Over a servo motion the cabinet watches it
            as well.
        speed: largest of the set-point [m/s]; `arm.speed` scales it.
        latency: added between seeing and commanding [s].
        seconds: an episode ends after so long [s]; None: after twice as long as in training.
        stale: without a newer state for so long the deployment ends, and without a target the arm stops [s].
    """

    _: KW_ONLY
    frame: str = "tip"
    through: str = "servo"
    force: float = 25.0
    peak: float = 60.0
    speed: float = 0.25
    latency: float = 0.0
    seconds: float | None = None
    stale: float = 0.25

    def __post_init__(self) -> None:
        check_name(self.frame, "frame")
        word(self.through, "through", THROUGH)
        within(self.force, "force", 1.0, 100.0, unit="N")
        within(self.peak, "peak", 1.0, 1000.0, unit="N")
        within(self.speed, "speed", 0.0, 1.0, above=True, unit="m/s")
        within(self.latency, "latency", 0.0, 0.5, unit="s")
        if self.seconds is not None:
            within(self.seconds, "seconds", 0.5, _LONGEST, unit="s")
        within(self.stale, "stale", 0.02, 2.0, unit="s")

    def timed(self, task: ContactTask) -> ContactTask:
        """A task whose episodes may take as long as here."""
        steps = _PATIENT * task.steps if self.seconds is None else round(self.seconds * task.rate)
        return replace(task, steps=steps)


def spring_of(task: ContactTask, settings: ContactSettings) -> CartesianImpedance:
    """The impedance in which a task is done, with the largest force of a deployment."""
    stiffness = np.repeat([task.stiffness, task.turn_stiffness], 3)
    return CartesianImpedance(stiffness, damping=_RATIO, max_force={"xyz": settings.force})


#: Poses of the free bodies of a task's scene by their names, in the base: of a camera, or of the virtual cabinet.
Bodies = Callable[[], Mapping[str, Pose]]


@dataclass(frozen=True, slots=True)
class _Episode:
    poses: Array
    joints: Array
    forces: Array
    missing: Array
    late: int
    ended: str


def deploy_contact(
    arm: ArmVerbs,
    policy: Policy[Any],
    origins: Pose | Sequence[Pose],
    targets: npt.ArrayLike | None = None,
    *,
    settings: ContactSettings | None = None,
    bodies: Bodies | None = None,
    gripper: Gripper | None = None,
    progress: Callable[[int, float], object] | None = None,
) -> EpisodeReport:
    """Run a policy of a task with contacts on an arm, one episode for each target.

    An episode begins with the tip above the middle of the task's starts, and ends with it back there. It is over when
    nothing has been missing for half a second. One that meets a force above `ContactSettings.peak` ends there, with
    the arm at rest, and counts as failed.

    Args:
        arm: in control, with what the task needs in its gripper; the start can be reached in a line.
        policy: of a task with contacts, for this robot.
        origins: frame of the task in the base, one for all episodes or one each, such as `PegInHole.presumed`.
        targets: what the episodes are about, as the task draws them, shape (n, k); None: one episode, all numbers 0.
        settings: frame, force and so on.
        bodies: where the free bodies of the scene are; for tasks that look at them.
        gripper: for tasks that use one.
        progress: called after each episode with its number and what is missing [m].

    Returns:
        The report; forces are those of the arm's own estimate. Its facts have the interventions of the guard, and how
        each episode ended: "", or "force".

    Raises:
        CommandRejected: a policy of another task, no such frame, or bodies or a gripper that the task needs and lacks;
            one that diverges, upon which the arm stops and the episode is marked in a recording.
        LimitError: a robot that is not the task's, or a set-point that could be faster than the guard allows.
        Unreachable: a start that no joint positions reach; nothing has moved.
        ShapeError: targets of another shape, or not finite.
        StaleState: no more states arrived; the arm was stopped.
        StreamError: the servo stream ended early.
    """
    chosen = settings or ContactSettings()
    task = deployed_task(instance(policy, Policy, "policy").task, ContactTask, arm.robot)  # type: ignore[type-abstract]
    task = chosen.timed(task)
    check_contact(task, chosen, arm.speed, bodies=bodies, gripper=gripper)
    goals = _goals(task, targets)
    frames = [origins] * len(goals) if isinstance(origins, Pose) else list(origins)
    for frame in frames:
        check_pose(frame, "origins")
    if len(frames) != len(goals):
        raise ShapeError(
            f"origins must be one pose or one for each of {len(goals)} targets, got {len(frames)}",
            parameter="origins",
        )
    arm.subscribe(rate=2.0 * _FINE * task.rate)
    episodes = []
    with ThreadPoolExecutor(1, "heptarm-gripper") as hand:
        run = _Run(arm, policy, task, chosen, bodies, gripper, hand)
        for number, origin in enumerate(frames):
            with inside(f"origins[{number}]"):
                run.check_start(origin)
        for number, (origin, goal) in enumerate(zip(frames, goals, strict=True)):
            with marked(arm, number):
                episodes.append(run.episode(origin, goal))
            if progress is not None:
                progress(number, float(episodes[-1].missing[-1]))
    facts = {
        "engine": "arm",
        "robot": arm.robot.title,
        "virtual": arm.is_virtual,
        "through": chosen.through,
        "latency": chosen.latency,
        "seconds": task.steps / task.rate,
        "late_ticks": sum(episode.late for episode in episodes),
        "guard": {"force": sum(episode.ended == "force" for episode in episodes)},
        "ended": [episode.ended for episode in episodes],
    }
    return EpisodeReport(
        task,
        goals,
        np.array([episode.missing for episode in episodes]),
        np.array([episode.poses[:, :3] for episode in episodes]),
        joints=np.array([episode.joints for episode in episodes]),
        forces=np.array([episode.forces for episode in episodes]),
        facts=facts,
    )


def check_contact(
    task: ContactTask,
    settings: ContactSettings,
    speed: float,
    *,
    bodies: Bodies | None = None,
    gripper: Gripper | None = None,
) -> None:
    """Refuse, before anything moves, what cannot be deployed.

    Args:
        task: of the policy.
        settings: of the deployment.
        speed: ceiling of the arm's speed, see `Arm.speed`.
        bodies: where the free bodies are.
        gripper: of the arm.

    Raises:
        CommandRejected: bodies or a gripper are missing, or the stiffness cannot be chosen through a servo motion.
        LimitError: the set-point could be faster than it is allowed to be.
    """
    if task.has_gripper and gripper is None:
        raise CommandRejected(f"gripper must be given: the task {task.name} uses it", parameter="gripper")
    if task.look_size and bodies is None:
        raise CommandRejected(f"bodies must be given: the task {task.name} looks at them", parameter="bodies")
    if task.has_stiffness and settings.through != "fri":
        raise CommandRejected(
            f'through must be "fri" for the task {task.name}, whose policy chooses the stiffness, got '
            f"{settings.through!r}",
            parameter="through",
            value=settings.through,
            hint="the stiffness of a servo motion does not change while it runs",
        )
    # a servo motion limits the speed along each axis, the law of torques that of all together
    fastest = task.step * task.rate * (np.sqrt(3.0) if settings.through == "fri" else 1.0)
    if fastest > settings.speed * speed:
        raise LimitError(
            f"the set-point's speed must be at least {fastest:.3g} m/s for the task {task.name}, got "
            f"{settings.speed * speed:.3g} m/s: {settings.speed:g} m/s times the arm's speed of {speed:g}",
            parameter="speed",
            value=settings.speed * speed,
            hint=f"an arm's speed of {fastest / settings.speed:.2g} allows it, or train with a smaller step",
        )


def _goals(task: ContactTask, targets: npt.ArrayLike | None) -> Array:
    size = task.targets(np.random.default_rng(0), 1).shape[1]
    goals = np.zeros((1, size)) if targets is None else np.atleast_2d(np.asarray(targets, dtype=np.float64))
    if goals.shape[1:] != (size,) or not len(goals) or not np.isfinite(goals).all():
        raise ShapeError(
            f"targets must have shape (n, {size}) and be finite, got shape {goals.shape}", parameter="targets"
        )
    return goals


class _Run:
    """Episodes of a policy on an arm."""

    def __init__(
        self,
        arm: ArmVerbs,
        policy: Policy[Any],
        task: ContactTask,
        settings: ContactSettings,
        bodies: Bodies | None,
        gripper: Gripper | None,
        hand: ThreadPoolExecutor,
    ) -> None:
        self._arm, self._settings = arm, settings
        self._bodies, self._gripper, self._hand = bodies, gripper, hand
        self._grips: deque[Future[object]] = deque()
        self._task = task
        self._pilot = ContactPilot(policy, steps=task.steps)
        self._spring = spring_of(self._task, settings)
        begins = self._task.starts(np.random.default_rng(0), 100)
        #: The middle of the starts, in the frame of the task.
        self._start = Pose.from_rotvec(begins[:, :3].mean(axis=0), begins[:, 3:].mean(axis=0))
        #: Of the tip in the flange; a frame that is not there is refused here.
        self._tip = arm.pose(settings.frame, reference="flange")

    def check_start(self, origin: Pose) -> None:
        """Refuse an origin whose start cannot be reached.

        Raises:
            Unreachable: no joint positions reach it.
        """
        for height in (0.0, -_CLEAR):
            place = (origin @ self._start).shifted(z=height, frame="tool") @ self._tip.inverse()
            solve(self._arm.robot, place, near=self._arm.state.q)

    def episode(self, origin: Pose, target: Array) -> _Episode:
        """One episode: to its start, the policy, and back."""
        arm, frame = self._arm, self._settings.frame
        start = origin @ self._start
        above = start.shifted(z=-_CLEAR, frame="tool")
        arm.move([lin(place, moving=frame, speed_mps=_APPROACH) for place in (above, start)])
        arm.wait_for_rest()
        tip = _Tip(arm, origin, frame)
        tip.zero(_ZEROING)
        through = self._by_torques if self._settings.through == "fri" else self._by_servo
        found = through(tip, origin, target)
        while self._grips:
            self._grips.popleft().result()
        height = float(found.poses[-1][2]) - float(self._start.xyz[2])
        arm.move(
            lin_rel(z=-max(height, 0.0) - _CLEAR, frame=origin, moving=frame, speed_mps=_RETREAT),
            mode=self._spring,
        )
        if found.ended == "early":
            raise StreamError(
                "the stream of set-points ended before the episode did", hint="look at the cabinet's log"
            )
        return found

    def _by_servo(self, tip: _Tip, origin: Pose, target: Array) -> _Episode:
        """Set-points of the cabinet's impedance over a servo motion."""
        arm, settings = self._arm, self._settings
        with arm.servo(
            "lin",
            rate=self._task.rate * _FINE * arm.real_time_factor,
            watchdog=settings.stale,
            mode=self._spring,
            moving=settings.frame,
            speed_mps=settings.speed,
            until=ForceAbove(settings.peak, frame=settings.frame),
        ) as servo:
            found = self._decide(servo, tip, origin, target)
        has_met = servo.result is not None and servo.result.cause is Cause.CONDITION
        if not has_met or found.ended == "force":
            return found
        missing, forces = found.missing.copy(), found.forces.copy()
        missing[-1] = self._failed(missing[-1])
        forces[-1] = max(forces[-1], settings.peak)  # the cabinet felt it
        return replace(found, ended="force", missing=missing, forces=forces)

    def _failed(self, missing: float) -> float:
        """What is missing of an episode that has failed, however near it is to its end."""
        return max(missing, 0.0) + 2.0 * self._task.radius

    def _by_torques(self, tip: _Tip, origin: Pose, target: Array) -> _Episode:
        """Set-points of an impedance of torques over FRI."""
        law = cartesian_impedance(
            frame=self._tip,
            stiffness=self._spring.stiffness,
            damping=_RATIO,
            force_max=self._settings.force,
            speed=self._settings.speed * self._arm.speed,
        )
        with self._arm.fri("torque", period_ms=_PERIOD, law=law) as session:
            drive = _ByTorques(session, self._arm.state, self._spring.stiffness)
            return self._decide(drive, tip, origin, target)

    def _decide(self, drive: _Drive, tip: _Tip, origin: Pose, target: Array) -> _Episode:
        """Let the policy decide until the episode, or the stream of set-points, ends."""
        task, settings, pilot = self._task, self._settings, self._pilot
        state = drive.start
        pose = tip.pose(state)
        pilot.begin(pose, target, self._seen(origin), q=state.q)
        delay = round(settings.latency * task.rate * _FINE)
        waiting = deque([pilot.now.command] * (delay + 1), maxlen=delay + 1)
        poses, joints, late = [pose], [state.q], 0
        forces: list[float] = []
        missing: list[float] = []
        ended, abrupt = "", 0.0
        while not pilot.is_over:
            last, command = pilot.decide()
            wrenches = []
            for part in range(1, _FINE + 1):
                waiting.append(last + (command - last) * part / _FINE)
                due = waiting[0]
                drive.set(origin @ Pose.from_rotvec(due[:3], due[3:6]))
                if isinstance(drive, _ByTorques) and task.has_stiffness:
                    drive.soften(float(task.fraction(due)))
                time = (len(missing) * _FINE + part) / (task.rate * _FINE)
                reached = tip.wait(drive, time, settings.stale)
                if reached is None:
                    ended = "early"
                    break
                state, is_late = reached
                late += is_late
                wrenches.append(tip.wrench(state))
                force = float(np.linalg.norm(wrenches[-1][:3]))
                if force > settings.peak:
                    ended, abrupt = "force", force
                    break
            if ended:
                break
            self._grip(last, command)
            pose, wrench = tip.pose(state), np.mean(wrenches, axis=0)
            pilot.measure(pose, wrench, self._seen(origin), q=state.q)
            poses.append(pose)
            joints.append(state.q)
            forces.append(float(np.linalg.norm(wrench[:3])))
            missing.append(pilot.missing)
        left = task.steps - len(missing)
        last_missing = self._failed(pilot.missing) if ended else pilot.missing
        return _Episode(
            np.array(poses + [poses[-1]] * left),
            np.array(joints + [joints[-1]] * left),
            np.array([*forces, abrupt, *[0.0] * left][: task.steps]),
            np.array(missing + [last_missing] * left),
            late,
            ended,
        )

    def _seen(self, origin: Pose) -> dict[str, Array]:
        """Where the free bodies are in the frame of the task."""
        seen = {} if self._bodies is None else self._bodies()
        return {name: _numbers(origin.inverse() @ place) for name, place in seen.items()}

    def _grip(self, last: Array, command: Array) -> None:
        """Close or open the gripper where the policy has changed its mind; set-points go on meanwhile.

        Raises:
            HeptarmError: an earlier grip has failed.
        """
        while self._grips and self._grips[0].done():
            self._grips.popleft().result()
        if self._gripper is not None and self._task.has_gripper and last[6] != command[6]:
            act = self._gripper.close if command[6] > 0.0 else self._gripper.open
            self._grips.append(self._hand.submit(act))


class _Drive(Protocol):
    """What takes set-points of the tip in the base."""

    @property
    def start(self) -> State:
        """The robot's state when it began."""

    @property
    def active(self) -> bool:
        """Whether the arm follows set-points."""

    def set(self, pose: Pose, /) -> object:
        """The next one."""


class _ByTorques:
    """Set-points of the law of an FRI session."""

    def __init__(self, session: Fri, start: State, stiffness: Array) -> None:
        self._session, self.start, self._stiffness = session, start, stiffness

    @property
    def active(self) -> bool:
        """Whether the law runs."""
        return self._session.active

    def set(self, pose: Pose) -> None:
        """Have the law follow a set-point."""
        self._session.params.goal = pose

    def soften(self, fraction: float) -> None:
        """Choose a fraction of the stiffness."""
        self._session.params.stiffness = fraction * self._stiffness


class _Tip:
    """Pose of the tip and wrench on it in the frame of the task, by the robot's clock."""

    def __init__(self, arm: ArmVerbs, origin: Pose, frame: str) -> None:
        self._arm, self._frame = arm, frame
        self._to_task, self._axes = origin.inverse(), origin.rotation
        self._zero = np.zeros(6)

    def zero(self, seconds: float) -> None:
        """Zero the wrench by its mean over a time, the arm at rest."""
        seen: dict[int, Array] = {}

        def is_enough(state: State) -> bool:
            seen[state.stamp] = self.wrench(state)
            return state.stamp - min(seen) >= seconds * 1e9

        self._arm.wait_until(is_enough, timeout=_PATIENCE)
        self._zero = np.mean(list(seen.values()), axis=0)

    def wait(self, drive: _Drive, time: float, limit: float) -> tuple[State, bool] | None:
        """The first state from a time since the start on [s], and whether it is late; None: the motion has ended.

        Args:
            drive: what the arm follows.
            time: since its start [s].
            limit: without a newer state for so long none is waited for [s].

        Raises:
            StaleState: no states arrive.
        """
        due = drive.start.stamp + round(time * 1e9)
        try:
            state = self._arm.wait_until(lambda seen: seen.stamp >= due or not drive.active, timeout=limit)
        except Timeout:
            raise StaleState(
                f"no newer state within {limit:.2f} s",
                allowed=f"[0, {limit:g}] s",
                hint="check the connection and the load of this machine",
            ) from None
        return (state, state.stamp - due > _LATE) if drive.active else None

    def pose(self, state: State) -> Array:
        """Shape (6,) [m, rad]."""
        return _numbers(self._to_task @ self._arm.pose(self._frame, state=state))

    def wrench(self, state: State) -> Array:
        """Shape (6,) [N, Nm]."""
        load = self._arm.wrench(self._frame, state=state)
        result: Array = np.concatenate([load.force @ self._axes, load.torque @ self._axes]) - self._zero
        return result


def _numbers(pose: Pose) -> Array:
    return np.concatenate([pose.xyz, pose.rotvec])
