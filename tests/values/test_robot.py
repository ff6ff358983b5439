"""The table of robots."""

from __future__ import annotations

import copy
import pickle
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from heptarm.errors import CommandRejected, LimitError
from heptarm.values.pose import deg
from heptarm.values.robot import ROBOTS, RobotModel, robot


@pytest.mark.parametrize("model", ROBOTS.values(), ids=list(ROBOTS))
def test_table(model: RobotModel) -> None:
    assert robot(model.name) is model
    assert (model.q_min == -model.q_max).all()
    for values in (model.q_max, model.dq_max, model.ddq_max, model.dddq_max, model.tau_max):
        assert values.shape == (7,)
        assert (values > 0).all()
        assert not values.flags.writeable
    model.check(np.zeros(7))
    model.check(model.q_max)


@pytest.mark.parametrize(("arm", "med", "ratio"), [("iiwa7", "med7", 0.9639), ("iiwa14", "med14", 1.05707)])
def test_the_links_of_a_med_are_those_of_its_sister_of_another_density(
    arm: str, med: str, ratio: float
) -> None:
    one, other = robot(arm).links, robot(med).links
    np.testing.assert_allclose(other.mass / one.mass, ratio, rtol=3e-5)
    np.testing.assert_allclose(other.com, one.com, atol=1e-5)
    np.testing.assert_allclose(other.inertia, ratio * one.inertia, rtol=5e-3, atol=3e-6)


def test_check_names_axis_value_and_range() -> None:
    with pytest.raises(
        LimitError, match=r"A4 must be in \[-120, 120\] deg on the LBR iiwa 14 R820, got 125.00 deg"
    ) as e:
        robot("iiwa14").check(deg(0, 0, 0, 125, 0, 0, 0), "items[0].motion.q")
    assert e.value.parameter == "items[0].motion.q[3]"
    assert e.value.code == 50
    with pytest.raises(LimitError, match="A1 must .*got nan"):
        robot("iiwa14").check(np.full(7, np.nan))


def test_unknown() -> None:
    with pytest.raises(CommandRejected, match="robot must be one of iiwa7, iiwa14, med7, med14, got 'ur5'"):
        robot("ur5")


def test_a_copy_of_a_model_equals_it_and_another_robot_does_not() -> None:
    model, other = robot("iiwa14"), robot("iiwa7")
    for copied in (copy.copy(model), copy.deepcopy(model), pickle.loads(pickle.dumps(model))):
        assert copied == model and hash(copied) == hash(model) and copied != other
    assert replace(model, d_wf=model.d_wf + 0.01) != model


@pytest.mark.parametrize(("name", "words"), [("q_max", "q_max of a RobotModel"), ("qmax", "has no 'qmax'")])
def test_nothing_of_a_value_can_be_set(name: str, words: str) -> None:
    """A name that it has not ended in "TypeError: super(type, obj)": frozen dataclasses with slots do that."""
    with pytest.raises(FrozenInstanceError, match=words):
        setattr(robot("iiwa14"), name, 1.0)
