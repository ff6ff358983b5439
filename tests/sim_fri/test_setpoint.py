"""The set-point between commands, and without commands."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.sim.fri.limits import COAST, OVERSPEED, CommandInterpolator
from heptarm.values.checks import Array
from heptarm.values.robot import robot

ARM = robot("iiwa14")
ZERO = np.zeros(7)


def along(set_point: CommandInterpolator, ticks: int) -> Array:
    """A1 in each of so many ticks."""
    return np.array([set_point.tick()[0] for _ in range(ticks)])


def a1(value: float) -> Array:
    return np.array((value, *(0.0,) * 6))


def steady(ticks: int, speed: float, commands: int = 20) -> CommandInterpolator:
    """A set-point that follows commands of a steady speed [rad/s]."""
    set_point = CommandInterpolator(ARM, ZERO, ticks=ticks)
    for index in range(1, commands + 1):
        set_point.command(a1(index * ticks * 1e-3 * speed), after=ticks)
        if index < commands:
            along(set_point, ticks)
    return set_point


def test_at_1_ms_a_command_is_taken_as_it_is() -> None:
    set_point = CommandInterpolator(ARM, ZERO, ticks=1)
    for value in (1e-3, 1.5e-3, 0.0):
        set_point.command(a1(value), after=1)
        assert along(set_point, 1) == pytest.approx([value], abs=1e-15)


@pytest.mark.parametrize("ticks", [2, 5, 10, 100])
def test_a_steady_speed_stays_steady_between_commands(ticks: int) -> None:
    path = along(steady(ticks, 0.5), ticks)
    assert np.diff(path) == pytest.approx(0.5e-3, rel=1e-6)


@pytest.mark.parametrize("ticks", [1, 10])
def test_it_goes_on_a_while_then_brakes_within_the_axes_acceleration(ticks: int) -> None:
    set_point = steady(ticks, 0.5)
    path = along(set_point, 400)
    speed = np.diff(path) * 1e3
    coast = ticks + max(COAST, 2 * ticks)
    assert speed[: coast - 1] == pytest.approx(0.5, rel=1e-6)
    assert speed[-1] == 0.0 and (np.diff(speed) <= 1e-9).all()
    assert float(np.abs(np.diff(speed)).max()) * 1e3 <= ARM.ddq_max[0] + 1e-6


def test_it_coasts_no_further_than_a_limit() -> None:
    set_point = CommandInterpolator(ARM, a1(ARM.q_max[0] - 2e-3), ticks=1)
    set_point.command(a1(ARM.q_max[0] - 1e-3), after=1)
    path = along(set_point, 50)
    assert path[-1] == ARM.q_max[0] and path.max() == ARM.q_max[0]


def test_it_comes_back_to_commands_without_a_leap() -> None:
    set_point = CommandInterpolator(ARM, ZERO, ticks=1)
    set_point.command(a1(0.05), after=60)
    path = np.concatenate([[0.0], along(set_point, 1)])
    set_point.command(a1(0.05), after=1)
    path = np.concatenate([path, along(set_point, 1)])
    for _ in range(60):
        set_point.command(a1(0.05), after=1)
        path = np.concatenate([path, along(set_point, 1)])
    assert path[-1] == 0.05 and float(np.abs(np.diff(path)).max()) <= OVERSPEED * ARM.dq_max[0] * 1e-3 + 1e-12
