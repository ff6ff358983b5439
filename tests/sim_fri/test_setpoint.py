"""The set-point between commands, and without commands."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from heptarm.sim.fri.limits import COAST, CommandInterpolator
from heptarm.values.checks import Array
from heptarm.values.robot import robot
from tests.long import longer

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


def test_it_comes_back_to_commands_within_the_limits_of_the_axes() -> None:
    set_point = CommandInterpolator(ARM, ZERO, ticks=1)
    set_point.command(a1(0.0), after=1)
    path = [np.zeros(2), along(set_point, 60)]
    for number in range(400):
        set_point.command(a1(0.05), after=1 if number else 60)
        path.append(along(set_point, 1))
    speed = np.diff(np.concatenate(path)) * 1e3
    assert path[-1][0] == 0.05 and speed.max() <= ARM.dq_max[0]
    assert np.abs(np.diff(speed)).max() * 1e3 <= ARM.ddq_max[0] * 1.000001


@settings(max_examples=longer(25, 300), deadline=None)
@given(
    period=st.sampled_from((1, 2, 5, 10)),
    late=st.lists(st.one_of(st.just(0), st.integers(0, 4), st.none(), st.just(40)), min_size=5, max_size=60),
    rates=st.tuples(st.floats(1.0, 12.0), st.floats(1.0, 30.0)),
)
def test_whatever_is_late_or_lost_the_axes_keep_their_limits(
    period: int, late: list[int | None], rates: tuple[float, float]
) -> None:
    """Commands that keep 0.95 of the limits, up to a position limit; None: lost, else how many ticks late."""
    slow, quick = rates
    size = 0.475 * min(ARM.dq_max[0] / slow, ARM.ddq_max[0] / slow**2)
    more = 0.475 * min(ARM.dq_max[0] / quick, ARM.ddq_max[0] / quick**2)
    time = np.arange(len(late) + 1) * period * 1e-3
    commands = size * (1.0 - np.cos(slow * time)) + more * (1.0 - np.cos(quick * time))
    speeds = size * slow * np.sin(slow * time) + more * quick * np.sin(quick * time)
    # as a client's guard does, which knows that a cabinet goes on for a while before it brakes
    coasts = np.maximum(speeds, 0.0) * (4.0 * period + COAST) * 1e-3 + speeds**2 / (2.0 * ARM.ddq_max[0])
    commands += ARM.q_max[0] - (commands + coasts).max()
    set_point = CommandInterpolator(ARM, a1(commands[0]), ticks=period)
    arriving: dict[int, list[int]] = {}
    for number, by in enumerate(late, 1):
        if by is not None:
            arriving.setdefault(number * period + by, []).append(number)
    path, newest = [np.full(3, commands[0])], 0
    for tick in range(len(late) * period + 300):
        for number in arriving.get(tick, ()):
            if number > newest:
                by = tick - number * period
                set_point.command(a1(commands[number]), after=(number - newest) * period, late=by)
                newest = number
        path.append(along(set_point, 1))
    q = np.concatenate(path)
    speed = np.diff(q) * 1e3
    assert q.max() <= ARM.q_max[0]
    assert np.abs(speed).max() <= ARM.dq_max[0] * 1.000001
    assert np.abs(np.diff(speed)).max() * 1e3 <= ARM.ddq_max[0] * 1.000001
