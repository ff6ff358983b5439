"""Missing commands: hold, extrapolate, ramp down, each followed by the guard."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.errors import LimitError
from heptarm.fri.guard.fallback import Missing, Policy
from heptarm.fri.guard.joint_guard import Limits
from heptarm.values.robot import robot
from tests.oracles.fri.fallback import CommandFallback
from tests.oracles.fri.joint_guard import JointGuard

MS = 1_000_000
IPO = (0.0, 0.5, 0.0, -1.0, 0.0, 1.0, 0.0)
SPEED = 0.2


def moving_then_silent(
    policy: Policy, *, silent: int = 400
) -> tuple[np.ndarray, JointGuard, CommandFallback]:
    """A command a millisecond that runs at 0.2 rad/s after a gentle start, then none; sent A1, guard, fallback."""
    guard, fallback, sent = JointGuard(Limits.of(robot("iiwa14"))), CommandFallback(policy), []
    guard.start(IPO, (0.0,) * 7, period=1e-3)
    for k in range(1, 1001 + silent):
        now = 10**12 + k * MS
        if k <= 1000:
            rise = min(k / 500, 1.0)
            q1 = SPEED * 1e-3 * k * rise**2
            fallback.command(now, q=(q1, *IPO[1:]), tau=(5.0,) * 7)
        sent.append(guard.position(fallback.position_target(now, IPO))[0])
    return np.array(sent), guard, fallback


def test_without_any_command_the_interpolator_is_mirrored() -> None:
    fallback = CommandFallback(Policy())
    assert fallback.position_target(10**12, IPO) is IPO and not fallback.is_filled
    assert fallback.efforts(10**12) == (None, None)


def test_hold_stays_at_the_last_position_and_torque() -> None:
    sent, guard, fallback = moving_then_silent(Policy(Missing.HOLD), silent=800)
    assert sent[-1] == pytest.approx(0.2) and guard.is_still and fallback.is_filled
    assert fallback.efforts(10**12 + 10**10)[0] == (5.0,) * 7


def test_extrapolation_moves_on_for_a_while_and_then_stops() -> None:
    sent, guard, fallback = moving_then_silent(
        Policy(Missing.EXTRAPOLATE, patience=0.02, over=0.1), silent=600
    )
    during = sent[1000:1110]
    assert during == pytest.approx(0.2 + SPEED * 1e-3 * np.arange(1, 111), abs=1e-6)
    assert guard.is_still and fallback.is_braking and sent[-1] > during[-1]
    assert (np.diff(sent[1000:]) >= -1e-12).all(), "it never goes back"


def test_ramp_down_brakes_where_it_is_and_lets_torques_fall() -> None:
    policy = Policy(Missing.RAMP_DOWN, patience=0.0, over=0.1)
    _, guard, fallback = moving_then_silent(policy)
    assert guard.is_still and fallback.is_braking
    end = 10**12 + 1000 * MS
    for late, fraction in ((0, 1.0), (50, 0.5), (100, 0.0), (900, 0.0)):
        tau, _ = fallback.efforts(end + late * MS)
        assert tau == pytest.approx([5.0 * fraction] * 7)


def test_a_command_after_a_pause_is_taken_up_again() -> None:
    _, guard, fallback = moving_then_silent(Policy(Missing.RAMP_DOWN, patience=0.01))
    now = 10**12 + 5000 * MS
    for k in range(1000):
        fallback.command(now + k * MS, q=IPO)
        sent = guard.position(fallback.position_target(now + k * MS, IPO))
    assert tuple(sent) == IPO and not fallback.is_filled


def test_what_a_command_leaves_out_stays_as_it_was() -> None:
    fallback = CommandFallback(Policy())
    fallback.command(MS, q=(1.0,) * 7, tau=(2.0,) * 7)
    fallback.command(2 * MS, wrench=(3.0,) * 6)
    assert fallback.position_target(2 * MS, IPO) == (1.0,) * 7
    assert fallback.efforts(2 * MS) == ((2.0,) * 7, (3.0,) * 6)
    fallback.start()
    assert fallback.position_target(3 * MS, IPO) is IPO


def test_negative_durations_are_refused() -> None:
    with pytest.raises(LimitError, match="patience must be in .* s, got -1 s"):
        Policy(patience=-1.0)
