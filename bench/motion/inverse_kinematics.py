"""Inverse kinematics: fraction solved, error and duration."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from bench.measure.figure import Figure, benchmark
from heptarm.errors import Unreachable
from heptarm.model import inverse_kinematics as ik
from heptarm.model.kinematics import forward
from heptarm.values.robot import ROBOTS

POSES = 10_000


@benchmark("inverse")
def inverse_kinematics() -> Iterator[Figure]:
    """10,000 random reachable poses of each model: fraction solved, largest error, time of one solution."""
    for name in ("iiwa7", "iiwa14"):
        robot = ROBOTS[name]
        random = np.random.default_rng(15)
        solved, worst, times = 0, 0.0, []
        for q in random.uniform(robot.q_min, robot.q_max, (POSES, 7)):
            pose = forward(robot, q)
            begin = time.perf_counter_ns()
            try:
                found = ik.solve(robot, pose)
            except Unreachable:
                continue
            times.append(time.perf_counter_ns() - begin)
            solved += 1
            worst = max(worst, float(np.abs(forward(robot, found) - pose).max()))
        raw = _raw_time(name)
        detail = {"robot": name, "solve_us": round(float(np.median(times)) / 1e3, 1), "one_branch_us": raw}
        yield Figure(
            f"inverse_solved_{name}", solved / POSES, "fraction", limit=1.0, at_least=True, detail=detail
        )
        yield Figure(f"inverse_error_{name}", worst, "m", limit=1e-9, detail={"robot": name})


def _raw_time(name: str) -> float:
    """Median time of one solution for a given arm angle and Status [us]."""
    robot = ROBOTS[name]
    q = np.array([0.3, 0.5, -0.2, -1.2, 0.4, 0.9, 0.1])
    rows, known = ik.rows(forward(robot, q)), ik.redundancy(robot, q)
    times = []
    for _ in range(2000):
        begin = time.perf_counter_ns()
        ik.raw(robot, *rows, known.e1, known.status)
        times.append(time.perf_counter_ns() - begin)
    return round(float(np.median(times)) / 1e3, 1)
