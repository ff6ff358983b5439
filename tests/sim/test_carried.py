"""Shapes on the flange of the running model: the same contacts as if it had been compiled with them."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np
import pytest

from heptarm import shapes
from heptarm.sim.plant.carried import CarriedShapes, FlangeShapes
from heptarm.sim.plant.plant import Plant
from heptarm.sim.plant.scene import Scene
from heptarm.sim.plant.world import Box, compiled
from heptarm.values.pose import Pose
from heptarm.values.shape import Shape

TABLE = Box.of("0.6,0,0.1,0.4,0.8,0.2")
MAKERS: tuple[Callable[..., Shape], ...] = (
    lambda sizes, at: shapes.box(*sizes, at=at),
    lambda sizes, at: shapes.cylinder(*sizes[:2], at=at),
    lambda sizes, at: shapes.sphere(sizes[0], at=at),
    lambda sizes, at: shapes.capsule(*sizes[:2], at=at),
)
#: Contacts that differ less are the same: those of cylinders are found by iteration [m].
_GRAZING = 1e-3
PEN = CarriedShapes("pen", (shapes.capsule(0.01, 0.18, at=Pose.at(0, 0, 0.1)),), Pose.at(), is_tool=True)


def random_shapes(random: np.random.Generator) -> tuple[Shape, ...]:
    found = []
    for _ in range(3):
        quat = random.normal(size=4)
        at = Pose.of(random.uniform(-0.1, 0.1, 3) + [0, 0, 0.15], quat / np.linalg.norm(quat))
        found.append(MAKERS[random.integers(len(MAKERS))](random.uniform(0.03, 0.15, 3), at))
    return tuple(found)


def contacts(model: mujoco.MjModel, data: mujoco.MjData, q: np.ndarray) -> dict[tuple[str, ...], float]:
    """The deepest contact of each pair of bodies, those on the flange under one name [m]."""
    data.qpos[:7] = q
    mujoco.mj_forward(model, data)
    found: dict[tuple[str, ...], float] = {}
    for one in data.contact[: data.ncon]:
        names = [model.body(model.geom_bodyid[geom]).name for geom in one.geom]
        carried = ("tool/", "workpiece/", "mounted")
        pair = tuple(sorted("carried" if name.startswith(carried) else name for name in names))
        found[pair] = min(found.get(pair, 0.0), one.dist)
    return {pair: distance for pair, distance in found.items() if distance < -_GRAZING}


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    path = tmp_path_factory.mktemp("cell") / "cell.xml"
    path.write_text(
        """<mujoco><worldbody>
          <body name="pillar" pos="-0.4 0 0.4"><geom type="box" size="0.1 0.1 0.4"/></body>
          <body name="ball" pos="0.5 0.4 0.5"><freejoint/><geom type="sphere" size="0.15" mass="1"/></body>
        </worldbody></mujoco>"""
    )
    return Scene(path)


def test_mounted_shapes_touch_what_compiled_ones_touch(cell: Scene) -> None:
    random, touching = np.random.default_rng(7), 0
    for _ in range(6):
        tool = CarriedShapes("tool", random_shapes(random), Pose.at(), is_tool=True)
        part = CarriedShapes("part", random_shapes(random), Pose.at(0.02, 0.0, 0.1))
        world = compiled("iiwa14", [TABLE], cell, carried=[tool, part])
        running = compiled("iiwa14", [TABLE], cell, room=True)
        FlangeShapes(running).mount([tool, part])
        one, other = mujoco.MjData(world), mujoco.MjData(running)
        for q in random.uniform(-2.0, 2.0, (150, 7)):
            expected, seen = contacts(world, one, q), contacts(running, other, q)
            assert seen == pytest.approx(expected, abs=_GRAZING)
            touching += any("carried" in pair for pair in expected)
    assert touching > 200


def test_room_for_shapes_and_shapes_that_are_gone_change_no_bit() -> None:
    random = np.random.default_rng(5)
    torques = random.normal(size=(40, 7)) * 30.0
    after = []
    for room, mounts in ((False, False), (True, False), (True, True)):
        model = compiled("iiwa14", [TABLE], room=room)
        if mounts:
            flange = FlangeShapes(model)
            flange.mount([PEN])
            flange.mount([])
        data = mujoco.MjData(model)
        data.qpos[:7] = (0, 0.9, 0, -1.2, 0, 1.0, 0)
        touched = 0
        for ctrl in torques:
            data.ctrl[:7] = ctrl
            mujoco.mj_step(model, data, 25)
            touched += data.ncon
        assert touched > 0  # the arm falls onto the table
        after.append((data.qpos.tobytes(), data.qvel.tobytes(), data.qacc.tobytes()))
    assert after[0] == after[1] == after[2]


def test_a_tool_of_the_scene_stays_there_alone() -> None:
    model = compiled("iiwa14", scene=Scene.of("table"), room=True)
    before = model.geom_contype.copy()
    FlangeShapes(model).mount([PEN])
    assert (model.geom_contype == before).all()
    assert compiled("iiwa14", scene=Scene.of("table")).ngeom == model.ngeom


def test_the_plant_feels_the_tip_of_a_tool_and_feels_it_no_more_when_it_is_gone() -> None:
    q = (0.0, 0.5236, 0.0, -1.5708, 0.0, 1.0472, 0.0)  # the flange looks down
    flange = Plant("iiwa14", q=q).snapshot  # 0.398 m above the base
    assert np.abs(flange.wrench).max() < 0.1
    plant = Plant("iiwa14", q=q, boxes=[Box.of("0.55,0,0.1,0.4,0.4,0.2")])
    plant.carry([PEN])  # its tip is 2 mm in the table
    plant.step(400)
    force, torque = plant.snapshot.wrench[:3], plant.snapshot.wrench[3:]
    assert force[2] > 20.0
    assert (
        np.abs(np.cross([0, 0, -0.2], force) - torque).max() < 0.02 * force[2]
    )  # as from a force at the tip
    plant.carry([])
    plant.step(600)
    assert np.abs(plant.snapshot.wrench).max() < 1.0
