"""Deployment of a policy on a virtual or real arm, with the observations and integration of actions of training.

The loop runs at the task's rate over a servo motion. Nothing here needs torch or MuJoCo.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import KW_ONLY, dataclass
from math import ceil
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from heptarm.errors import HeptarmError, StaleState, StreamError, inside
from heptarm.record.journal import NOTE
from heptarm.rl.pilot import Decides, Pilot, PolicyGuard
from heptarm.rl.report import EpisodeReport
from heptarm.rl.task import ReachTask
from heptarm.rl.tasks import deployed_task
from heptarm.values.checks import Array, array, instance, within
from heptarm.values.mode.mode import Mode, check_mode
from heptarm.values.motion.ptp import ptp

if TYPE_CHECKING:
    from heptarm.arm.arm import Arm
    from heptarm.arm.motion.servo import JointServo
    from heptarm.arm.verbs import ArmVerbs
    from heptarm.values.state import State

#: Target in the base frame, shape (3,) [m], at a time since the start of the episode [s].
Target = Callable[[float], Array]
#: Ticks of the servo loop a decision where commands are delayed, so that a delay is met within a few milliseconds.
_FINE = 4
#: States per decision, so that a decision uses fresh measurements.
_STATES = 8.0


@dataclass(frozen=True, slots=True)
class DeploySettings:
    """Settings of a deployment.

    Attributes:
        guard: limits.
        mode: control mode of the servo motion; None: position.
        speed: ceiling of the servo motion, a fraction of each axis' maximum.
        acceleration: likewise.
        latency: added between seeing and commanding [s].
        homing: speed of the motion to where an episode begins.
    """

    _: KW_ONLY
    guard: PolicyGuard = PolicyGuard()  # noqa: RUF009  frozen
    mode: Mode | None = None
    speed: float = 0.5
    acceleration: float = 1.0
    latency: float = 0.0
    homing: float = 0.3

    def __post_init__(self) -> None:
        instance(self.guard, PolicyGuard, "guard")
        check_mode(self.mode)
        for name in ("speed", "acceleration", "homing"):
            within(getattr(self, name), name, 0.0, 1.0, above=True)
        within(self.latency, "latency", 0.0, 0.5, unit="s")


@dataclass(frozen=True, slots=True)
class _Episode:
    joints: Array
    targets: Array


def deploy(
    arm: Arm,
    policy: Decides,
    targets: npt.ArrayLike | Sequence[Target],
    *,
    settings: DeploySettings | None = None,
    starts: npt.ArrayLike | None = None,
    progress: Callable[[int, float], object] | None = None,
) -> EpisodeReport:
    """Run a policy on an arm, one episode per target, each from home.

    Args:
        arm: in control.
        policy: of a joint or Cartesian task for this robot.
        targets: points, base frame, shape (n, 3) [m], or functions of time that say where the target is.
        settings: guard, control mode and so on.
        starts: joint positions at the beginning, shape (n, 7) [rad]; None: the task's home.
        progress: called after each episode with its number and its final distance [m].

    Returns:
        The report; its facts contain the interventions of the guard and the statistics of the streams.

    Raises:
        CommandRejected: a policy of another task, or one that diverges: the arm stops.
        LimitError: a target outside the guard's box, or a robot that is not the task's.
        StaleState: no more states arrived; the arm was stopped.
        StreamError: the servo stream ended early.
    """
    settings = settings or DeploySettings()
    task = deployed_task(policy.task, ReachTask, arm.robot)
    goals = [_target(target, settings.guard) for target in _listed(targets)]
    begins = (
        [np.asarray(task.home)] * len(goals) if starts is None else list(np.atleast_2d(np.asarray(starts)))
    )
    pilot = Pilot(policy, settings.guard)
    episodes = []
    late = 0
    arm.subscribe(rate=min(_STATES * task.rate, 500.0), groups=("joints", "motion", "safety"))
    for number, (goal, begin) in enumerate(zip(goals, begins, strict=True)):
        with marked(arm, number):
            arm.move(ptp(begin), speed=settings.homing)
            episode, ticks = _run(arm, pilot, goal, settings)
        episodes.append(episode)
        late += ticks
        if progress is not None:
            progress(number, _distances(task, episode)[-1])
    joints = np.array([episode.joints for episode in episodes])
    facts = {
        "engine": "arm",
        "robot": arm.robot.title,
        "virtual": arm.is_virtual,
        "mode": "position" if settings.mode is None else repr(settings.mode),
        "latency": settings.latency,
        "guard": dict(pilot.watch.counts),
        "late_ticks": late,
    }
    return EpisodeReport(
        task,
        np.array([episode.targets[-1] for episode in episodes]),
        np.array([_distances(task, episode) for episode in episodes]),
        task.tip(joints),
        joints=joints,
        facts=facts,
    )


def _run(arm: Arm, pilot: Pilot, goal: Target, settings: DeploySettings) -> tuple[_Episode, int]:
    """Run one episode; return its record and the number of late ticks."""
    task = pilot.task
    fine = _FINE if settings.latency > 0 else 1
    delay = ceil(settings.latency * task.rate * fine - 1e-9)
    # use the arm's time: a simulator may run faster than real time
    rate = task.rate * fine * arm.real_time_factor
    waiting: deque[tuple[int, Array]] = deque()
    joints, targets = np.empty((task.steps + 1, 7)), np.empty((task.steps, 3))
    with arm.servo(
        "joint",
        rate=rate,
        mode=settings.mode,
        speed=settings.speed,
        acceleration=settings.acceleration,
    ) as sv:
        state = sv.start
        pilot.begin(state.q)
        joints[0] = state.q
        for tick in range(task.steps * fine):
            step, is_decision = divmod(tick, fine)[0], tick % fine == 0
            if is_decision:
                targets[step] = goal(step / task.rate)
                waiting.append((tick + delay, pilot.decide(state.q, state.dq, targets[step])))
            _send(sv, waiting, tick)
            if sv.tick() is None:
                break
            if (tick + 1) % fine == 0:
                state = fresh(arm, settings.guard.stale)
                joints[step + 1] = state.q
        else:
            return _Episode(joints, targets), sv.stats.late_ticks
    raise StreamError("the servo stream ended before the episode did", hint="look at the cabinet's log")


def _send(sv: JointServo, waiting: deque[tuple[int, Array]], tick: int) -> None:
    """Send the due command, or repeat the last one for the watchdog."""
    while len(waiting) > 1 and waiting[1][0] <= tick:
        waiting.popleft()
    sv.set(waiting[0][1] if waiting[0][0] <= tick else sv.start.q)


@contextmanager
def marked(arm: ArmVerbs, number: int) -> Iterator[None]:
    """Name an episode in the errors that end it, and mark it in a recording.

    Args:
        arm: that is recorded.
        number: of the episode, from 0 on.
    """
    try:
        with inside(f"episodes[{number}]"):
            yield
    except HeptarmError as error:
        arm.connection.journal.add(NOTE, f"failed: {error.text}")
        raise


def fresh(arm: ArmVerbs, limit: float) -> State:
    """The newest state of an arm.

    Raises:
        StaleState: it is older than the limit [s].
    """
    state = arm.state
    if not state.age <= limit:
        raise StaleState(
            f"the newest state is {state.age:.2f} s old; the guard allows {limit:g} s",
            value=state.age,
            allowed=f"[0, {limit:g}] s",
            hint="check the connection and the load of this machine",
        )
    return state


def _distances(task: ReachTask, episode: _Episode) -> Array:
    return task.distance(task.tip(episode.joints[1:]), episode.targets)


def _listed(targets: npt.ArrayLike | Sequence[Target]) -> list[npt.ArrayLike | Target]:
    if isinstance(targets, Sequence) and targets and callable(targets[0]):
        return list(targets)
    return list(np.atleast_2d(np.asarray(targets, dtype=np.float64)))


def _target(target: npt.ArrayLike | Target, guard: PolicyGuard) -> Target:
    """A target as a function of time, checked at its start; the guard checks a moving one during the episode."""
    if callable(target):
        moving: Target = target
        point = array(moving(0.0), 3, "target")
    else:
        point = array(target, 3, "target")
        moving = lambda _: point  # noqa: E731
    guard.check(point)
    return moving


def circle(centre: npt.ArrayLike, radius: float, *, period: float) -> Target:
    """A target that moves on a circle in front of the arm.

    Args:
        centre: base frame, shape (3,) [m].
        radius: [m].
        period: of a round [s].

    Raises:
        LimitError: a number outside its range.
    """
    middle = array(centre, 3, "centre")
    within(radius, "radius", 0.0, 2.0, unit="m")
    within(period, "period", 0.0, 1e6, above=True, unit="s")

    def where(time: float) -> Array:
        angle = 2 * np.pi * time / period
        return middle + radius * np.array([0.0, np.sin(angle), np.cos(angle)])

    return where
