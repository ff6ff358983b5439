"""A body comes into the way of an arm that follows a path: how near it comes, how soon it brakes, when it goes on.

The times between a change and the first set-point that is not that of the old path are those of the robot's clock.
"""

from __future__ import annotations

from collections.abc import Iterator
from statistics import median

import numpy as np

import heptarm as ha
from bench.measure.figure import Figure, benchmark
from heptarm import model, shapes
from heptarm.values.checks import Array

CASES = 50
#: So far apart that a ball between them leaves both free: otherwise there is no way around it.
LEFT, RIGHT = ha.deg(-80, 50, 0, -80, 0, 50, 0), ha.deg(80, 50, 0, -80, 0, 50, 0)
#: Fraction of each joint's speed: the ball appears farther away than the arm needs to brake.
SPEED = 0.5
#: Longest time in one case [s].
LONGEST = 60.0
#: A set-point so far from the plan is none of it [rad].
_BESIDE = 3e-4


class _Ball:
    """Appears when so much of a path is completed."""

    def __init__(self, arm: ha.Arm, world: ha.CollisionModel, at: ha.Pose, progress: float) -> None:
        self._arm, self._world, self._at, self._progress = arm, world, at, progress
        self._is_there, self.number = False, 0

    def __call__(self, progress: float) -> None:
        if not self._is_there and progress > self._progress:
            self._is_there, self.number = True, self._arm.connection.feed.count
            self._world.add("ball", shapes.sphere(0.06), at=self._at)


@benchmark("follow")
def follow() -> Iterator[Figure]:
    """50 balls that appear on the path of an arm at half its speed, around a wall."""
    random = np.random.default_rng(39)
    closest = np.inf
    detours: list[ha.Detour] = []
    changed: list[float] = []
    lost: list[str] = []
    with ha.connect("sim://iiwa14", watchdog=5.0, timeout=30.0, state_rate=250.0) as arm:
        world = ha.CollisionModel(arm.robot.name)
        world.add("wall", shapes.box(0.5, 0.02, 0.6), at=ha.Pose.at(0.6, 0.0, 0.3))
        for here, there in [(LEFT, RIGHT), (RIGHT, LEFT)] * (CASES // 2):
            arm.move(ha.ptp(here))  # it is there already, unless it found no way before
            path = arm.find_path(there, avoid=world, timeout=LONGEST)
            on_path = path.curve[int(random.uniform(0.4, 0.7) * len(path.curve))]
            at = model.forward(arm.robot, on_path)[:3, 3] + random.uniform(-0.03, 0.03, 3)
            ball = _Ball(arm, world, ha.Pose.of(at), random.uniform(0.05, 0.2))
            first = arm.connection.feed.count
            try:
                detours += arm.follow(path, speed=SPEED, on_progress=ball).detours
            except ha.NoPath as error:
                lost.append(str(error))
            arm.wait_for_rest()
            kept = [one for one in arm.connection.feed.kept() if one.number > first]
            states = [arm.connection.build(one) for one in kept]
            q = np.array([one.q_cmd for one in states])
            ahead = arm.plan(path, start=path.start, speed=SPEED, step=0.004)
            seconds = _change(
                ahead, np.array([one.stamp * 1e-9 for one in states]), q, kept[0].number, ball.number
            )
            if seconds is not None:
                changed.append(seconds)
            closest = min(closest, float(world.distances(q, below=0.1).min()))
            world.remove("ball")
    detail = {"cases": CASES, "detours": len(detours), "speed": SPEED, "margin_mm": world.margin * 1e3}
    least = world.margin * 1e3 - 1.0  # a spline is followed within 1 mm of what was checked
    yield Figure("follow_closest", closest * 1e3, "mm", limit=least, at_least=True, detail=detail)
    arrived = CASES - len(lost)
    yield Figure("follow_arrived", arrived, "count", limit=CASES, at_least=True, detail={"lost": lost})
    yield Figure(
        "follow_set_points", float(np.max(changed)) * 1e3, "ms", limit=100.0,
        detail={"median_ms": round(float(np.median(changed)) * 1e3, 1), "cases": len(changed)},
    )  # fmt: skip
    yield Figure("follow_braked", median(one.reaction for one in detours) * 1e3, "ms", limit=100.0)
    braking = median(one.braking for one in detours)
    yield Figure("follow_went_on", median(one.seconds for one in detours), "s", detail={"braking_s": braking})


def _change(ahead: ha.ProgramPreview, t: Array, q: Array, first: int, number: int) -> float | None:
    """Time from a change to the first set-point beside the plan, None: it is all of the plan [s].

    Args:
        ahead: the plan.
        t: times of the states [s], shape (n,).
        q: set-points of the states, shape (n, 7) [rad].
        first: number of the first state.
        number: of the newest state when the world changed.
    """
    moves = np.flatnonzero(np.abs(q - q[0]).max(axis=1) > 1e-4)
    if not len(moves):
        return None
    last = max(moves[0] + 1, min(number - first, len(q) - 1))
    before = slice(moves[0], last + 1)  # when the arm is still on its plan

    def off(begin: float, part: slice) -> Array:
        planned = np.array([np.interp(t[part] - begin, ahead.t, column) for column in ahead.q.T]).T
        return np.asarray(np.abs(q[part] - planned).max(axis=1))

    starts = t[moves[0]] + np.linspace(-0.05, 0.02, 141)
    begin = min(starts.tolist(), key=lambda one: float(off(one, before).max()))
    beside = np.flatnonzero(off(begin, slice(last, len(q))) > _BESIDE)
    return float(t[last + beside[0]] - t[last]) if len(beside) else None
