"""Collisions foreseen: known postures, paths through a table, what the arm holds."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import heptarm as ha
from heptarm import model, shapes
from heptarm.values.checks import Array
from heptarm.values.pose import Pose, deg
from heptarm.values.robot import robot

IIWA = robot("iiwa14")
HOME = deg(0, 30, 0, -90, 0, 60, 0)
TABLE = "0.6,0,0.1,0.4,0.8,0.2"


def vertical(start: Array, dz: float) -> Array:
    """Joint positions along a vertical line of the flange, shape (n, 7) [rad]."""
    pose, path = Pose.from_matrix(model.forward(IIWA, start)), [start]
    for height in np.linspace(0.0, dz, max(2, round(abs(dz) / 0.01)))[1:]:
        path.append(model.solve(IIWA, Pose(pose.xyz + [0.0, 0.0, height], pose.quat), near=path[-1].tolist()))
    return np.array(path)


@pytest.fixture(scope="module")
def bare() -> ha.CollisionModel:
    return ha.CollisionModel("iiwa14", boxes=[TABLE])


@pytest.fixture(scope="module")
def table() -> ha.CollisionModel:
    return ha.CollisionModel("iiwa14", scene="table")


def pairs(found: tuple[ha.Clearance, ...]) -> set[frozenset[str]]:
    return {frozenset((one.first, one.second)) for one in found}


@pytest.mark.parametrize(
    "q", [HOME, deg(0, 0, 0, 0, 0, 0, 0), deg(90, 25, 0, -90, 0, 65, 0), deg(0, 40, 0, -60, 0, 80, 0)]
)
def test_postures_of_everyday_touch_nothing(bare: ha.CollisionModel, q: np.ndarray) -> None:
    assert bare.touching(q) == ()


def test_the_folded_arm_touches_itself(table: ha.CollisionModel) -> None:
    folded = pairs(ha.CollisionModel("iiwa14").touching(deg(-58, -115, 15, 115, -65, 70, -152)))
    assert frozenset(("link_0", "link_6")) in folded
    gripper = pairs(table.touching(deg(80, -75, 148, -115, 23, 111, 93)))
    assert frozenset(("link_1", "left_finger")) in gripper  # in the air, with nothing else near


def test_the_arm_in_the_floor_and_in_a_box(bare: ha.CollisionModel) -> None:
    lying = bare.touching(deg(180, 112, 0, 0, 0, 0, 0))
    assert frozenset(("link_7", "floor")) in pairs(lying)
    assert all(one.second == "floor" for one in lying) and lying[0].distance < -0.03
    q = model.solve(IIWA, Pose.of((0.6, 0.0, 0.15), (0.0, 1.0, 0.0, 0.0)), near=HOME.tolist())
    (found,) = (one for one in bare.touching(q) if one.first == "link_7")
    assert found.second == "box 0" and "mm inside box 0" in str(found)


def test_a_clearance_is_the_distance_of_the_shapes(bare: ha.CollisionModel) -> None:
    for height in (0.25, 0.28, 0.30):  # of the flange, whose last link is a cylinder around its axis
        q = model.solve(IIWA, Pose.of((0.6, 0.0, height), (0.0, 1.0, 0.0, 0.0)), near=HOME.tolist())
        nearest = {one.first: one.distance for one in bare.clearances(q, below=0.12) if one.second == "box 0"}
        assert nearest["link_7"] == pytest.approx(height - 0.2, abs=1e-4)
    assert bare.clearances(q, below=0.05) == ()


def test_a_path_through_the_table_is_found_where_it_enters(bare: ha.CollisionModel) -> None:
    above = model.solve(IIWA, Pose.of((0.6, 0.0, 0.4), (0.0, 1.0, 0.0, 0.0)), near=HOME.tolist())
    down = vertical(above, -0.3)
    found = bare.first_on(down)
    assert found is not None and found.clearance.second == "box 0"
    height = model.forward(IIWA, found.q)[2, 3]
    assert 0.19 < height <= 0.2 + bare.margin + 1e-6
    assert bare.first_on(down[: len(down) // 3]) is None
    assert bare.first_on(np.array([above])) is None


def test_a_contact_may_be_left_but_not_deepened(bare: ha.CollisionModel) -> None:
    inside = model.solve(IIWA, Pose.of((0.6, 0.0, 0.198), (0.0, 1.0, 0.0, 0.0)), near=HOME.tolist())
    assert bare.touching(inside)
    up, deeper = vertical(inside, 0.1), vertical(inside, -0.02)
    assert bare.first_on(up) is None
    assert bare.first_on(deeper) is not None
    assert bare.first_on(np.concatenate([up, up[::-1]])) is not None  # what was left counts again


def test_tool_and_scene_are_part_of_it(table: ha.CollisionModel) -> None:
    assert {"tool", "left_finger", "cube", "table", "link_7"} <= set(table.bodies)
    q = model.solve(IIWA, Pose.of((0.7, 0.0, 0.36), (0.0, 1.0, 0.0, 0.0)), near=HOME.tolist())
    assert pairs(table.touching(q)) == {
        frozenset(("left_finger", "table")),
        frozenset(("right_finger", "table")),
    }
    allowed = ha.CollisionModel(
        "iiwa14", scene="table", allowed=[("table", "left_finger"), ("right_finger", "table")]
    )
    assert allowed.touching(q) == ()


def test_what_the_arm_holds_moves_with_it_and_may_touch_its_gripper(table: ha.CollisionModel) -> None:
    in_hand = Pose.of((0.0, 0.0, 0.2), (0.0, 0.0, 0.0, 1.0))  # a long way out of the fingers
    q = model.solve(IIWA, Pose.of((0.7, 0.0, 0.40), (0.0, 1.0, 0.0, 0.0)), near=HOME.tolist())
    assert table.touching(q) == ()
    table.hold("cube", in_hand)
    assert pairs(table.touching(q)) == {frozenset(("cube", "table"))}
    table.hold("cube", Pose.at(0.0, 0.0, 0.16))
    assert table.touching(q) == ()  # between the fingers
    table.place("cube", Pose.at(0.7, 0.0, 0.31))
    assert pairs(table.touching(q)) == {frozenset(("cube", "tool"))}
    table.place("cube", Pose.at(0.55, 0.0, 0.22))
    with pytest.raises(ha.CommandRejected, match="one of cube, block, can; got 'table'"):
        table.hold("table", in_hand)


PEN = ha.Tool(
    "pen",
    tcp=Pose.at(0, 0, 0.2),
    shapes=[
        shapes.cylinder(0.03, 0.1, at=Pose.at(0, 0, 0.05)),
        shapes.capsule(0.01, 0.08, at=Pose.at(0, 0, 0.15)),
    ],
)


def above_the_table(height: float) -> Array:
    """Joint positions with the flange upside down so high above the base [m]."""
    return model.solve(IIWA, Pose.of((0.6, 0.0, height), (0.0, 1.0, 0.0, 0.0)), near=HOME.tolist())


def test_the_shapes_of_a_tool_are_where_its_flange_is(bare: ha.CollisionModel) -> None:
    q, loaded = above_the_table(0.43), bare.carrying(PEN)
    (found,) = loaded.clearances(q, below=0.05)  # the capsule ends 0.2 m before the flange
    assert (found.first, found.second) == ("pen", "box 0")
    assert found.distance == pytest.approx(0.03, abs=1e-6)
    assert bare.clearances(q, below=0.05) == () and "pen" not in bare.bodies
    assert bare.carrying(None).clearances(q, below=0.05) == ()
    tilted = ha.Tool("wide", shapes=[shapes.box(0.02, 0.4, 0.02, at=Pose.xyz_abc(0, 0, 0.1, 0, 0, 0.5))])
    (found,) = bare.carrying(tilted).clearances(above_the_table(0.43), below=0.1)
    lowest = 0.1 + 0.2 * np.sin(0.5) + 0.01 * np.cos(0.5)
    assert found.distance == pytest.approx(0.23 - lowest, abs=1e-6)


def test_a_path_is_refused_because_of_the_tool_alone(bare: ha.CollisionModel) -> None:
    down = vertical(above_the_table(0.5), -0.15)
    assert bare.first_on(down) is None
    found = bare.carrying(PEN).first_on(down)
    assert found is not None and found.clearance.first == "pen"
    assert model.forward(IIWA, found.q)[2, 3] == pytest.approx(0.4 + bare.margin, abs=0.01)


def test_a_tool_touches_the_arm_that_carries_it() -> None:
    alone, folded = ha.CollisionModel("iiwa14"), deg(0, 50, 0, -118, 0, 80, 0)
    assert alone.touching(folded) == ()
    assert pairs(alone.carrying(PEN).touching(folded)) == {frozenset(("link_0", "pen"))}


def test_a_workpiece_is_held_by_the_tcp_or_where_it_is_said_to_be(bare: ha.CollisionModel) -> None:
    part, q = ha.Workpiece("part", shapes=[shapes.box(0.04, 0.04, 0.04)]), above_the_table(0.45)
    nearest = {one.first: one.distance for one in bare.carrying(PEN, part).clearances(q)}
    assert nearest == pytest.approx({"part": 0.03, "pen": 0.05}, abs=1e-6)
    at = Pose.at(0.1, 0, 0.15)
    nearest = {one.first: one.distance for one in bare.carrying(PEN, part, at=at).clearances(q)}
    assert nearest == pytest.approx({"part": 0.08, "pen": 0.05}, abs=1e-6)
    assert bare.carrying(None, part).clearances(above_the_table(0.25))[0].first == "part"


def test_a_model_that_carries_a_tool_has_the_scene_as_it_is_then() -> None:
    table = ha.CollisionModel("iiwa14", scene="table")
    table.place("cube", Pose.at(0.6, 0, 0.5))
    part = ha.Workpiece("part", shapes=[shapes.sphere(0.03)])
    loaded = table.carrying(PEN, part)  # the scene has a gripper, which is on the flange in place of the pen
    assert "part" in loaded.bodies and "pen" not in loaded.bodies
    q = above_the_table(0.71)
    assert frozenset(("part", "cube")) in pairs(loaded.touching(q))
    table.place("cube", Pose.at(0.6, 0.3, 0.3))
    assert frozenset(("part", "cube")) in pairs(loaded.touching(q))
    assert frozenset(("part", "cube")) not in pairs(table.carrying(PEN, part).touching(q))
    table.hold("cube", Pose.at(0, 0, 0.16))
    held = table.carrying(PEN)
    assert held.touching(q) == () and held.touching(above_the_table(0.36))


def test_refusals(bare: ha.CollisionModel) -> None:
    known = "bins, cage, narrow-slot, peg-in-hole, shelf, table, table-and-post, two-arms"
    with pytest.raises(ha.CommandRejected, match=f"one of {known}"):
        ha.CollisionModel("iiwa14", scene="nowhere")
    with pytest.raises(ha.CommandRejected, match="box must be"):
        ha.CollisionModel("iiwa14", boxes=["1,2"])
    with pytest.raises(ha.CommandRejected):
        ha.CollisionModel("kr6")
    with pytest.raises(ha.ShapeError, match="shape"):
        bare.first_on(HOME)
    with pytest.raises(ha.ShapeError, match="tool must be a Tool or KnownTool, got 'pen'"):
        bare.carrying("pen")  # type: ignore[arg-type]


def test_the_model_agrees_with_contacts_of_the_simulated_arm() -> None:
    """What touches in the collision model makes contact in MuJoCo, and the other way round, at random postures."""
    from heptarm.sim.plant.world import Box, compiled

    arm = ha.CollisionModel("iiwa14", boxes=[TABLE], margin=0.0)
    world = compiled("iiwa14", [Box.of(TABLE)])
    data = mujoco.MjData(world)
    random, touching = np.random.default_rng(3), 0
    for _ in range(300):
        q = random.uniform(IIWA.q_min, IIWA.q_max)
        data.qpos[:] = q
        mujoco.mj_forward(world, data)
        deepest = min((one.dist for one in data.contact[: data.ncon]), default=1.0)
        if abs(deepest) > 1e-9:
            assert bool(arm.touching(q)) == (deepest < 0.0)
        touching += deepest < 0.0
    assert 20 < touching < 280
