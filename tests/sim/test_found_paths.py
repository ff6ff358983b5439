"""Paths around bodies as the plant carries them out: all limits of the joints hold in its trace, also with a load."""

from __future__ import annotations

import numpy as np
import pytest

import heptarm as ha
from bench.planning.problems import ROBOT, problems
from heptarm import planning
from heptarm.model.batch import forward_batch
from heptarm.planning import seam
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant.plant import Plant
from heptarm.values.checks import Array
from heptarm.values.motion.planned_path import Path
from heptarm.values.robot import Body, robot
from tests.long import longer
from tests.sim.driving import Ear

IIWA = robot(ROBOT)
#: As much as the arm may carry [kg], 10 cm before the flange.
HEAVY = Body(14.0, np.array((0.0, 0.0, 0.1)), inertia=np.array((0.1, 0.1, 0.1, 0.0, 0.0, 0.0)))
#: Speed, acceleration and jerk may exceed their limits by these fractions, as of other motions (`test_batch`): timing
#: is to 1 %, and differences over ticks of 1 ms see a little more.
ROUNDED = (1e-3, 0.02, 0.02)


def driven(path: Path, load: Body | None) -> tuple[Array, Array]:
    """Commanded joint positions and motor torques of each tick, shapes (n, 7)."""
    plant = Plant(ROBOT, q=tuple(path.start.tolist()))
    if load is not None:
        plant.set_load_data(load)
    fractions = (path.dynamics.joint_speed, path.dynamics.joint_acceleration)
    velocity, acceleration = (tuple(np.nan_to_num(one, nan=1.0).tolist()) for one in fractions)
    motion = seam.JointSpline(
        points=tuple(seam.Ptp(q=tuple(one.q.tolist())) for one in path.points),
        dynamics=seam.JointDynamics(velocity=velocity, acceleration=acceleration),
    )
    ear = Ear()
    plant.submit(MotionCommand(1, motion, listener=ear))
    rows = [path.start]
    torques = [plant.snapshot.tau]
    while not plant.idle:
        plant.tick()
        rows.append(plant.snapshot.q_cmd)
        torques.append(plant.snapshot.tau)
    assert ear.causes[-1] == "done", ear.heard
    return np.array(rows), np.array(torques)


@pytest.mark.parametrize("load", [None, HEAVY], ids=["bare", "14 kg"])
def test_all_limits_of_the_joints_hold_in_the_trace_of_the_plant(load: Body | None) -> None:
    for scene in ("shelf", "table-and-post")[: longer(1, 2)]:
        world = ha.CollisionModel(ROBOT, scene=scene)
        for one in problems(scene)[
            5 : longer(7, 55)
        ]:  # with the load, the first of shelf is bound by torques
            path = planning.find_path(world, start=one.start, goal=one.goal, load=load, timeout=60.0)
            q, tau = driven(path, load)
            assert (q >= IIWA.q_min).all() and (q <= IIWA.q_max).all()
            limits = IIWA.dq_max, IIWA.ddq_max, IIWA.dddq_max
            for order, (limit, rounded) in enumerate(zip(limits, ROUNDED), 1):
                used = np.abs(np.diff(q, order, axis=0)).max(axis=0) * 1e3**order / limit
                assert used.max() <= 1.0 + rounded + 1e-6, (scene, order, used)
            assert (np.abs(tau).max(axis=0) <= IIWA.tau_max).all(), np.abs(tau).max(axis=0) / IIWA.tau_max
            assert 0.0 <= 1e-3 * (len(q) - 1) - path.duration < 0.2  # it settles a while longer


def test_a_heavy_load_makes_a_path_slower_and_one_that_is_too_heavy_is_refused() -> None:
    world, one = ha.CollisionModel(ROBOT, scene="shelf"), problems("shelf")[5]
    bare, loaded = (
        planning.find_path(world, start=one.start, goal=one.goal, load=load, timeout=60.0)
        for load in (Body(0.5, np.zeros(3)), HEAVY)
    )
    assert np.isnan(bare.dynamics.joint_acceleration).all() and loaded.duration > bare.duration
    with pytest.raises(
        ha.NoPath, match=r"the load is too heavy on the path: A\d needs \d+ Nm at rest"
    ) as error:
        planning.find_path(
            world, start=one.start, goal=one.goal, load=Body(45.0, np.array((0.0, 0.0, 0.2))), timeout=60.0
        )
    assert error.value.reason == "torque"


def test_the_tool_frame_is_no_faster_than_is_given() -> None:
    world, one = ha.CollisionModel(ROBOT, scene="table-and-post"), problems("table-and-post")[0]
    tcp = ha.Pose.at(0.0, 0.0, 0.2)
    path = planning.find_path(world, start=one.start, goal=one.goal, tcp=tcp, tcp_speed=0.25, timeout=60.0)
    frames = forward_batch(IIWA, driven(path, None)[0])
    places = frames[:, :3, 3] + frames[:, :3, :3] @ tcp.xyz
    fastest = np.linalg.norm(np.diff(places, axis=0), axis=1).max() * 1e3
    assert 0.2 < fastest <= 0.25 and path.tcp_speed == 0.25
