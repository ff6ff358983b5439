"""Inverse kinematics: fraction solved, error and duration; and how far joints that a pose leaves free move."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from bench.measure.figure import Figure, benchmark
from heptarm import model
from heptarm.errors import Unreachable
from heptarm.values.robot import ROBOTS

POSES = 10_000
#: Round postures of each robot, step and noise.
EDGES = 1_250
#: Noise of the joints whose pose is asked for [rad].
NOISES = (0.0, 1e-16, 1e-14, 1e-12, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5)


@benchmark("inverse")
def inverse_kinematics() -> Iterator[Figure]:
    """10,000 random reachable poses of each model: fraction solved, largest error, time of one solution."""
    for name in ("iiwa7", "iiwa14"):
        robot = ROBOTS[name]
        random = np.random.default_rng(15)
        solved, worst, times = 0, 0.0, []
        for q in random.uniform(robot.q_min, robot.q_max, (POSES, 7)):
            pose = model.forward(robot, q)
            begin = time.perf_counter_ns()
            try:
                found = model.solve(robot, pose)
            except Unreachable:
                continue
            times.append(time.perf_counter_ns() - begin)
            solved += 1
            worst = max(worst, float(np.abs(model.forward(robot, found) - pose).max()))
        detail = {
            "robot": name,
            "solve_us": round(float(np.median(times)) / 1e3, 1),
            "one_branch_us": _one_branch_time(name),
        }
        yield Figure(
            f"inverse_solved_{name}", solved / POSES, "fraction", limit=1.0, at_least=True, detail=detail
        )
        yield Figure(f"inverse_error_{name}", worst, "m", limit=1e-9, detail={"robot": name})


@benchmark("edges")
def edges() -> Iterator[Figure]:
    """Poses of postures of round angles, with noise: how far the joints go that should stay.

    For each of them `model.solve(robot, model.forward(robot, q + noise), near=q)`; q has multiples of 15 or 45 degrees,
    a third of them 0. A joint may move by 10 times the noise, or by 1e-6 rad.
    """
    random = np.random.default_rng(38)
    tried, failed, worst = 0, 0, -np.inf
    for robot in ROBOTS.values():
        for step in (15.0, 45.0):
            most = np.floor(np.degrees(robot.q_max) / step + 1e-9)
            for size in NOISES:
                q = np.radians(step * random.integers(-most, most + 1, (EDGES, 7)))
                q[random.random(q.shape) < 0.3] = 0.0
                noise = random.uniform(-size, size, q.shape)
                found = model.solve_batch(robot, model.forward_batch(robot, q + noise), near=q)
                surplus = np.abs(found - q).max(axis=1) - np.abs(noise).max(axis=1)
                allowed = np.maximum(9.0 * np.abs(noise).max(axis=1), 1e-6)
                tried += len(q)
                failed += int((~(surplus <= allowed)).sum())
                worst = max(worst, float(np.nanmax(surplus)))
    detail = {"postures": tried, "worst_surplus_rad": float(f"{worst:.3g}"), "largest_noise_rad": max(NOISES)}
    yield Figure("edges", failed, "failures", limit=0, detail=detail)


def _one_branch_time(name: str) -> float:
    """Median time of one solution for a given E1 and Status [us]."""
    robot = ROBOTS[name]
    q = np.array([0.3, 0.5, -0.2, -1.2, 0.4, 0.9, 0.1])
    pose, known = model.forward(robot, q), model.redundancy(robot, q)
    times = []
    for _ in range(2000):
        begin = time.perf_counter_ns()
        model.solve(robot, pose, e1=known.e1, status=known.status)
        times.append(time.perf_counter_ns() - begin)
    return round(float(np.median(times)) / 1e3, 1)
