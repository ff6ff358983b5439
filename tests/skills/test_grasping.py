"""Grasps from shapes, and bins that are emptied into each other without touching anything but the parts."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from math import pi

import numpy as np
import pytest

import heptarm as ha
from heptarm import shapes
from heptarm.skills import Grasp, grasps, pick, place
from tests.long import longer
from tests.simulators import FASTER

DOWN = (0.0, 1.0, 0.0, 0.0)
GRIPPER = ha.Tool("two-finger", mass=1.0, com=(0, 0, 0.05), tcp=ha.Pose.at(0, 0, 0.16))
PART = ha.Workpiece("cube", mass=0.08)
BINS = {"left": (0.58, 0.2), "right": (0.58, -0.2)}
PARTS = ("part_1", "part_2", "part_3")
START = ha.deg(0, 25, 0, -90, 0, 65, 0)
#: Largest force of a contact with anything but the part between the fingers [N].
GENTLE = 5.0


def test_a_box_is_grasped_where_it_fits_between_the_fingers() -> None:
    found = grasps([shapes.box(0.2, 0.05, 0.03)], opening=0.08)
    assert {round(one.width, 3) for one in found} == {0.05, 0.03}
    for one in found:
        across, along = one.pose.rotation[:, 1], one.pose.rotation[:, 2]
        assert abs(across[0]) < 1e-9  # never across its length
        assert abs(across @ along) < 1e-9 and np.linalg.det(one.pose.rotation) == pytest.approx(1.0)
    assert np.linalg.norm(found[0].pose.xyz) < 1e-12  # in its middle first
    offset = next(one for one in found[::-1] if one.pose.rotation[2, 2] < -0.5)
    assert offset.pose.z > 0.0  # nearer to the face from which the gripper comes
    assert grasps([shapes.box(0.2, 0.2, 0.2)]) == ()


def test_a_cylinder_is_grasped_across_its_axis() -> None:
    at = ha.Pose.of((0.0, 0.0, 0.1), (0.0, np.sin(pi / 4), 0.0, np.cos(pi / 4)))  # along x
    found = grasps([shapes.cylinder(0.03, 0.2, at=at)])
    assert found and all(one.width == pytest.approx(0.06) for one in found)
    assert all(abs(one.pose.rotation[0, 1]) < 1e-9 for one in found)
    assert {round(abs(float(one.pose.rotation[0, 2]))) for one in found} == {
        0,
        1,
    }  # from around it, and its ends


def test_what_has_another_shape_needs_candidates() -> None:
    with pytest.raises(ha.ShapeError, match="one box or one cylinder .* got sphere"):
        grasps([shapes.sphere(0.03)])
    with pytest.raises(ha.ShapeError, match="got box, box"):
        grasps([shapes.box(0.03, 0.03, 0.03)] * 2)
    with pytest.raises(ha.LimitError, match="opening"):
        grasps([shapes.box(0.03, 0.03, 0.03)], opening=0.0)


def test_a_world_knows_pose_and_shapes_of_its_bodies() -> None:
    world = ha.CollisionModel("iiwa14", scene="bins")
    assert world.pose("part_1").xyz == pytest.approx((0.53, 0.2, 0.226))
    (cube,) = world.shapes("part_1")
    assert cube.kind == "box" and cube.size == pytest.approx((0.036,) * 3)
    at = ha.Pose.of((0.0, 0.1, 0.0), DOWN)
    can = [shapes.cylinder(0.03, 0.1, at=at), shapes.sphere(0.02), shapes.capsule(0.01, 0.2)]
    world.add("can", can, at=ha.Pose.at(0.5, 0.0, 0.5))
    found = world.shapes("can")
    assert [one.kind for one in found] == ["cylinder", "sphere", "capsule"]
    for one, given in zip(found, can, strict=True):
        assert one.size == pytest.approx(given.size) and one.pose.distance_to(given.pose) < 1e-9
    world.place("can", ha.Pose.at(0.4, 0.0, 0.5))
    assert world.pose("can").xyz == pytest.approx((0.4, 0.0, 0.5))
    assert world.held("can") is None
    world.hold("can", at)
    assert world.held("can") is at
    with pytest.raises(ha.CommandRejected, match="body must be a free body"):
        world.shapes("table")


def test_more_pairs_may_touch_in_a_view_of_a_world() -> None:
    world = ha.CollisionModel("iiwa14")
    world.add("ball", shapes.sphere(0.1), at=ha.Pose.of((0.0, 0.0, 1.2)))
    names = {one.first for one in world.touching(np.zeros(7))}
    view = world.allowing(("ball", name) for name in names)
    assert names and view.touching(np.zeros(7)) == () and world.touching(np.zeros(7))
    assert view.revision == world.revision
    with pytest.raises(ha.ShapeError, match="allowed must be pairs"):
        world.allowing([("ball",)])  # type: ignore[list-item]


@pytest.fixture(scope="module")
def arm() -> Iterator[ha.Arm]:
    with (
        ha.connect(f"sim://iiwa14?scene=bins&speed={FASTER:g}", watchdog=5.0, timeout=30.0) as arm,
        arm.tool(GRIPPER),
    ):
        arm.move(ha.ptp(START))
        yield arm


@pytest.fixture(scope="module")
def gripper(arm: ha.Arm) -> ha.TwoSignalGripper:
    return ha.TwoSignalGripper(
        arm, open="OutputX3Pin1", close="OutputX3Pin2", is_open="InputX3Pin3", is_closed="InputX3Pin4"
    )


@pytest.fixture(scope="module")
def world(arm: ha.Arm) -> ha.CollisionModel:
    world = ha.CollisionModel("iiwa14", scene="bins", margin=0.003)
    for name in PARTS:
        world.place(name, arm.operator.where(name))
    return world


def filling(bin: str, random: np.random.Generator) -> list[ha.Pose]:
    """Where three cubes are to lie in a bin: anywhere, turned in any way, with room for a finger between them."""
    places: list[np.ndarray] = []
    while len(places) < len(PARTS):
        place = BINS[bin] + random.uniform((-0.06, -0.08), (0.06, 0.08))
        if all(np.linalg.norm(place - one) > 0.075 for one in places):
            places.append(place)
    return [
        ha.Pose.of((*place, 0.2265)).rotated(a=random.uniform(-pi / 4, pi / 4), frame="tool")
        for place in places
    ]


def quarter_turns(pose: ha.Pose) -> list[ha.Pose]:
    """Poses of a cube that look the same."""
    return [pose.rotated(a=turn * pi / 2, frame="tool") for turn in range(4)]


def moved(arm: ha.Arm, gripper: ha.Gripper, world: ha.CollisionModel, left: list[str], goal: ha.Pose) -> str:
    """Move one of the parts that are left, the first that can be picked; its name."""
    for name in left:
        try:
            pick(arm, gripper, name, world=world, timeout=120.0)
        except ha.NoPath:
            continue  # another one is in the way
        with arm.attached(PART):
            reached = place(arm, gripper, name, quarter_turns(goal), world=world, timeout=120.0)
        assert arm.operator.where(name).distance_to(reached) < 5e-3
        world.place(name, arm.operator.where(name))
        return name
    raise AssertionError(f"none of {left} can be picked")


def test_bad_values_of_picking_and_placing(
    arm: ha.Arm, gripper: ha.TwoSignalGripper, world: ha.CollisionModel
) -> None:
    before = arm.wait_for_rest().q_cmd
    gripper.close()
    with pytest.raises(ha.ShapeError, match="gripper must have open, close, is_open, holds_something, got 3"):
        pick(arm, 3, "part_1", world=world)  # type: ignore[arg-type]
    with pytest.raises(ha.ShapeError, match="gripper must have"):
        place(arm, "left", "part_1", ha.Pose.at(0.6, 0.0, 0.3), world=world)  # type: ignore[arg-type]
    with pytest.raises(ha.ShapeError, match=r"candidates\[0\] must be a Grasp"):
        pick(arm, gripper, "part_1", world=world, candidates=[ha.Pose.at(z=0.1)])  # type: ignore[list-item]
    with pytest.raises(ha.CommandRejected, match="model of this robot, the iiwa14, got one of the iiwa7"):
        pick(arm, gripper, "part_1", world=ha.CollisionModel("iiwa7", scene="bins"))
    with pytest.raises(ha.CommandRejected, match="body must be a free body of the scene, one of part_1"):
        pick(arm, gripper, "part_9", world=world)
    with pytest.raises(ha.ShapeError, match="world must be a model of bodies, got 3"):
        pick(arm, gripper, "part_1", world=3)  # type: ignore[arg-type]
    with pytest.raises(ha.LimitError, match="approach must be in"):
        pick(arm, gripper, "part_1", world=world, approach=0.0)
    with pytest.raises(ha.NoPath, match="part_1 has no grasp: it is too wide"):
        pick(arm, gripper, "part_1", world=world, opening=0.03)
    with pytest.raises(ha.CommandRejected, match="the arm must hold part_1 in the world"):
        place(arm, gripper, "part_1", ha.Pose.at(0.6, 0.0, 0.3), world=world)
    far = Grasp(ha.Pose.of((0.0, 0.0, 1.5), DOWN), 0.036)
    with pytest.raises(
        ha.NoPath, match="none of 1 poses at part_1 can be reached; of the first one: goal has no"
    ):
        pick(arm, gripper, "part_1", world=world, candidates=[far])
    assert np.abs(arm.state.q_cmd - before).max() < 1e-6 and not gripper.is_open  # nothing moved


@pytest.mark.parametrize("seed", range(longer(1, 20)))
def test_parts_go_from_one_bin_into_the_other_gently(
    arm: ha.Arm, gripper: ha.TwoSignalGripper, world: ha.CollisionModel, seed: int
) -> None:
    """All three of 20 random fillings in the long run, one of one in the usual run."""
    here, there = ("left", "right") if seed % 2 == 0 else ("right", "left")
    left = list(PARTS[: longer(1, len(PARTS))])
    assert all(inside(world.pose(name), here) for name in left)
    with closing(arm.states(size=100_000)) as states:
        for goal in filling(there, np.random.default_rng(seed))[: len(left)]:
            left.remove(moved(arm, gripper, world, left, goal))
        last, forces = arm.state.stamp, []
        for state in states:
            forces.append(float(np.linalg.norm(state.wrench.force)))
            if state.stamp >= last:
                break
    assert max(forces) < GENTLE
    assert inside(arm.operator.where("part_1"), there)


def inside(pose: ha.Pose, bin: str) -> bool:
    """Whether a part is in a bin."""
    return bool((np.abs(pose.xyz[:2] - BINS[bin]) < (0.11, 0.13)).all()) and pose.z < 0.24
