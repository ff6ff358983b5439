"""Several arms in one world: checks and paths of each know the others, and programs are checked over time."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

import heptarm as ha
from heptarm import planning, shapes
from heptarm.sim.plant.other_arm import OtherArm
from heptarm.sim.plant.world import compiled
from heptarm.values.checks import Array
from heptarm.values.pose import Pose, deg
from heptarm.values.robot import robot

IIWA = robot("iiwa14")
#: The other arm faces this one.
OTHER = Pose.of((1.2, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))
HOME, REACHING = deg(0, 30, 0, -90, 0, 60, 0), deg(0, 60, 0, -60, 0, 60, 0)
LEFT, RIGHT = deg(-40, 50, 0, -80, 0, 50, 0), deg(40, 50, 0, -80, 0, 50, 0)


@pytest.fixture(scope="module")
def world() -> ha.CollisionModel:
    return ha.CollisionModel("iiwa14", scene="two-arms").with_arm("right", robot="iiwa7")


def least_of(q: Array, other: Array) -> float:
    """Distance of the arms by MuJoCo alone: of every shape of one from every shape of the other."""
    made = compiled("iiwa14", arms=[OtherArm("right", "iiwa14", OTHER)])
    data = mujoco.MjData(made)
    data.qpos[:7], data.qpos[7:14] = q, other
    mujoco.mj_kinematics(made, data)
    roots = made.body_rootid[made.geom_bodyid]
    own, others = (
        np.flatnonzero((roots == made.body(name).id) & (made.geom_contype > 0))
        for name in ("link_0", "right/link_0")
    )
    return min(
        float(mujoco.mj_geomDistance(made, data, a, b, 5.0, None))
        for a in own.tolist()
        for b in others.tolist()
    )


def test_an_arm_touches_another_one_where_it_is(world: ha.CollisionModel) -> None:
    assert world.arms == ("right",) and "right/link_7" in world.bodies
    world.set_arm("right", deg(90, 30, 0, -90, 0, 60, 0))
    assert world.touching(REACHING) == ()
    world.set_arm("right", REACHING)
    found = world.touching(REACHING)[0]
    assert found.first.startswith("link_") and found.second.startswith("right/link_")
    assert "right/link_" in str(found) and found.distance < 0.0


def test_the_distance_of_two_arms_is_that_of_their_shapes() -> None:
    world = ha.CollisionModel("iiwa14").with_arm("right", at=OTHER)
    random = np.random.default_rng(2)
    for _ in range(5):
        q, other = HOME + random.uniform(-0.4, 0.4, 7), REACHING + random.uniform(-0.4, 0.4, 7)
        world.set_arm("right", other)
        near = [one.distance for one in world.clearances(q, below=1.0) if one.second.startswith("right/")]
        assert min(near) == pytest.approx(least_of(q, other), abs=1e-3)


def test_the_world_of_the_other_arm_is_the_same_one(world: ha.CollisionModel) -> None:
    here = world.carrying(None)
    here.add("post", shapes.sphere(0.1), at=Pose.at(0.6, 0.3, 0.6))
    here.set_arm("right", RIGHT)
    there = here.seen_by("right", own="left", q=LEFT)
    assert there.robot.name == "iiwa7" and there.arms == ("left",)
    pairs = {(one.first, one.second): one.distance for one in here.clearances(LEFT, below=0.6)}
    mirrored = {(one.first, one.second): one.distance for one in there.clearances(RIGHT, below=0.6)}
    both = [(f"link_{a}", f"link_{b}") for a in range(8) for b in range(8)]
    compared = [pair for pair in both if (pair[0], f"right/{pair[1]}") in pairs]
    assert compared
    for a, b in compared:
        assert mirrored[b, f"left/{a}"] == pytest.approx(pairs[a, f"right/{b}"], abs=1e-6)
    # the post and the table are where they were
    alone = ha.CollisionModel("iiwa7")
    alone.add("post", shapes.sphere(0.1), at=OTHER.inverse() @ Pose.at(0.6, 0.3, 0.6))
    expected = [one.distance for one in alone.clearances(RIGHT, below=1.0) if one.second == "post"]
    found = [one.distance for one in there.clearances(RIGHT, below=1.0) if one.second == "post"]
    assert sorted(found) == pytest.approx(sorted(expected), abs=1e-6)
    assert {"table", "cube", "floor"} <= {one.second for one in there.clearances(RIGHT, below=1.0)}
    back = there.seen_by("left", own="right", q=RIGHT)
    again = {(one.first, one.second): one.distance for one in back.clearances(LEFT, below=0.6)}
    assert again == pytest.approx(pairs, abs=1e-6)


def test_a_path_goes_around_the_other_arm() -> None:
    world = ha.CollisionModel("iiwa14").with_arm("right", at=OTHER, q=deg(0, 75, 0, -30, 0, 30, 0))
    start, goal = deg(-40, 60, 0, -60, 0, 60, 0), deg(40, 60, 0, -60, 0, 60, 0)
    touch = world.first_on([start, goal])
    assert touch is not None and touch.clearance.second.startswith("right/")
    path = planning.find_path(world, start=start, goal=goal, timeout=120.0)
    assert world.first_on(path.curve) is None
    with pytest.raises(ha.NoPath, match=r"goal is in collision: link_\d is \d+ mm inside right/link_\d"):
        planning.find_path(world, start=start, goal=deg(0, 75, 0, -30, 0, 30, 0))


def test_programs_that_meet_at_the_same_time_are_found_and_others_are_not() -> None:
    world = ha.CollisionModel("iiwa14").with_arm("right", at=OTHER)
    t = np.linspace(0.0, 2.0, 11)
    sweep = np.linspace(deg(-60, 60, 0, -60, 0, 60, 0), deg(60, 60, 0, -60, 0, 60, 0), 11)
    # the other one faces it: the same sweep goes the other way around, and both meet in the middle
    found = world.first_together(t, sweep, {"right": sweep[::-1]})
    assert found is not None and 0.0 < found.t < 1.6 and found.clearance.second.startswith("right/")
    dense = np.linspace(0.0, found.t, 100)
    for moment in dense.tolist()[:-3]:  # nothing touches before
        q = np.array([np.interp(moment, t, column) for column in sweep.T])
        world.set_arm("right", np.array([np.interp(moment, t, column) for column in sweep[::-1].T]))
        assert not world.touching(q)
    apart = np.repeat(deg(180 - 30, 30, 0, -90, 0, 60, 0)[None], 11, axis=0)
    assert world.first_together(t, sweep, {"right": apart}) is None
    one = world.first_together([0.0], REACHING[None], {"right": REACHING[None]})
    assert one is not None and one.t == 0.0


@pytest.mark.parametrize(
    ("keywords", "error", "match"),
    [
        ({"name": "cube"}, ha.CommandRejected, "name must be a new name"),
        ({"name": "a/b"}, ha.CommandRejected, "name must be a new name"),
        ({"name": "tool"}, ha.CommandRejected, "name must be a new name"),
        ({"name": 3}, ha.ShapeError, "name"),
        ({"name": "third"}, ha.CommandRejected, "the scene has no site of that name"),
        ({"name": "third", "at": 3}, ha.ShapeError, "at"),
        ({"at": Pose.at(0.05, 0.0, 0.0)}, ha.CommandRejected, "right/link_1 would be .* mm inside link_0"),
        ({"robot": "iiwa8"}, ha.CommandRejected, "iiwa8"),
        ({"q": deg(0, 150, 0, 0, 0, 0, 0)}, ha.LimitError, "A2 must be in"),
    ],
)
def test_arms_that_cannot_be_added(keywords: dict[str, Any], error: Any, match: str) -> None:
    world = ha.CollisionModel("iiwa14", scene="two-arms")
    with pytest.raises(error, match=match):
        world.with_arm(**({"name": "right"} | keywords))
    assert world.arms == ()


def test_what_concerns_an_arm_that_is_not_there_is_refused(world: ha.CollisionModel) -> None:
    for call in (
        lambda: world.set_arm("left", HOME),
        lambda: world.seen_by("left", own="me"),
        lambda: world.first_together([0.0], [HOME], {"left": [HOME]}),
    ):
        with pytest.raises(ha.CommandRejected, match="another arm of the world, one of right; got 'left'"):
            call()
    with pytest.raises(ha.LimitError, match="A2"):
        world.set_arm("right", deg(0, 150, 0, 0, 0, 0, 0))
    with pytest.raises(ha.ShapeError, match="same length"):
        world.first_together([0.0, 1.0], [HOME], {})
