"""A media flange in the simulated world: kinematics, gravity and shapes follow the robot."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from heptarm.model import forward, gravity
from heptarm.sim.collision import CollisionModel
from heptarm.sim.plant.appearance import ArmMeshes
from heptarm.sim.plant.plant import Plant
from heptarm.sim.plant.scene import Scene
from heptarm.sim.plant.shapes import drawn_shapes
from heptarm.sim.plant.world import compiled
from heptarm.values.pose import deg
from heptarm.values.robot import ROBOTS, robot

Q = deg(10, 20, 30, -80, 20, 40, 50)


@pytest.mark.parametrize("name", ROBOTS)
def test_mujoco_has_the_robots_kinematics_and_gravity(name: str) -> None:
    arm = robot(name, flange="touch")
    model = compiled(arm.name)
    data = mujoco.MjData(model)
    data.qpos[:7] = Q
    mujoco.mj_forward(model, data)
    assert data.site("flange").xpos == pytest.approx(forward(arm, Q)[:3, 3], abs=1e-9)
    assert data.qfrc_bias[:7] == pytest.approx(gravity(arm, Q), abs=0.02)


def test_the_plant_knows_the_mass_of_its_flange() -> None:
    plant = Plant("iiwa14+touch", q=tuple(Q.tolist()))
    plant.step(300)
    assert np.abs(plant.snapshot.tau_ext).max() < 0.02
    assert plant.robot.d_wf == 0.152


def test_its_shape_collides_26_mm_further_out() -> None:
    q = deg(0, 30, 0, -90, 0, 60, 0)  # looks down
    x, _, z = forward(robot("iiwa14"), q)[:3, 3]
    box = [f"{x},0,{z - 0.065},0.2,0.2,0.1"]  # its top is 15 mm below a plain flange
    assert not CollisionModel("iiwa14", boxes=box, margin=0.0).touching(q)
    assert CollisionModel("iiwa14+touch", boxes=box, margin=0.0).touching(q)


def test_it_is_drawn_and_a_scenes_tool_is_on_it() -> None:
    model = compiled("iiwa14+touch", meshes=ArmMeshes())
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    tops = [
        float((shape.vertices @ data.geom_xmat[shape.index].reshape(3, 3).T)[:, 2].max())
        + data.geom_xpos[shape.index][2]
        for shape in drawn_shapes(model)
    ]
    assert max(tops) == pytest.approx(1.332, abs=1e-6)
    with_tool = compiled("iiwa14+touch", scene=Scene.of("bins"))
    data = mujoco.MjData(with_tool)
    mujoco.mj_forward(with_tool, data)
    assert data.site("flange").xpos[2] == pytest.approx(1.332, abs=1e-6)
