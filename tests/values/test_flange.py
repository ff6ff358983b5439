"""Media flanges: a property of the robot, which its kinematics, masses and names follow."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.errors import CommandRejected, LimitError
from heptarm.model import forward, gravity, solve
from heptarm.values.pose import deg
from heptarm.values.robot import FLANGES, ROBOTS, flange, known_robot, robot

Q = deg(10, 20, 30, -80, 20, 40, 50)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_media_flange_touch_is_152_mm_from_the_wrist(name: str) -> None:
    plain, touch = robot(name), robot(name, flange="touch")
    assert plain.d_wf == 0.126 and touch.d_wf == 0.152
    assert touch.name == f"{name}+touch" and touch.base_name == name and touch.flange is FLANGES["touch"]
    near, far = forward(plain, Q), forward(touch, Q)
    assert near[:3, :3].T @ (far - near)[:3, 3] == pytest.approx([0, 0, 0.026])
    assert np.allclose(solve(touch, far, near=Q), Q, atol=1e-9)


def test_a_flange_adds_a_mass_that_lies_on_it() -> None:
    plain, touch = robot("iiwa14"), robot("iiwa14+touch")
    added = FLANGES["touch"].body
    assert touch.links.mass[6] - plain.links.mass[6] == pytest.approx(added.mass)
    assert 0.2 < added.mass < 0.5
    q = deg(0, 90, 0, 0, 0, 0, 0)  # stretched out: the mass has the longest lever
    lever = 0.42 + 0.4 + 0.126 + added.com[2]
    more = np.abs(gravity(touch, q) - gravity(plain, q))[1]
    assert more == pytest.approx(added.mass * 9.81 * lever, rel=2e-3)


def test_a_plain_flange_is_the_robot_of_the_table() -> None:
    touch = robot("med7", flange="touch")
    assert robot("med7", flange="plain") is ROBOTS["med7"]
    back = touch.with_flange(FLANGES["plain"])
    assert back.name == "med7" and back.d_wf == 0.126
    for name in ("mass", "com", "inertia", "flange"):
        assert (getattr(back.links, name) == getattr(ROBOTS["med7"].links, name)).all(), name


def test_a_height_names_another_flange() -> None:
    one = robot("iiwa7", flange=0.0123)
    assert one.name == "iiwa7+0.0123" and one.d_wf == pytest.approx(0.1383)
    again = known_robot(one.name)
    assert again is not None and again.d_wf == one.d_wf
    assert flange(0.026) is FLANGES["touch"] and flange("0.026") is FLANGES["touch"]


def test_what_is_no_flange_is_refused() -> None:
    with pytest.raises(CommandRejected, match=r"flange must be one of plain, touch, or .* got 'inside'") as e:
        robot("iiwa14", flange="inside")
    assert e.value.parameter == "flange"
    for height in (-0.001, 26, float("nan")):
        with pytest.raises(LimitError, match="flange must be in"):
            flange(height)
    with pytest.raises(LimitError, match="did you mean 26 mm"):
        flange(26.0)
    with pytest.raises(
        CommandRejected, match="flange must be touch, which the robot iiwa14.touch has, got plain"
    ):
        robot("iiwa14+touch", flange="plain")
    assert known_robot("iiwa14+inside") is None and known_robot("") is None
