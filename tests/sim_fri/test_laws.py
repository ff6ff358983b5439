"""Laws through the client's whole loop on the simulated arm: sine, torques, force on a table, invalid commands."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from bench.fri import laws
from bench.fri.hold import BENT, COMPLIANT, FORCE, GAP, OFFSET
from heptarm.fri.protocol.messages import CommandMode
from heptarm.model.inverse_kinematics import solve
from heptarm.model.kinematics import forward
from heptarm.values.checks import Array
from heptarm.values.mode.impedance import JointImpedance
from heptarm.values.robot import robot
from tests.sim_fri.lockstep import Lockstep

IIWA = robot("iiwa14")


def test_the_arm_follows_a_sine_within_a_milliradian() -> None:
    both = Lockstep(laws.sine, {"amplitude": 0.3, "frequency": 0.4})
    both.run(4.0)
    wanted = np.array([laws.swing(k * 1e-3, 0.3, 0.4) for k in range(len(both.track))])
    found = np.array([state.q for state in both.track]) - both.start
    assert both.ends == both.limited == []
    assert np.abs(found).max() > 0.28
    assert np.abs(found - wanted[:, None]).max() < 1e-3


def test_lost_and_late_messages_do_not_jolt_an_arm_in_motion() -> None:
    """The cabinet continues with the last speed, and so does the loop: the next set-point is not behind."""
    both = Lockstep(laws.sine, {"amplitude": 0.15, "frequency": 0.2})
    both.run(2.3)
    for ticks in (1, 2, 3, 4):
        both.lose(ticks)
        both.run(0.15)
        both.burst(ticks + 1)
        both.run(0.15)
    dq = np.array([state.dq for state in both.track])
    assert np.abs(dq).max() > 0.15 and both.ends == []
    assert np.abs(np.diff(dq, axis=0)).max() * 1e3 < 15.0


def test_torques_alone_move_the_floating_arm_and_hold_it_against_a_push() -> None:
    params = {"start": BENT, "goal": BENT + OFFSET}
    both = Lockstep(
        laws.balance, params, command=CommandMode.TORQUE, control=JointImpedance(0.0), q=tuple(BENT)
    )
    both.run(3.5)
    assert np.abs(both.plant.snapshot.q - BENT - OFFSET).max() < 1e-3
    both.plant.apply_wrench((0.0, 15.0, 0.0), duration=0.5)
    both.run(0.5)
    assert np.abs(both.plant.snapshot.q - BENT - OFFSET).max() > 0.01
    both.run(2.0)
    assert np.abs(both.plant.snapshot.q - BENT - OFFSET).max() < 1e-3
    assert both.ends == both.limited == []


def test_a_wrench_presses_on_the_table_with_its_force() -> None:
    above = forward(IIWA, BENT)
    above[2, 3] = GAP
    q = tuple(solve(IIWA, above, near=BENT.tolist()).tolist())
    both = Lockstep(laws.press, {"force": FORCE}, command=CommandMode.WRENCH, control=COMPLIANT, q=q)
    both.run(3.0)
    forces = np.array([state.wrench[2] for state in both.track])
    assert forces[0] == 0.0, "it begins above the table"
    assert np.abs(forces[1500:] - FORCE).max() < 0.5
    assert both.ends == []


def step(both: Lockstep) -> None:
    both.command(both.start + 0.5)
    both.run(1.5)
    assert np.abs(both.plant.snapshot.q - both.start - 0.5).max() < 2e-3


def no_number(both: Lockstep) -> None:
    for target in (np.full(7, np.nan), np.full(7, np.inf), both.start):
        both.command(target)
        both.run(0.2)
    assert np.abs(both.plant.snapshot.q - both.start).max() < 1e-3


def far_too_fast(both: Lockstep) -> None:
    speed = 10.0 * IIWA.dq_max * np.array([1, -1, 1, -1, 1, -1, 1])
    for k in range(100):
        both.command(both.start + speed * 1e-3 * k)
        both.run(1e-3)
    both.run(1.0)


@pytest.mark.parametrize(
    ("wild", "words"),
    [
        (step, ("velocity limited", "acceleration limited")),
        (no_number, ("not finite",)),
        (far_too_fast, ("velocity limited", "position limited")),
    ],
)
def test_wild_targets_move_the_arm_within_its_limits_and_are_named(
    wild: Callable[[Lockstep], None], words: tuple[str, ...]
) -> None:
    both = Lockstep()
    both.run(0.05)
    wild(both)
    q, dq = (np.array([getattr(state, name) for state in both.track]) for name in ("q", "dq"))
    reported: Array = np.array([state.q_cmd for state in both.track])
    assert both.ends == [], "the session lives"
    for positions in (q, reported):
        assert (positions >= IIWA.q_min).all() and (positions <= IIWA.q_max).all()
    # the drives follow with less than a percent of overshoot
    assert (np.abs(dq) <= 1.01 * IIWA.dq_max).all()
    assert (np.abs(np.diff(dq, axis=0)) <= 1.2e-3 * IIWA.ddq_max).all()
    assert (np.abs(np.diff(reported, axis=0)) <= 1e-3 * IIWA.dq_max).all()
    assert (np.abs(np.diff(reported, n=2, axis=0)) <= 1e-6 * IIWA.ddq_max * 1.001).all()
    for word in words:
        assert any(word in line for line in both.limited), both.limited
