"""The stored problem sets: what they promise of each problem, and searches that solve some of them again."""

from __future__ import annotations

import numpy as np
import pytest

from bench.planning.problems import CLEAR, COUNT, SCENES, problems, world_of
from heptarm import planning
from tests.long import longer


@pytest.mark.parametrize("scene", SCENES)
def test_each_problem_is_free_at_its_ends_and_not_between(scene: str) -> None:
    world, posed = world_of(scene), problems(scene)
    ends = np.array([(one.start, one.goal) for one in posed])
    assert ends.shape == (COUNT, 2, 7)
    assert len(np.unique(ends.reshape(-1, 7), axis=0)) == 2 * COUNT
    assert np.isinf(world.distances(ends.reshape(-1, 7), below=CLEAR)).all()
    for one in posed:
        world.robot.check(one.start, "start")
        world.robot.check(one.goal, "goal")
        assert not world.is_free(one.start, one.goal)
        assert one.length >= np.linalg.norm(one.goal - one.start)
        assert "heptarm" in one.solved_by


@pytest.mark.parametrize("scene", SCENES)
def test_searches_solve_some_problems_again(scene: str) -> None:
    world = world_of(scene)
    for one in problems(scene)[: longer(2, 100)]:
        path = planning.find_path(world, start=one.start, goal=one.goal, timeout=120.0, states=200_000)
        assert (path.start == one.start).all() and (path.end == one.goal).all()
        assert world.distances(path.curve, below=world.margin).min() >= world.margin
        assert world.first_on(path.curve) is None
