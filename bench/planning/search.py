"""Searches of the problem sets, and the checks that they consist of."""

from __future__ import annotations

import ctypes
import gc
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np

import heptarm as ha
from bench.measure.blocks import BLOCKS
from bench.measure.compiler import library
from bench.measure.figure import Figure, benchmark
from bench.measure.noise import Noise
from bench.planning.problems import ROBOT, SCENES, Problem, length, problems, world_of
from heptarm import planning
from heptarm.sim.plant.native import mujoco_library
from heptarm.sim.plant.scene import Scene
from heptarm.sim.plant.world import compiled
from heptarm.values.robot import robot

#: Longest search that counts [s].
LONGEST = 1.0
#: Problems of a hundred that have to be solved; in other scenes all of them.
LEAST = {"narrow-slot": 99}
#: Limits of the time to a simplified, timed path: median, and 95th percentile [ms]; of its length by the best known.
MEDIAN, LATE, LONGER = 25.0, 150.0, 1.15
#: Postures of a block, and the limit of a check in scene bins [us].
POSTURES, CHECK = 5000, 15.0


def _searched(world: ha.CollisionModel, one: Problem) -> tuple[float, float, float] | None:
    """Time and processor time of a search [s], and the length of its path by the best known; None: it found none."""
    begin, used = time.perf_counter(), time.process_time()
    try:
        path = planning.find_path(world, start=one.start, goal=one.goal, timeout=LONGEST)
    except ha.NoPath:
        return None
    return time.perf_counter() - begin, time.process_time() - used, length(path.curve) / one.length


@benchmark("searches")
def searches() -> Iterator[Figure]:
    """Problems of each scene that are solved within a second, how fast, and how long the paths are."""
    for scene in SCENES:
        world, posed = world_of(scene), problems(scene)
        _searched(world, posed[0])  # the first one loads modules
        gc.collect()
        with Noise() as noise:
            found = [done for one in posed if (done := _searched(world, one)) is not None]
        times, cpu, lengths = (np.array(column) for column in zip(*found, strict=True))
        detail = {"problems": len(posed), "longest_s": LONGEST, "others": round(noise.others, 2)}
        is_noisy = noise.is_noisy
        yield Figure(
            f"plan_solved_{scene}", len(found), "count", limit=LEAST.get(scene, len(posed)), at_least=True,
            disturbed=is_noisy, detail=detail,
        )  # fmt: skip
        # what was not found counts as the longest
        times = np.concatenate([times, np.full(len(posed) - len(found), LONGEST)]) * 1e3
        middle, late = np.percentile(times, [50, 95]).tolist()
        processor = [{"processor_ms": round(float(1e3 * np.percentile(cpu, part)), 1)} for part in (50, 95)]
        yield Figure(
            f"plan_time_{scene}", middle, "ms", limit=MEDIAN, disturbed=is_noisy, detail=processor[0]
        )
        yield Figure(f"plan_late_{scene}", late, "ms", limit=LATE, disturbed=is_noisy, detail=processor[1])
        middle, late = np.percentile(lengths, [50, 95]).tolist()
        yield Figure(f"plan_length_{scene}", middle, "fraction", limit=LONGER, detail={"p95": round(late, 3)})


@benchmark("checks")
def checks() -> Iterator[Figure]:
    """Distances of many postures at once, beside MuJoCo's own collision detection in C."""
    arm = robot(ROBOT)
    q = np.random.default_rng(3).uniform(arm.q_min, arm.q_max, (POSTURES, 7))
    shown = mujoco_library(["mj_kinematics", "mj_collision"])
    pointer = ctypes.c_void_p
    called = [ctypes.cast(function, pointer) for function in (shown.mj_kinematics, shown.mj_collision)]
    with tempfile.TemporaryDirectory() as folder:
        floor = library(Path(__file__).with_name("floor.c"), Path(folder)).postures
    floor.restype, floor.argtypes = None, (*[pointer] * 5, ctypes.c_int64, pointer)
    for scene in ("bins", *SCENES):
        world, model = ha.CollisionModel(ROBOT, scene=scene), compiled(ROBOT, [], Scene.of(scene))
        data = mujoco.MjData(model)
        times, floors = [], []
        with Noise() as noise:
            for _ in range(BLOCKS):
                begin = time.thread_time_ns()
                world.distances(q, below=world.margin)
                middle = time.thread_time_ns()
                floor(model._address, data._address, *called, data.qpos.ctypes.data, len(q), q.ctypes.data)
                times.append((middle - begin) / len(q) / 1e3)
                floors.append((time.thread_time_ns() - middle) / len(q) / 1e3)
        yield Figure(
            f"check_{scene}", float(np.median(times)), "us", limit=CHECK if scene == "bins" else None,
            disturbed=noise.is_noisy,
            detail={"mujoco_us": round(float(np.median(floors)), 2), "margin_m": world.margin, "postures": len(q)},
        )  # fmt: skip
