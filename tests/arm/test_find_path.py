"""Paths around bodies on an arm: found from where it rests, followed by the cabinet, checked again before that."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm import model, planning, shapes
from heptarm.values.condition.signals import path as along
from heptarm.values.pose import Pose, deg
from heptarm.values.robot import robot
from tests.long import longer
from tests.simulators import FASTER

IIWA = robot("iiwa14")
LEFT, RIGHT = deg(-40, 50, 0, -80, 0, 50, 0), deg(40, 50, 0, -80, 0, 50, 0)
#: A path is followed so near to what was checked, in each joint [rad]: 1 mm at 0.8 m.
NEAR = 1e-3 / 0.8


@pytest.fixture(scope="module")
def arm() -> Iterator[ha.Arm]:
    with ha.connect(f"sim://iiwa14?speed={FASTER:g}", watchdog=5.0, timeout=30.0, state_rate=250) as arm:
        yield arm


@pytest.fixture(autouse=True)
def at_left(arm: ha.Arm) -> Iterator[None]:
    arm.speed, arm.collision_check = 1.0, None
    arm.move(ha.ptp(LEFT))
    yield


@pytest.fixture
def wall() -> ha.CollisionModel:
    world = ha.CollisionModel("iiwa14")
    world.add("wall", shapes.box(0.5, 0.02, 0.6), at=Pose.at(0.6, 0.0, 0.3))
    return world


def test_the_cabinet_follows_a_path_around_a_wall(arm: ha.Arm, wall: ha.CollisionModel) -> None:
    path = arm.find_path(RIGHT, avoid=wall, timeout=60.0, seed=2)
    handle = arm.start(path)
    states = list(handle.states())
    result = handle.wait()
    assert path.duration - 0.05 < result.duration  # it settles a while longer
    assert np.abs(arm.state.q_cmd - RIGHT).max() < 1e-6
    commanded = np.array([one.q_cmd for one in states])
    off = np.abs(commanded[:, None] - path.curve[None]).max(axis=2).min(axis=1)
    steps = np.abs(
        np.diff(path.curve, axis=0)
    ).max()  # the nearest place that was checked is half a step away
    assert off.max() < NEAR + 0.5 * steps
    assert wall.distances(commanded, below=0.05).min() > wall.margin - 1e-3


def test_a_path_is_previewed_and_joins_a_program(arm: ha.Arm, wall: ha.CollisionModel) -> None:
    path = arm.find_path(RIGHT, avoid=wall, timeout=60.0)
    program = [path, ha.lin_rel(z=0.05, frame="base"), ha.ptp(RIGHT)]
    preview = arm.plan(program)
    assert [one.name for one in preview.motions] == ["Path", "LinRel", "Ptp"]
    assert preview.motions[0].duration == pytest.approx(path.duration, abs=1e-6)
    assert preview.collisions == () and "Path" in str(preview)
    arm.move(program)
    assert np.abs(arm.state.q_cmd - RIGHT).max() < 1e-6


def test_a_path_is_searched_with_what_is_attached(arm: ha.Arm, wall: ha.CollisionModel) -> None:
    long = ha.Tool("long", tcp=Pose.at(0, 0, 0.2), shapes=[shapes.cylinder(0.02, 0.2, at=Pose.at(0, 0, 0.1))])
    with arm.tool(long):
        goal = Pose.of((0.5, 0.35, 0.3), (0.0, 1.0, 0.0, 0.0))
        path = arm.find_path(goal, avoid=wall, timeout=60.0)
        reached = Pose.from_matrix(model.forward(IIWA, path.end)) @ Pose.at(0, 0, 0.2)
        assert np.linalg.norm(reached.xyz - goal.xyz) < 1e-6
        assert wall.carrying(long).first_on(path.curve) is None
        arm.move(path)


def test_a_path_is_checked_again_when_the_world_has_changed(arm: ha.Arm, wall: ha.CollisionModel) -> None:
    path = arm.find_path(RIGHT, avoid=wall, timeout=60.0)
    middle = path.curve[len(path.curve) // 2]
    wall.add("crate", shapes.sphere(0.05), at=Pose.of(model.forward(IIWA, middle)[:3, 3]))
    with pytest.raises(ha.CollisionForeseen, match=r"crate.* of the path") as error:
        arm.move(path)
    assert error.value.touch.clearance.second == "crate"
    assert np.abs(arm.state.q_cmd - LEFT).max() < 1e-6  # nothing moved
    assert arm.plan(path).collisions[0].clearance.second == "crate" and arm.plan(path).is_checked
    around = arm.find_path(RIGHT, avoid=wall, timeout=60.0)
    assert wall.first_on(around.curve) is None
    wall.remove("crate")
    arm.move(path)


def test_a_path_ends_by_a_condition_and_reacts_as_other_motions(arm: ha.Arm, wall: ha.CollisionModel) -> None:
    path = arm.find_path(RIGHT, avoid=wall, timeout=60.0)
    end = along.after(0.2)
    result = arm.move(path, speed=0.2, until=end, then=ha.Retreat(0.05))
    assert result.cause is ha.Cause.CONDITION and result.stopped_by == end
    rest = model.forward(IIWA, arm.state.q_cmd)[:3, 3]
    assert (
        0.05 < np.linalg.norm(rest - model.forward(IIWA, LEFT)[:3, 3]) < 0.25
    )  # back from where it had braked
    arm.move(ha.ptp(LEFT))
    assert arm.follow(path, speed=0.2, until=end).result.stopped_by == end


def test_a_path_begins_where_the_arm_is(arm: ha.Arm, wall: ha.CollisionModel) -> None:
    path = arm.find_path(RIGHT, avoid=wall, timeout=60.0)
    with pytest.raises(ha.CommandRejected, match=r"motions\[1\]: the path must begin where the arm is"):
        arm.move([ha.ptp(RIGHT), path])
    arm.move(ha.ptp(LEFT + 0.05))
    with pytest.raises(ha.CommandRejected, match=r"got 0\.050 rad at A\d"):
        arm.move(path)
    arm.move([ha.ptp(path.start), path])


def test_a_path_of_another_robot_is_refused(arm: ha.Arm) -> None:
    other = planning.find_path(ha.CollisionModel("iiwa7"), start=LEFT, goal=LEFT + 0.05)
    with pytest.raises(
        ha.CommandRejected, match="the path must be one of this robot, the iiwa14, got .* iiwa7"
    ):
        arm.move(other)
    with pytest.raises(
        ha.CommandRejected, match="the path must be one of this robot, the iiwa14, got .* iiwa7"
    ):
        arm.plan(other)


def test_the_model_of_the_arm_is_avoided_unless_another_is_given(
    arm: ha.Arm, wall: ha.CollisionModel
) -> None:
    with pytest.raises(ha.ShapeError, match="avoid must be a model of bodies, got None"):
        arm.find_path(RIGHT)
    arm.collision_check = wall
    arm.speed = 0.5
    path = arm.find_path(RIGHT, timeout=60.0)
    slow, slower = path.duration, arm.find_path(RIGHT, speed=0.25, timeout=60.0).duration
    assert path.world is wall and slow < 0.7 * slower
    arm.speed = 1.0
    assert arm.find_path(RIGHT, timeout=60.0).duration < 0.8 * slow
    with pytest.raises(ha.CommandRejected, match="a model of this robot, the iiwa14, got one of the iiwa7"):
        arm.find_path(RIGHT, avoid=ha.CollisionModel("iiwa7"))
    with pytest.raises(ha.NoPath, match="goal is in collision"):
        arm.find_path(deg(0, 60, 0, -80, 0, 50, 0))


class Newcomer:
    """Brings a ball into the way of an arm that has begun its path.

    From then on the arm is slow until it moves along a new path, so that a slow machine has time as well.
    """

    def __init__(self, arm: ha.Arm, world: ha.CollisionModel, at: Pose, radius: float = 0.06) -> None:
        self._arm, self._world, self._at, self._radius = arm, world, at, radius
        self.is_there = self._is_slow = False

    def __call__(self, progress: float) -> None:
        if not self.is_there and progress > 0.05:
            self._arm.set_override(0.02)
            self._world.add("ball", shapes.sphere(self._radius), at=self._at)
            self.is_there = self._is_slow = True
        elif self._is_slow and progress < 0.05:
            self._arm.set_override(1.0)
            self._is_slow = False


@pytest.fixture
def full_speed(arm: ha.Arm) -> Iterator[None]:
    yield
    arm.set_override(1.0)


def on_path(path: ha.Path, fraction: float) -> Pose:
    """Where the flange is on a path, at a fraction of its distance."""
    places = np.array([model.forward(IIWA, q)[:3, 3] for q in path.curve])
    distance = np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))
    return Pose.of(places[int(np.searchsorted(distance, fraction * distance[-1]))])


@pytest.mark.parametrize("seed", range(longer(2, 20)))
def test_a_path_is_followed_around_what_comes_into_the_way(
    arm: ha.Arm, wall: ha.CollisionModel, full_speed: None, seed: int
) -> None:
    random = np.random.default_rng(seed)
    path = arm.find_path(RIGHT, avoid=wall, timeout=60.0)
    ball = on_path(path, random.uniform(0.5, 0.7)).shifted(*random.uniform(-0.03, 0.03, 3))
    first = arm.connection.feed.count
    followed = arm.follow(path, on_progress=Newcomer(arm, wall, ball))
    assert followed.result.cause is ha.Cause.FINISHED and "detour 1" in str(followed)
    assert [one.clearance.second for one in followed.detours] == ["ball"]
    assert np.abs(arm.state.q_cmd - RIGHT).max() < 1e-6
    seen = [arm.connection.build(one) for one in arm.connection.feed.kept() if one.number > first]
    commanded = np.array([one.q_cmd for one in seen])
    assert wall.distances(commanded, below=0.05).min() > wall.margin - 1e-3


def test_what_is_in_the_way_before_the_path_begins_is_gone_around(
    arm: ha.Arm, wall: ha.CollisionModel
) -> None:
    path = arm.find_path(RIGHT, avoid=wall, timeout=60.0)
    wall.add("ball", shapes.sphere(0.06), at=on_path(path, 0.6))
    followed = arm.follow(path)
    assert len(followed.detours) == 1 and wall.first_on(followed.detours[0].path.curve) is None
    assert np.abs(arm.state.q_cmd - RIGHT).max() < 1e-6


def test_what_is_not_in_the_way_changes_nothing(
    arm: ha.Arm, wall: ha.CollisionModel, full_speed: None
) -> None:
    path = arm.find_path(RIGHT, avoid=wall, timeout=60.0)
    newcomer = Newcomer(arm, wall, Pose.at(-0.6, 0.0, 0.3))

    def watched(progress: float) -> None:
        newcomer(progress)
        if newcomer.is_there:
            arm.set_override(1.0)

    followed = arm.follow(path, on_progress=watched)
    assert newcomer.is_there and followed.detours == () and followed.result.cause is ha.Cause.FINISHED


def test_an_arm_without_a_way_rests_before_what_came(
    arm: ha.Arm, wall: ha.CollisionModel, full_speed: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = arm.find_path(RIGHT, avoid=wall, timeout=60.0)
    searched: list[Any] = []

    def find_path(*given: Any, **words: Any) -> ha.Path:
        searched.append(words["start"])
        return planning.find_path(*given, **words)

    monkeypatch.setattr("heptarm.arm.motion.foresight.find_path", find_path)
    with pytest.raises(ha.NoPath, match="goal is in collision.* ball") as error:
        arm.follow(path, on_progress=Newcomer(arm, wall, on_path(path, 1.0)))
    assert error.value.reason == "goal" and len(searched) == 1
    state = arm.wait_for_rest(timeout=30.0)
    assert np.abs(state.q - RIGHT).max() > 0.1 and wall.touching(state.q) == ()


def test_a_path_that_is_followed_ends_when_it_is_stopped(
    arm: ha.Arm, wall: ha.CollisionModel, full_speed: None
) -> None:
    path = arm.find_path(RIGHT, avoid=wall, timeout=60.0)
    seen: list[float] = []
    followed = arm.follow(path, stop=lambda: max(seen, default=0.0) > 0.1, on_progress=seen.append)
    assert followed.result.cause is ha.Cause.CANCELLED
    assert np.abs(arm.state.q_cmd - RIGHT).max() > 0.1
    with pytest.raises(ha.Timeout, match="the end of the path was not reached within 0.2 s"):
        arm.set_override(0.02)
        arm.follow(arm.find_path(RIGHT, avoid=wall, timeout=60.0), timeout=0.2)


def test_a_stop_while_another_path_is_searched_is_no_pause(
    arm: ha.Arm, wall: ha.CollisionModel, full_speed: None
) -> None:
    path = arm.find_path(RIGHT, avoid=wall, timeout=60.0)
    newcomer = Newcomer(arm, wall, on_path(path, 0.6))

    def stop() -> bool:
        state = arm.state
        rests = newcomer.is_there and bool(np.abs(state.dq).max() < 1e-6)
        if rests and state.motion is not None and state.motion.active:
            arm.stop()
        return False

    with pytest.raises(ha.MotionAborted, match="was stopped"):
        arm.follow(path, stop=stop, on_progress=newcomer)
    rest = arm.wait_for_rest(timeout=30.0).q_cmd
    assert np.abs(rest - RIGHT).max() > 0.1


def test_bad_values_of_following(arm: ha.Arm, wall: ha.CollisionModel) -> None:
    path = arm.find_path(RIGHT, avoid=wall, timeout=60.0)
    with pytest.raises(ha.ShapeError, match="path must be"):
        arm.follow(ha.ptp(RIGHT))  # type: ignore[arg-type]
    with pytest.raises(ha.ShapeError, match="watch must be a model of bodies, got 3"):
        arm.follow(path, watch=3)  # type: ignore[arg-type]
    with pytest.raises(ha.LimitError, match="timeout must be in"):
        arm.follow(path, timeout=-1.0)
    arm.move(ha.ptp(LEFT + 0.05))
    with pytest.raises(ha.CommandRejected, match="the path must begin where the arm is"):
        arm.follow(path)
    assert np.abs(arm.state.q_cmd - LEFT - 0.05).max() < 1e-6
