"""The model of the ready laws: mass matrix, Coriolis torques, gravity and Jacobian together."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Iterator

import numpy as np

from bench.measure.blocks import BLOCKS
from bench.measure.figure import Figure, benchmark
from bench.measure.noise import Noise
from heptarm.laws.ready import shared_library
from heptarm.model.dynamics import ROTOR, rigid_bodies
from heptarm.values.robot import ROBOTS

#: Postures in a block.
POSTURES = 10_000
#: Limit of all together for one posture [us].
TOGETHER = 20.0


@benchmark("law_model")
def law_model() -> Iterator[Figure]:
    """M, C dq, g and J of one posture after another, with the call from Python."""
    robot = ROBOTS["iiwa14"]
    q = np.random.default_rng(7).uniform(robot.q_min, robot.q_max, (POSTURES, 7))
    dq, known = np.linspace(-1.0, 1.0, 7), rigid_bodies(robot, rotor=ROTOR)
    found = [np.zeros(shape) for shape in ((7, 7), 7, 7, (6, 7), 7)]
    compute = ctypes.CDLL(str(shared_library())).heptarm_model
    others = [ctypes.c_void_p(one.ctypes.data) for one in (dq, *found)]
    robot_at = ctypes.c_void_p(known.ctypes.data)
    postures = [ctypes.c_void_p(q.ctypes.data + row * q.strides[0]) for row in range(POSTURES)]
    times = []
    with Noise() as noise:
        for _ in range(BLOCKS):
            begin = time.thread_time_ns()
            for posture in postures:
                compute(robot_at, posture, *others)
            times.append((time.thread_time_ns() - begin) / POSTURES / 1e3)
    detail = {"fastest_us": round(min(times), 3), "postures": POSTURES}
    yield Figure(
        "law_model",
        float(np.median(times)),
        "us",
        limit=TOGETHER,
        disturbed=noise.is_noisy,
        detail=detail,
    )
