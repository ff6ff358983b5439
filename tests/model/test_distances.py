"""Distances of shapes in C: those of MuJoCo for every pair, whatever is left out on the way; what is proven of them."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import mujoco
import numpy as np
import pytest

import heptarm as ha
from heptarm import shapes
from heptarm.model import forward
from heptarm.sim.distances import Distances
from heptarm.values.checks import Array
from heptarm.values.pose import Pose
from heptarm.values.robot import robot
from tests.long import longer

IIWA = robot("iiwa14")
#: What MuJoCo's distances are exact to [m].
EXACT = 1e-6
POSTURES = longer(60, 1000)


def postures(seed: int, count: int = POSTURES) -> Array:
    found: Array = np.random.default_rng(seed).uniform(IIWA.q_min, IIWA.q_max, (count, 7))
    return found


def crowded() -> ha.CollisionModel:
    """Bodies of every shape around an arm that carries a tool and holds a crate."""
    world = ha.CollisionModel("iiwa14", boxes=["0.5,-0.5,0.4,0.3,0.2,0.5"])
    world.add("box", shapes.box(0.3, 0.2, 0.4), at=Pose.xyz_abc(0.5, 0.2, 0.4, 0.3, 0.2, 0.1))
    world.add("can", shapes.cylinder(0.1, 0.3), at=Pose.xyz_abc(0.4, -0.3, 0.7, 0.0, 0.5, 0.0))
    world.add("rod", shapes.capsule(0.04, 0.4), at=Pose.xyz_abc(-0.4, 0.3, 0.6, 0.5, 0.0, 0.7))
    world.add(
        "hills",
        shapes.height_map(np.arange(36).reshape(6, 6) * 0.01 + 0.02, cell=0.1),
        at=Pose.at(-0.6, 0, 0),
    )
    points = np.random.default_rng(2).uniform(-0.25, 0.25, (150, 3))
    world.add_points(points, radius=0.02, at=Pose.xyz_abc(0.0, 0.6, 0.6, 1.0, 0.4, 0.2))
    world.add("crate", [shapes.box(0.08, 0.1, 0.06), shapes.sphere(0.05)], at=Pose.at(0.0, -0.9, 0.9))
    pen = ha.Tool("pen", shapes=[shapes.capsule(0.02, 0.15, at=Pose.at(0.03, 0, 0.1))])
    loaded = world.carrying(pen)
    loaded.hold("crate", Pose.xyz_abc(0.05, 0.02, 0.2, 0.3, 0.2, 0.1))
    return loaded


def scene(name: str) -> ha.CollisionModel:
    return ha.CollisionModel("iiwa14", scene=name)


@pytest.fixture(scope="module", params=["crowded", "bins", "narrow-slot"])
def world(request: pytest.FixtureRequest) -> ha.CollisionModel:
    return crowded() if request.param == "crowded" else scene(request.param)


def meeting(engine: Distances) -> set[tuple[int, int]]:
    """Pairs of shapes that MuJoCo's collision detection looks at, and that count here: one of them is of the arm.

    All shapes are balls here, since boxes have no contacts farther apart, whatever the margin.
    """
    model = engine._model.__copy__()
    data, group = mujoco.MjData(model), engine._group
    model.geom_margin[:] = model.body_margin[:] = 50.0
    model.geom_type[model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE] = mujoco.mjtGeom.mjGEOM_SPHERE
    data.qpos[:] = engine._data.qpos
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)
    found = {tuple(sorted(pair)) for pair in data.contact.geom.tolist()}
    world, tool, held = 0, 2, 3
    kinds = {pair: {int(group[pair[0]]), int(group[pair[1]])} for pair in found}
    return {pair for pair, kind in kinds.items() if kind not in ({world}, {tool, held})}


def test_the_pairs_are_those_that_mujoco_looks_at(world: ha.CollisionModel) -> None:
    engine, expected = world._distances, meeting(world._distances)
    shown, _ = engine.pairs(postures(1, 1)[0], 100.0)
    assert len(shown) == len(expected) > 50
    assert {tuple(sorted(pair)) for pair in shown.tolist()} == expected


def test_distances_are_those_of_all_pairs_tried_one_by_one(world: ha.CollisionModel) -> None:
    engine = world._distances
    model, data = engine._model, engine._data
    listed, _ = engine.pairs(postures(1, 1)[0], 100.0)
    touching = near = 0
    for q, below in zip(postures(5), np.tile([0.005, 0.1], POSTURES)):
        found, distances = engine.pairs(q, below)
        every = np.array([mujoco.mj_geomDistance(model, data, *pair, 1.0, None) for pair in listed.tolist()])
        seen = {tuple(pair): distance for pair, distance in zip(found.tolist(), distances.tolist())}
        brute = {
            tuple(pair): distance
            for pair, distance in zip(listed.tolist(), every.tolist())
            if distance < below
        }
        assert seen == brute
        (nearest,) = world.distances([q], below=below)
        assert nearest == min(brute.values(), default=np.inf)
        touching, near = touching + (nearest < 0.0), near + (0.0 <= nearest < below)
    assert touching > POSTURES // 20 and near > POSTURES // 20


def support(model: mujoco.MjModel, data: mujoco.MjData, geom: int, along: Array) -> float:
    """How far a shape extends along a direction."""
    place, turn = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
    size, inside, kind = model.geom_size[geom], turn.T @ along, mujoco.mjtGeom(model.geom_type[geom])
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        first, count = (
            int(model.mesh_vertadr[model.geom_dataid[geom]]),
            int(model.mesh_vertnum[model.geom_dataid[geom]]),
        )
        extent = (model.mesh_vert[first : first + count] @ inside).max()
    else:
        extent = {
            mujoco.mjtGeom.mjGEOM_SPHERE: size[0],
            mujoco.mjtGeom.mjGEOM_CAPSULE: size[0] + size[1] * abs(inside[2]),
            mujoco.mjtGeom.mjGEOM_CYLINDER: size[0] * np.hypot(inside[0], inside[1])
            + size[1] * abs(inside[2]),
            mujoco.mjtGeom.mjGEOM_BOX: size @ np.abs(inside),
        }[kind]
    return float(place @ along + extent)


def test_each_distance_is_proven_by_a_slab_between_the_shapes() -> None:
    """No distance is larger than the true one: along the segment between the nearest points nothing is nearer."""
    engine = crowded()._distances
    model, data, segment, proven = engine._model, engine._data, np.zeros(6), 0
    for q in postures(7):
        found, distances = engine.pairs(q, 0.1)
        for (first, second), distance in zip(found.tolist(), distances.tolist()):
            planes = model.geom_type[[first, second]] == mujoco.mjtGeom.mjGEOM_PLANE
            if distance < EXACT or planes.any():
                continue
            mujoco.mj_geomDistance(model, data, first, second, 1.0, segment)
            along = (segment[3:] - segment[:3]) / np.linalg.norm(segment[3:] - segment[:3])
            gap = -support(model, data, second, -along) - support(model, data, first, along)
            assert abs(gap - distance) < 1e-4, (first, second)
            proven += 1
    assert proven > POSTURES


def test_boxes_that_touch_are_never_free() -> None:
    """Two boxes against each other in any way; MuJoCo's collision detection has some 30 mm apart.

    A point of the surface of one is put into the other, so they do touch.
    """
    world = ha.CollisionModel("iiwa14")
    world.add("post", shapes.box(0.1, 0.06, 0.3), at=Pose.at(0.6, 0.0, 0.5))
    world.add("crate", shapes.box(0.12, 0.08, 0.2), at=Pose.at(0.0, -0.9, 0.9))
    q, random = np.array([0.0, 0.5, 0.0, -1.5, 0.0, 1.0, 0.0]), np.random.default_rng(11)
    half, other = np.array([0.05, 0.03, 0.15]), np.array([0.06, 0.04, 0.1])
    flange = Pose.from_matrix(forward(IIWA, q))
    for corner, _ in product(product((-1, 1), repeat=3), range(longer(10, 100))):
        turn = random.normal(size=4)
        turned = Pose.of((0, 0, 0), tuple(turn / np.linalg.norm(turn)))
        inside = random.uniform(-1.0, 1.0, 3) * half
        place = np.array([0.6, 0.0, 0.5]) + inside - turned.rotation @ (np.array(corner) * other)
        world.hold("crate", flange.inverse() @ Pose.of(place, turned.quat))
        assert world.distances([q], below=0.05)[0] <= EXACT
        assert any((one.first, one.second) == ("crate", "post") for one in world.touching(q))


def test_a_height_field_of_a_scene_is_refused(tmp_path: Path) -> None:
    """MuJoCo has an ellipsoid 20 mm above a height field in which it is 50 mm deep."""
    file = tmp_path / "hills.xml"
    file.write_text(
        '<mujoco><asset><hfield name="hills" nrow="5" ncol="5" size="1 1 0.2 0.1"/></asset>'
        '<worldbody><geom name="ground" type="hfield" hfield="hills"/></worldbody></mujoco>'
    )
    with pytest.raises(ha.CommandRejected, match="no height field.*geom ground.*height_map"):
        ha.CollisionModel("iiwa14", scene=str(file))
