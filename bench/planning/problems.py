"""Problem sets for searches: 100 pairs of start and goal in each of some scenes, stored as data.

python -m bench.planning.problems [SCENE...]     make the sets again, and prove that each problem can be solved

A file has one problem a line: joint positions of start and goal [rad], the length of the best known path (the norm of
all joints) [rad], and who has solved it.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import heptarm as ha
from heptarm import planning
from heptarm.model.batch import solve_batch
from heptarm.values.checks import Array
from heptarm.values.pose import Pose

FOLDER = Path(__file__).parent / "problems"
COUNT = 100
ROBOT = "iiwa14"
#: Least clearance at start and goal [m].
CLEAR = 0.01
#: Searches of a problem, of which the shortest path is the best known.
SEARCHES = 4
#: Longest search that proves that a problem can be solved [s].
PATIENCE = 120.0
#: The z axis of the tool frame points forward, or down.
FORWARD, DOWN = (0.0, 0.5**0.5, 0.0, 0.5**0.5), (0.0, 1.0, 0.0, 0.0)
#: From the flange to the tip of the two-finger gripper [m].
TIP = 0.16


@dataclass(frozen=True)
class Place:
    """Where a path begins or ends.

    Attributes:
        middle: of the positions, in the base [m].
        size: edges of the box of positions [m].
        quat: orientation of the tool frame.
        cone: largest angle from it [rad].
    """

    middle: tuple[float, float, float]
    size: tuple[float, float, float]
    quat: tuple[float, float, float, float]
    cone: float

    def pose(self, random: np.random.Generator) -> Pose:
        """One of its poses."""
        place = np.array(self.middle) + random.uniform(-0.5, 0.5, 3) * self.size
        axis = random.normal(size=3)
        half = 0.5 * random.uniform(0.0, self.cone)
        turn = Pose.of(
            (0, 0, 0), (*(np.sin(half) * axis / np.linalg.norm(axis)).tolist(), float(np.cos(half)))
        )
        return Pose.of(place, self.quat) @ turn


#: By scene: the length of the tool [m], and pairs of places between which the arm moves.
SCENES: dict[str, tuple[float, list[tuple[Place, Place]]]] = {}


def _describe() -> None:
    lower = Place((0.81, 0.0, 0.40), (0.10, 0.56, 0.16), FORWARD, 0.3)
    upper = Place((0.81, 0.0, 0.77), (0.10, 0.56, 0.16), FORWARD, 0.3)
    aside = Place((0.45, 0.0, 0.60), (0.20, 1.00, 0.50), DOWN, 0.8)
    SCENES["shelf"] = TIP, [(lower, upper), (upper, lower), (aside, lower), (upper, aside)]
    left = Place((0.58, 0.30, 0.36), (0.30, 0.34, 0.20), DOWN, 0.5)
    right = replace(left, middle=(0.58, -0.30, 0.36))
    SCENES["table-and-post"] = TIP, [(left, right), (right, left)]
    inside = Place((0.60, 0.20, 0.50), (0.20, 0.24, 0.40), FORWARD, 1.2)
    other = replace(inside, middle=(0.60, -0.20, 0.50))
    before = Place((0.28, 0.0, 0.75), (0.16, 1.00, 0.60), FORWARD, 1.5)
    SCENES["cage"] = 0.0, [(inside, other), (other, inside), (before, inside), (other, before)]
    through = Place((0.66, 0.0, 0.55), (0.16, 0.30, 0.30), FORWARD, 0.8)
    SCENES["narrow-slot"] = 0.0, [(before, through), (through, before)]
    near = Place((0.52, 0.32, 0.40), (0.24, 0.30, 0.20), DOWN, 0.5)
    far = replace(near, middle=(0.52, -0.32, 0.40))
    SCENES["two-arms"] = 0.0, [(near, far), (far, near)]


_describe()
#: Where the other arm of the scene two-arms rests: over the table.
OTHER = ha.deg(0, 55, 0, -60, 0, 65, 0)


def world_of(scene: str) -> ha.CollisionModel:
    """The bodies of a scene, and the other arm if there is one."""
    world = ha.CollisionModel(ROBOT, scene=scene)
    return world.with_arm("right", q=OTHER) if scene == "two-arms" else world


@dataclass(frozen=True)
class Problem:
    """A problem of a set.

    Attributes:
        start: joint positions, shape (7,) [rad].
        goal: likewise.
        length: of the best known path [rad].
        solved_by: names of the planners that have solved it.
    """

    start: Array
    goal: Array
    length: float
    solved_by: tuple[str, ...]


def problems(scene: str) -> list[Problem]:
    """The stored problems of a scene."""
    lines = (FOLDER / f"{scene}.jsonl").read_text(encoding="utf-8").splitlines()
    found: list[dict[str, Any]] = [json.loads(line) for line in lines]
    return [
        Problem(np.array(one["start"]), np.array(one["goal"]), one["length"], tuple(one["solved_by"]))
        for one in found
    ]


def store(scene: str, solved: list[Problem]) -> None:
    """Write the problems of a scene."""
    texts = [
        json.dumps(
            {
                "start": one.start.tolist(),
                "goal": one.goal.tolist(),
                "length": round(one.length, 3),
                "solved_by": sorted(one.solved_by),
            }
        )
        for one in solved
    ]
    (FOLDER / f"{scene}.jsonl").write_text("\n".join(texts) + "\n", encoding="utf-8")


def length(points: Array) -> float:
    """Length of a joint path [rad]: the norm of all joints."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def _free(world: ha.CollisionModel, place: Place, tool: float, random: np.random.Generator) -> Array:
    """Joint positions at a place, with room around the arm."""
    robot, back = world.robot, Pose.at(0.0, 0.0, -tool)
    while True:
        pose = place.pose(random) @ back
        status = np.arange(8)
        angles = random.uniform(robot.q_min[2], robot.q_max[2], 8)
        solved = solve_batch(robot, np.repeat(pose.matrix[None], 8, axis=0), e1=angles, status=status)
        rows = solved[np.isfinite(solved).all(axis=1)].round(4)
        rows = rows[((rows > robot.q_min + 0.03) & (rows < robot.q_max - 0.03)).all(axis=1)]
        if len(rows):
            rows = rows[world.distances(rows, below=CLEAR) >= CLEAR]
        if len(rows):
            chosen: Array = rows[random.integers(len(rows))]
            return chosen


def made(scene: str, searches: int) -> Iterator[Problem]:
    """Make the problems of a scene: the straight joint path is not free, and a long search finds another one."""
    world = world_of(scene)
    tool, pairs = SCENES[scene]
    random = np.random.default_rng(20261128)
    count = 0
    while count < COUNT:
        first, second = pairs[count % len(pairs)]
        start, goal = _free(world, first, tool, random), _free(world, second, tool, random)
        if world.first_on([start, goal]) is None:
            continue
        best = _best(world, start, goal, searches)
        if best is not None:
            count += 1
            yield Problem(start, goal, best, ("heptarm",))


def shorter(scene: str, searches: int) -> Iterator[Problem]:
    """The stored problems of a scene, with shorter paths where the searches find them."""
    world = world_of(scene)
    for one in problems(scene):
        best = _best(world, one.start, one.goal, searches)
        yield one if best is None else replace(one, length=min(one.length, best))


def _best(world: ha.CollisionModel, start: Array, goal: Array, searches: int) -> float | None:
    """Length of the shortest path that several searches find; None: none finds one."""
    found: list[float] = []
    for seed in range(searches):
        try:
            path = planning.find_path(
                world, start=start, goal=goal, seed=seed, timeout=PATIENCE, states=1_000_000
            )
        except ha.NoPath:
            if not found:
                return None
        else:
            found.append(length(path.curve))
    return min(found)


def main() -> None:
    parser = argparse.ArgumentParser(description="Make the problem sets again.")
    parser.add_argument("scenes", nargs="*", default=list(SCENES), help="all of them by default")
    parser.add_argument(
        "--searches", type=int, default=SEARCHES, help="of each problem, for the best known path"
    )
    parser.add_argument(
        "--keep", action="store_true", help="keep the problems, and look for shorter paths only"
    )
    options = parser.parse_args()
    for scene in options.scenes:
        again = shorter if options.keep else made
        store(scene, list(again(scene, options.searches)))
        print(f"{scene}: {len(problems(scene))} problems", flush=True)


if __name__ == "__main__":
    main()
