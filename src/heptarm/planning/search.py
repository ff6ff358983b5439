"""Searches a path around bodies: from joint positions to a goal, within a margin and under a constraint.

Two trees of joint positions grow towards each other (RRT-Connect, Kuffner and LaValle 2000), under a constraint by
steps that are projected onto it (CBiRRT, Berenson et al. 2009). Where bodies are in the way, only near targets count
(dynamic domain, Yershova et al. 2005); where few places are near, they are drawn around the trees. What they find is
shortened, laid on a joint spline that is checked again, and timed by the planner of the controller.
"""

from __future__ import annotations

import ctypes
import functools
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import inf, sqrt
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from heptarm._library import library
from heptarm.errors import NoPath, ShapeError, require
from heptarm.model.batch import solve_batch
from heptarm.planning.constraints import Constraints, constraints_of
from heptarm.values.checks import Array, array, frozen, instance, integer, shown, within
from heptarm.values.clearance import Clearance, CollisionWorld
from heptarm.values.motion.dynamics import Dynamics
from heptarm.values.motion.planned_path import Path, PathConstraint, Region, SearchStats
from heptarm.values.motion.ptp import Ptp
from heptarm.values.pose import Pose, check_pose
from heptarm.values.robot import Body, RobotModel

if TYPE_CHECKING:
    from heptarm.planning.spline_speed import SpeedLimits

#: Defaults of a search: longest time [s], and most joint positions that it reaches.
TIMEOUT, STATES = 5.0, 20_000
_ORIGIN = Pose.of((0.0, 0.0, 0.0))
#: Bodies at the start may overlap by so much: the arm then leaves them first [m].
_SLIGHT = 0.005
#: Longest step of a tree [rad], of all joints together; under constraints they are shorter.
_STEP = 1.2
#: Steps that joint positions reach at which bodies are in the way; targets that are drawn at a time.
_REACH, _DRAWN = 1.7, 8
#: Angles of A3 at which a pose is solved, in each Status; poses that stand for a region.
_ELBOWS, _POSES = 36, 24
#: Most joint positions that stand for the goals.
_MOST_GOALS = 24
#: A spline keeps so far from the joint limits, where it can [rad].
_INSIDE = 0.02
#: Shortcuts that are tried.
_SHORTCUTS = 40
#: Times that points are added until the spline is as free as the straight lines.
_REFINEMENTS = 12
#: Samples of the spline between two of its points.
_SAMPLES = 16
#: Name of a search that needed no trees.
_STRAIGHT = "straight"
#: Clearances up to this are reported [m].
_REPORTED = 0.2

Goal = npt.ArrayLike | Pose | Region | Sequence["npt.ArrayLike | Pose | Region"]
#: What holds along the whole path: one constraint, or several at once.
Keep = PathConstraint | Sequence[PathConstraint]


def find_path(
    world: CollisionWorld,
    *,
    start: npt.ArrayLike,
    goal: Goal,
    tcp: Pose = _ORIGIN,
    keep: Keep | None = None,
    speed: float = 1.0,
    tcp_speed: float | None = None,
    load: Body | None = None,
    timeout: float = TIMEOUT,
    states: int = STATES,
    improve: int = 0,
    seed: int = 0,
    known: Path | None = None,
    stop: Callable[[], bool] | None = None,
    progress: Callable[[int, float], object] | None = None,
) -> Path:
    """Find a path around the bodies of a world; no arm is needed, and nothing moves.

    The same seed finds the same path in the same world, however fast the machine is, unless the time runs out.

    Args:
        world: the bodies, such as a `heptarm.CollisionModel`; its margin is kept.
        start: joint positions, shape (7,) [rad]. Bodies may touch there slightly; the arm then leaves them.
        goal: joint positions; a pose of the tool frame, with any elbow; a `Region`; or several of these, of which the
            path reaches one.
        tcp: pose of the tool frame in the flange frame.
        keep: constraint along the whole path, or several of them: `Upright`, `OnPlane`, `OnLine`, a `Workspace` in the
            base; None: none.
        speed: fraction of each joint's maximum for which the path is timed, (0, 1].
        tcp_speed: the origin of the tool frame is not to be faster on the path [m/s], up to 10; None: any speed.
        load: on the flange: the path is as slow as the torques of the joints need it to be with it. None: they are not
            looked at.
        timeout: longest time [s], up to 3600.
        states: most joint positions that it reaches, 10 to 1,000,000.
        improve: joint positions that it reaches after that in search of shorter paths, 0 to 1,000,000: of all that it
            finds before `timeout`, the fastest one is the result.
        seed: of its random numbers, 0 to 2^32 - 1.
        known: a path to the same goal that begins nearby. Where the lines to it and along its points are free, it is
            made shorter from this start on, and nothing is searched. None: there is none.
        stop: called again and again; the search ends when it returns true.
        progress: called again and again with the joint positions reached so far, and how near start and goal came
            [rad].

    Raises:
        NoPath: none was found; `reason`, and the text, have the bodies in the way or how near it came.
        ShapeError: a wrong type or shape.
        LimitError: a value outside its range.
        MissingExtra: the planner is not installed.
    """
    if not isinstance(world, CollisionWorld):
        raise ShapeError(
            f"world must be a model of bodies, got {shown(world)}",
            parameter="world",
            value=world,
            hint='for example heptarm.CollisionModel("iiwa14", scene="table")',
        )
    begin = array(start, 7, "start")
    world.robot.check(begin, "start")
    check_pose(tcp, "tcp")
    fraction = within(speed, "speed", 0.0, 1.0, above=True)
    fastest = inf if tcp_speed is None else within(tcp_speed, "tcp_speed", 0.0, 10.0, above=True, unit="m/s")
    if load is not None:
        instance(load, Body, "load")
    limits = _Budget(
        within(timeout, "timeout", 0.0, 3600.0, above=True, unit="s"),
        integer(states, "states", 10, 10**6),
        stop,
        progress,
    )
    more = integer(improve, "improve", 0, 10**6)
    random = np.random.default_rng(integer(seed, "seed", 0, 2**32 - 1))
    require("ruckig", extra="sim")
    from heptarm.planning.spline_speed import SpeedLimits

    speeds = SpeedLimits(fraction, fastest, tcp, load)
    checks = world.checks
    search = _Search(world, begin, tcp, constraints_of(keep), limits, random)
    search.check_start()
    goals = search.goals(goal)
    joined = None if known is None else search.joined(known, _each(goal))
    points, planner = search.connected(goals) if joined is None else joined
    spline = search.smoothed(search.shortened(points), speeds)
    if planner != _STRAIGHT and more:
        limits.states = limits.reached + more
        spline = search.improved(goals, spline, speeds)
    stats = SearchStats(planner, seed, limits.reached, world.checks - checks, limits.elapsed)
    return Path(
        tuple(Ptp(frozen(point)) for point in spline.points[1:]),
        dynamics=spline.dynamics,
        start=frozen(begin),
        curve=frozen(spline.curve),
        duration=spline.duration,
        clearance=search.nearest_on(spline.curve),
        stats=stats,
        goal=tuple(_each(goal)),
        tcp_speed=None if tcp_speed is None else fastest,
        keep=search.kept,
        world=world,
    )


@functools.cache
def _functions() -> ctypes.CDLL:
    """The functions of native/nearest.c.

    Raises:
        Unavailable: the compiled part of heptarm is missing.
    """
    made, (word, pointer) = library(holds_gil=True), (ctypes.c_int64, ctypes.c_void_p)
    made.hn_nearest.restype = made.hn_within.restype = word
    made.hn_nearest.argtypes = (word, pointer, pointer)
    made.hn_within.argtypes = (word, pointer, pointer, word, pointer)
    return made


class _Budget:
    """What a search may take, and has taken.

    Attributes:
        states: most joint positions that may be reached.
        reached: joint positions so far.
    """

    def __init__(
        self,
        timeout: float,
        states: int,
        stop: Callable[[], bool] | None,
        progress: Callable[[int, float], object] | None,
    ) -> None:
        self._begin, self._timeout, self.states = time.monotonic(), timeout, states
        self._stop, self._progress = stop, progress
        self.reached, self._is_stopped = 0, False

    @property
    def elapsed(self) -> float:
        """Time since the search began [s]."""
        return time.monotonic() - self._begin

    @property
    def is_over(self) -> bool:
        """Whether it is used up, or the search was stopped."""
        return self.is_late or self._is_stopped or self.reached >= self.states

    @property
    def is_late(self) -> bool:
        """Whether its time has run out."""
        return self.elapsed > self._timeout

    def check(self, nearest: float) -> None:
        """End a search that has taken too much.

        Raises:
            NoPath: it has.
        """
        if self._progress is not None:
            self._progress(self.reached, nearest)
        self._is_stopped = self._is_stopped or (self._stop is not None and self._stop())
        if not self.is_over:
            return
        is_late, is_stopped = self.is_late, self._is_stopped
        why = "stopped" if is_stopped else f"not found in {self._timeout:g} s" if is_late else "not connected"
        near = "" if nearest == inf else f", nearest {nearest:.2f} rad"
        raise NoPath(
            f"start and goal: {why}: {self.reached:,} states{near}",
            reason="time" if is_late or is_stopped else "not connected",
            states=self.reached,
            nearest=nearest,
            parameter="goal",
            hint="give more time or states, another goal, or a smaller margin of the world; perhaps there is no way",
        )


class _Tree:
    """Joint positions that are connected with a root.

    Args:
        roots: shape (n, 7) [rad].
    """

    def __init__(self, roots: Array) -> None:
        self._parents: list[int] = []
        self._asked, self._drawn = np.empty(7), np.empty((_DRAWN, 7))
        self._given = self._asked.ctypes.data, self._drawn.ctypes.data
        self._keep(np.empty((max(256, 2 * len(roots)), 7)), np.full(max(256, 2 * len(roots)), inf))
        for root in roots:
            self.add(root, -1)

    def add(self, q: Array, parent: int) -> int:
        """Add joint positions; returns their index."""
        index = len(self._parents)
        if index == len(self._q):
            more = np.empty_like(self._q), np.full_like(self._reach, inf)
            self._keep(np.concatenate([self._q, more[0]]), np.concatenate([self._reach, more[1]]))
        self._q[index] = q
        self._parents.append(parent)
        return index

    def _keep(self, q: Array, reach: Array) -> None:
        self._q, self._reach = q, reach
        self._addresses = q.ctypes.data, reach.ctypes.data

    def nearest(self, q: Array) -> int:
        """Index of the nearest joint positions."""
        self._asked[:] = q
        found: int = _functions().hn_nearest(len(self._parents), self._addresses[0], self._given[0])
        return found

    def target(self, random: np.random.Generator, low: Array, high: Array, *, near: float) -> Array:
        """Random joint positions between limits, within the reach of the nearest ones of the tree.

        Where few are, they are in a ball around random ones of the tree, of the radius of their reach, at most `near`
        [rad].
        """
        count = len(self._parents)
        self._drawn[:] = low + (high - low) * random.random((_DRAWN, 7))
        first: int = _functions().hn_within(count, *self._addresses, _DRAWN, self._given[1])
        if first >= 0:
            chosen: Array = self._drawn[first].copy()
            return chosen
        middle = random.integers(count)
        found: Array = self._q[middle] + min(self._reach[middle], near) * _in_ball(random)
        return np.clip(found, low, high)

    def limit(self, target: Array, reach: float) -> None:
        """Let the nearest joint positions reach only so far [rad], since bodies were in the way to a target."""
        self._reach[self.nearest(target)] = reach

    def at(self, index: int) -> Array:
        """Joint positions, shape (7,) [rad]."""
        found: Array = self._q[index].copy()
        return found

    def back(self, index: int) -> list[Array]:
        """Joint positions from there to the root."""
        found = []
        while index >= 0:
            found.append(self.at(index))
            index = self._parents[index]
        return found


@dataclass(frozen=True, slots=True)
class _Spline:
    """A joint spline.

    Attributes:
        points: that it passes through, its start among them, shape (n, 7) [rad].
        curve: joint positions along it, shape (m, 7) [rad].
        duration: [s].
        dynamics: with which it takes so long.
    """

    points: Array
    curve: Array
    duration: float
    dynamics: Dynamics


class _Search:
    """One search; its parts in the order in which they are called."""

    def __init__(
        self,
        world: CollisionWorld,
        start: Array,
        tcp: Pose,
        keep: Sequence[PathConstraint],
        budget: _Budget,
        random: np.random.Generator,
    ) -> None:
        self._world, self._robot, self._start = world, world.robot, start
        self._tcp, self._budget, self._random = tcp, budget, random
        self._keep = Constraints(keep, world.robot, tcp, start) if keep else None
        self._step = _STEP if self._keep is None else self._keep.step

    @property
    def kept(self) -> tuple[PathConstraint, ...]:
        """The constraints, as they hold from this start on."""
        return () if self._keep is None else self._keep.keep

    # -------------------------------------------------------------------------- start and goals

    def check_start(self) -> None:
        """Refuse a start at which bodies overlap by more than a little."""
        deep = [touch for touch in self._world.touching(self._start) if touch.distance < -_SLIGHT]
        if deep:
            raise NoPath(
                f"start is in collision: {deep[0]}; it may overlap by {_SLIGHT * 1e3:g} mm",
                reason="start",
                clearance=deep[0],
                parameter="start",
                value=round(deep[0].distance, 4),
                hint="jog the arm away, or correct the model of the world",
            )

    def goals(self, goal: Goal) -> Array:
        """Joint positions that reach the goal, the nearest first, shape (n, 7) [rad].

        Raises:
            NoPath: bodies are in the way at all of them, or the goal cannot be reached.
        """
        rows = np.concatenate([self._solutions(single) for single in _each(goal)])
        if not len(rows):
            raise NoPath(
                "goal has no inverse kinematics: it is out of reach, or every arm position that reaches it violates a "
                "joint limit",
                reason="inverse kinematics",
                parameter="goal",
                hint="bring it nearer, change its orientation, or give a Region",
            )
        if self._keep is not None:
            deviations = self._keep.deviations(rows)
            least = float(deviations.min())
            if least > self._keep.most:
                raise NoPath(
                    f"goal contradicts keep: {self._keep.described(rows[deviations.argmin()])}",
                    reason="constraint",
                    parameter="goal",
                    hint="give a goal that obeys it, or allow more",
                )
            self._keep.allow(least)
            rows = rows[[self._keep.is_kept(row) for row in rows]]
        order = np.abs((rows - self._start) / self._robot.dq_max).max(axis=1).argsort(kind="stable")
        free: list[Array] = []
        blocked: list[Array] = []
        for row in rows[order]:
            is_free = self._world.distances(row[None], below=self._world.margin)[0] >= self._world.margin
            (free if is_free else blocked).append(row)
            if len(free) == _MOST_GOALS:
                break
        if free:
            return np.array(free)
        best = min((self._world.touching(row) for row in blocked), key=lambda found: -found[0].distance)[0]
        raise NoPath(
            f"goal is in collision: {best}",
            reason="goal",
            clearance=best,
            parameter="goal",
            value=round(best.distance, 4),
            hint=f"choose a goal with at least {self._world.margin * 1e3:g} mm of clearance",
        )

    def _solutions(self, goal: Array | Pose | Region) -> Array:
        """Joint positions of one goal, shape (n, 7) [rad]."""
        if isinstance(goal, np.ndarray):
            self._robot.check(goal, "goal")
            return goal[None]
        back = self._tcp.inverse()
        poses = [goal] if isinstance(goal, Pose) else _sampled(goal, self._random)
        # a region has many poses, of which each needs fewer elbows
        elbows = _ELBOWS if isinstance(goal, Pose) else _ELBOWS // 6
        angles = np.linspace(self._robot.q_min[2], self._robot.q_max[2], elbows + 2)[1:-1]
        e1, status = (
            np.append(np.repeat(angles, 8), np.full(8, self._start[2])),
            np.tile(np.arange(8), elbows + 1),
        )
        matrices = np.array([(pose @ back).matrix for pose in poses])
        sampled = solve_batch(
            self._robot,
            np.repeat(matrices, len(e1), axis=0),
            e1=np.tile(e1, len(poses)),
            status=np.tile(status, len(poses)),
        )
        # and the nearest posture, so that joints stay that need not move, as in a PTP
        solved: Array = np.concatenate([sampled, solve_batch(self._robot, matrices, near=self._start)])
        found = solved[np.isfinite(solved).all(axis=1)]
        return found[((found >= self._robot.q_min) & (found <= self._robot.q_max)).all(axis=1)]

    # ------------------------------------------------------------------------------------ search

    def joined(self, known: Path, goal: Sequence[Array | Pose | Region]) -> tuple[list[Array], str] | None:
        """As `connected`, through the points of a path that was found before; None: a line between them is not free.

        Raises:
            ShapeError: it is no path to this goal.
        """
        instance(known, Path, "known")
        if len(known.goal) != len(goal) or not all(map(_is_same, known.goal, goal)):
            raise ShapeError(
                "known must be a path to the same goal, got one to another goal",
                parameter="known",
                hint="leave it out",
            )
        points = [self._start]
        for one in (known.start, *(point.q for point in known.points)):
            line = self._line(points[-1], one)
            if line is None:
                return None
            points += line
        self._budget.reached += len(points)
        return points, known.stats.planner

    def connected(self, goals: Array) -> tuple[list[Array], str]:
        """Joint positions from the start to a goal, free on the straight lines between them; and the planner."""
        for goal in goals:
            self._budget.check(inf)
            line = self._line(self._start, goal)
            if line is not None:
                self._budget.reached += len(line)
                return [self._start, *line], _STRAIGHT
        return self._grown(goals, inf)

    def _grown(self, goals: Array, longest: float) -> tuple[list[Array], str]:
        """As `connected`, by two trees, through joint positions on paths that are not longer than one known [rad]."""
        name = "RRT-Connect" if self._keep is None else "CBiRRT"
        one, other, is_swapped, nearest = _Tree(self._start[None]), _Tree(goals), False, inf
        low = np.minimum(np.minimum(self._robot.q_min + _INSIDE, self._start), goals.min(axis=0))
        high = np.maximum(np.maximum(self._robot.q_max - _INSIDE, self._start), goals.max(axis=0))
        reach = _REACH * self._step
        while True:
            self._budget.check(nearest)
            target = (
                one.target(self._random, low, high, near=reach)
                if longest == inf
                else np.clip(self._near(goals, longest), low, high)
            )
            new = self._extend(one, target, steps=1)
            if new is None:
                one.limit(target, reach)
            else:
                near = other.nearest(one.at(new))
                reached = self._extend(other, one.at(new), steps=1000)
                near = near if reached is None else reached
                between = other.at(near) - one.at(new)
                gap = sqrt(between @ between)
                nearest = min(nearest, gap)
                if gap < 1e-9:
                    first, last = (other, near), (one, new)
                    if not is_swapped:
                        first, last = last, first
                    return [*first[0].back(first[1])[::-1], *last[0].back(last[1])[1:]], name
            one, other, is_swapped = other, one, not is_swapped

    def _near(self, goals: Array, longest: float) -> Array:
        """Joint positions on paths to a goal that are not longer than so much (Gammell et al. 2014), shape (7,) [rad].

        They are in an ellipsoid with the start and the goal as its foci.
        """
        gaps = goals - self._start
        lengths = np.linalg.norm(gaps, axis=1)
        near = np.flatnonzero(lengths < longest)
        chosen = int(self._random.choice(near)) if len(near) else int(lengths.argmin())
        ball = _in_ball(self._random)
        along = gaps[chosen] / max(float(lengths[chosen]), 1e-9)
        across = np.sqrt(max(longest**2 - lengths[chosen] ** 2, 0.0))
        part = ball @ along
        found: Array = self._start + 0.5 * (
            gaps[chosen] + longest * part * along + across * (ball - part * along)
        )
        return found

    def _line(self, first: Array, last: Array) -> list[Array] | None:
        """Joint positions behind the first on the way to the last: under a constraint several; None: it is not free."""
        if self._keep is None:
            return [last] if self._world.is_free(first, last) else None
        tree = _Tree(first[None])
        end = self._extend(tree, last, steps=1000)
        if end is None or np.linalg.norm(tree.at(end) - last) > 1e-9:
            return None
        return tree.back(end)[-2::-1]

    def _extend(self, tree: _Tree, target: Array, *, steps: int) -> int | None:
        """Grow a tree towards a target by at most so many steps; the index of what it reaches, None: nothing."""
        index, result = tree.nearest(target), None
        for _ in range(steps):
            here = tree.at(index)
            gap = target - here
            length = sqrt(gap @ gap)
            if length < 1e-9:
                return index
            there = target if length <= self._step else here + self._step / length * gap
            if self._keep is not None:
                obeying = self._projected(here, there, target)
                if obeying is None:
                    return result
                there = obeying
            if not self._world.is_free(here, there):
                half = 0.5 * (here + there)  # nearer to the bodies in the way, but not against them
                if self._keep is None and self._world.is_free(here, half):
                    self._budget.reached += 1
                    return tree.add(half, index)
                return result
            self._budget.reached += 1
            index = result = tree.add(there, index)
        return result

    def _projected(self, here: Array, there: Array, target: Array) -> Array | None:
        """A step that obeys the constraint; None: there is none that gets nearer."""
        assert self._keep is not None
        found = self._keep.projected(there)
        if found is None:
            return None
        step = float(np.linalg.norm(found - here))
        is_away = np.linalg.norm(target - found) >= np.linalg.norm(target - here) - 1e-6
        if is_away or step > 2.0 * self._step or not self._keep.is_kept(0.5 * (here + found)):
            return None
        return found

    # -------------------------------------------------------------------------- shorter, smoother

    def shortened(self, points: list[Array]) -> list[Array]:
        """Fewer and shorter lines: points are left out, and corners cut at random places."""
        if len(points) < 3:
            return points
        kept = [points[0]]
        index = 0
        while index < len(points) - 1:  # as far as a straight line is free
            for further in range(len(points) - 1, index, -1):
                line = (
                    [points[further]] if further == index + 1 else self._line(points[index], points[further])
                )
                if line is not None:
                    kept += line
                    index = further
                    break
        for _ in range(_SHORTCUTS):
            if len(kept) < 3 or self._budget.is_late:
                break
            kept = self._cut(kept)
        return kept

    def _cut(self, points: list[Array]) -> list[Array]:
        """Replace what is between two random places of a path by a straight line, if it is free and shorter."""
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        marks = np.concatenate([[0.0], np.cumsum(steps)])
        low, high = np.sort(self._random.uniform(0.0, marks[-1], 2)).tolist()
        first, last = (int(np.searchsorted(marks, place, side="right")) - 1 for place in (low, high))
        if first == last:
            return points
        ends = []
        for place, index in ((low, first), (high, min(last, len(steps) - 1))):
            part = (place - marks[index]) / steps[index]
            ends.append(points[index] + part * (points[index + 1] - points[index]))
        longest = 0.98 * (high - low)
        if np.linalg.norm(ends[1] - ends[0]) > longest:
            return points
        if self._keep is not None and not all(map(self._keep.is_kept, ends)):
            return points
        line = self._line(ends[0], ends[1])
        if line is None:
            return points
        length = float(np.linalg.norm(np.diff([ends[0], *line], axis=0), axis=1).sum())
        if length > longest:
            return points
        return [*points[: first + 1], ends[0], *line, *points[min(last, len(steps) - 1) + 1 :]]

    def smoothed(self, points: list[Array], speeds: SpeedLimits) -> _Spline:
        """A joint spline along lines that is as free as they are: points are added where it is not.

        Raises:
            NoPath: it cannot be timed.
        """
        from heptarm.planning.motion import PlanError

        for curve, through in self._curves(_apart(points)):
            try:
                return _Spline(through, curve, *speeds.time(self._robot, through))
            except PlanError:
                continue  # it leaves the limits of the joints between two points
        raise NoPath(
            "a path was found, but no smooth curve beside it is free and within the limits of the joints",
            reason="not connected",
            states=self._budget.reached,
            parameter="goal",
            hint="try another seed, or a smaller margin of the world",
        )

    def _curves(self, points: Array) -> Iterator[tuple[Array, Array]]:
        """Curves that are free, and the points through which they go: more of them each time."""
        for _ in range(_REFINEMENTS):
            curve = _curve(self._robot, points)
            wrong = self._wrong(curve)
            if not len(wrong):
                yield curve, points
                wrong = np.arange(len(points) - 1)
            near = np.unique(np.clip(np.concatenate([wrong - 1, wrong, wrong + 1]), 0, len(points) - 2))
            middles = 0.5 * (points[near] + points[near + 1])
            if self._keep is not None:
                obeying = [self._keep.projected(middle) for middle in middles]
                middles = np.array([a if b is None else b for a, b in zip(middles, obeying)])
            points = np.insert(points, near + 1, middles, axis=0)

    def _wrong(self, curve: Array) -> npt.NDArray[np.int64]:
        """Pieces between two points on which a curve is not free; the first ones, empty: it is free."""
        outside = ((curve < self._robot.q_min) | (curve > self._robot.q_max)).any(axis=1)
        if self._keep is not None:
            outside |= self._keep.deviations(curve) > self._keep.most
        if outside.any():
            return np.unique(np.maximum(np.flatnonzero(outside) - 1, 0) // _SAMPLES)
        touch = self._world.first_on(curve)
        if touch is None:
            return np.zeros(0, np.int64)
        moves = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(curve, axis=0)).max(axis=1))])
        place = int(np.searchsorted(moves, touch.at * moves[-1])) - 1
        return np.array([max(place, 0) // _SAMPLES])

    def improved(self, goals: Array, best: _Spline, speeds: SpeedLimits) -> _Spline:
        """The fastest of a spline and those of further searches, until the budget is used up.

        Constraints make paths longer, so that only without them the length of a path bounds where a shorter one is.
        """
        while True:
            longest = float(np.linalg.norm(np.diff(best.curve, axis=0), axis=1).sum())
            try:
                points, _ = self._grown(goals, longest if self._keep is None else inf)
                found = self.smoothed(self.shortened(points), speeds)
            except NoPath:
                if self._budget.is_over:
                    return best
                continue  # no smooth curve beside these lines
            if found.duration < best.duration:
                best = found

    def nearest_on(self, curve: Array) -> Clearance | None:
        """The nearest two bodies on a curve; None: none are near."""
        distances = self._world.distances(curve[:: _SAMPLES // 4], below=_REPORTED)
        worst = curve[:: _SAMPLES // 4][int(distances.argmin())]
        found = self._world.clearances(worst, below=_REPORTED) if np.isfinite(distances).any() else ()
        allowed = [clearance for clearance in found if clearance.distance >= distances.min() - 1e-9]
        return allowed[0] if allowed else None


def _in_ball(random: np.random.Generator) -> Array:
    """A random place in the ball of radius 1 around the origin, shape (7,)."""
    direction = random.normal(size=7)
    found: Array = direction * (random.uniform() ** (1.0 / 7.0) / sqrt(direction @ direction))
    return found


def _sampled(region: Region, random: np.random.Generator) -> list[Pose]:
    """Poses of a region: its middle, and others at random."""
    found = [region.pose]
    for _ in range(_POSES):
        place = random.uniform(-0.5, 0.5, 3) * region.box
        # directions spread evenly over the cap of the cone
        tilt = float(np.arccos(1.0 - random.uniform() * (1.0 - np.cos(region.cone))))
        about, turn = random.uniform(0.0, 2.0 * np.pi), random.uniform(-region.turn, region.turn)
        lean = (np.sin(tilt / 2) * np.cos(about), np.sin(tilt / 2) * np.sin(about), 0.0, np.cos(tilt / 2))
        twist = Pose.of((0.0, 0.0, 0.0), (0.0, 0.0, np.sin(turn / 2), np.cos(turn / 2)))
        found.append(region.pose @ Pose.of(place, lean) @ twist)
    return found


def _each(goal: object) -> list[Array | Pose | Region]:
    """The goals that are given as one or as several.

    Raises:
        ShapeError: none, or something else.
    """
    if isinstance(goal, Pose | Region):
        return [goal]
    if (
        isinstance(goal, Sequence)
        and not isinstance(goal, str)
        and goal
        and not isinstance(goal[0], Real)  # numpy's numbers, too
    ):
        return [element for part in goal for element in _each(part)]
    if isinstance(goal, np.ndarray) and goal.ndim == 2 and len(goal):
        return [element for row in goal for element in _each(row)]
    if isinstance(goal, np.ndarray | Sequence) and not isinstance(goal, str):
        return [array(goal, 7, "goal")]
    raise ShapeError(
        f"goal must be joint positions, a Pose, a Region or a list of these, got {shown(goal)}",
        parameter="goal",
        value=goal,
        hint="for example heptarm.deg(0, 30, 0, -90, 0, 60, 0)",
    )


def _is_same(one: Array | Pose | Region, other: Array | Pose | Region) -> bool:
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return isinstance(one, np.ndarray) and isinstance(other, np.ndarray) and np.array_equal(one, other)
    return one == other


def _apart(points: list[Array]) -> Array:
    """Points without those that are where the one before is; a path that does not move keeps one."""
    kept = [points[0]]
    for point in points[1:]:
        if np.abs(point - kept[-1]).max() > 1e-4:
            kept.append(point)
    if len(kept) == 1 or np.abs(kept[-1] - points[-1]).max() > 0.0:
        kept = [*(kept if len(kept) == 1 else kept[:-1]), points[-1]]
    return np.array(kept)


def _curve(robot: RobotModel, points: Array) -> Array:
    """Joint positions along the spline through points, as the controller lays it, shape (m, 7) [rad]."""
    from heptarm.planning.spline import through

    lengths = np.maximum(np.abs(np.diff(points, axis=0) / robot.dq_max).max(axis=1), 1e-9)
    return through(points, lengths).even(_SAMPLES)
