"""An arm whose numbers a test hides in the simulator, or draws, and recordings of it."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from heptarm import model
from heptarm.calibration import ArmSamples, FittedArm, FittedNumbers
from heptarm.calibration.excitation import next_posture
from heptarm.record.fri_commands import FriCommands
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.fri.limits import CommandInterpolator
from heptarm.sim.plant.plant import Plant
from heptarm.sim.plant.sensor_errors import sensor_errors
from heptarm.values.checks import Array
from heptarm.values.fitted_arm import QUANTITIES
from heptarm.values.pose import deg
from heptarm.values.robot import robot
from tests.sim import motions

IIWA = robot("iiwa14")
START = deg(0, 30, 0, -90, 0, 60, 0)
#: Quantities of an arm whose standard deviations are looked at.
TWO_SIGMA = (
    "coulomb",
    "breakaway",
    "viscous",
    "asymmetry",
    "rotor",
    "torque_offset",
    "torque_gain",
    "stiffness",
)
#: Speed of the fastest motions, a fraction of each axis' maximum.
FAST = 0.5


def number(name: str, value: object) -> FittedNumbers:
    """A quantity without a standard deviation."""
    size = QUANTITIES[name].size
    return FittedNumbers(name, np.broadcast_to(np.asarray(value, float), size).copy(), np.full(size, np.nan))


HIDDEN = FittedArm(
    "iiwa14",
    (
        number("coulomb", [0.9, 0.8, 0.5, 0.6, 0.4, 0.15, 0.12]),
        number("breakaway", [1.3, 1.2, 0.7, 0.9, 0.6, 0.22, 0.18]),
        number("viscous", [1.5, 1.2, 0.8, 1.0, 0.6, 0.3, 0.25]),
        number("asymmetry", [0.1, -0.1, 0.05, 0.0, 0.03, -0.01, 0.01]),
        number("transition", 0.008),
        number("stribeck", 0.04),
        number("stiffness", [11000, 12000, 8000, 9000, 6000, 4000, 4500]),
        number("rotor", 0.2),
        number("torque_offset", [0.5, -0.8, 0.3, 0.4, -0.2, 0.1, -0.05]),
        number("torque_gain", [0.005, -0.008, 0.006, 0.01, 0.002, -0.004, 0.005]),
        number("torque_noise", [0.13, 0.13, 0.07, 0.07, 0.04, 0.016, 0.016]),
        number("position_noise", 1e-5),
        number("state_delay", 0.002),
    ),
)


def postures(seed: int) -> Iterator[tuple[Array, float]]:
    """Endless postures of an excitation, and the relative speed to each."""
    random, before = np.random.default_rng(seed), START
    for turn in itertools.count():
        before, part = next_posture(IIWA, START, before, reach=0.6, turn=turn, random=random)
        yield before, part


def recorded(arm: FittedArm, seconds: float, *, seed: int = 0) -> ArmSamples:
    """States of each tick of a plant like an arm, while it is excited."""
    plant = Plant("iiwa14", q=tuple(START.tolist()), errors=sensor_errors(IIWA, "ideal", arm), fitted=arm)
    rows: list[Array] = []
    for order, (q, part) in enumerate(postures(seed), 1):
        speeds = (part * FAST,) * 7
        plant.submit(MotionCommand(order, motions.ptp(tuple(q.tolist()), joint_velocity=speeds)))
        while not plant.idle:
            plant.tick()
            x = plant.snapshot
            rows.append(np.concatenate([[x.time], x.q, x.q_cmd, x.tau, x.tau_ext, x.tau_cmd]))
        if len(rows) > 1000 * seconds:
            break
    return _samples(np.array(rows))


def _samples(table: Array) -> ArmSamples:
    q, q_cmd, tau, tau_ext, tau_cmd = np.split(table[:, 1:], 5, axis=1)
    return ArmSamples(table[:, 0].copy(), q, q_cmd, tau, tau_ext, tau_cmd)


#: Rate of samples that are computed without a simulator [Hz].
_RATE = 250.0


def trajectory(seconds: float) -> tuple[Array, Array, Array, Array, Array]:
    """Times, positions, velocities, accelerations and torques of the rigid arm while it is excited."""
    legs, before, spent = [], START, 0.0
    for q, part in postures(3):
        # quintic, 1.875 times as fast in its middle as on average
        duration = max(1.875 * float((np.abs(q - before) / (part * FAST * IIWA.dq_max)).max()), 0.3)
        x = np.arange(0.0, 1.0, 1.0 / (_RATE * duration))[:, None]
        leg, by = q - before, duration
        legs.append(
            np.concatenate(
                [
                    before + leg * x**3 * (10 - 15 * x + 6 * x**2),
                    leg * 30 * x**2 * (1 - x) ** 2 / by,
                    leg * 60 * x * (1 - x) * (1 - 2 * x) / by**2,
                ],
                axis=1,
            )
        )
        before, spent = q, spent + duration
        if spent > seconds:
            break
    q, dq, ddq = np.split(np.concatenate(legs), 3, axis=1)
    rigid = np.array([model.inverse_dynamics(IIWA, *row) for row in zip(q, dq, ddq, strict=True)])
    return np.arange(len(q)) / _RATE, q, dq, ddq, rigid


def drawn(seed: int) -> FittedArm:
    """An arm whose numbers are drawn at random."""
    random = np.random.default_rng(seed)
    size = IIWA.tau_max * random.uniform(0.7, 1.4, 7)
    return FittedArm(
        "iiwa14",
        (
            number("coulomb", 0.003 * size),
            number("breakaway", 0.003 * size * random.uniform(1.3, 1.8)),
            number("viscous", 0.006 * size),
            number("asymmetry", 0.0003 * size * random.uniform(-1, 1, 7)),
            number("transition", random.uniform(0.006, 0.015)),
            number("stribeck", random.uniform(0.04, 0.06)),
            number("stiffness", np.array([15, 15, 10, 10, 7.5, 5, 5]) * 1e3 * random.uniform(0.6, 1.2, 7)),
            number("rotor", random.uniform(0.1, 0.3, 7)),
            number("torque_offset", random.normal(0.0, 0.004, 7) * IIWA.tau_max),
            number("torque_gain", random.normal(0.0, 0.006, 7)),
            number("torque_noise", 0.0004 * IIWA.tau_max),
            number("position_noise", 1e-5),
        ),
    )


def held_up(arm: FittedArm, of: tuple[Array, Array, Array, Array, Array]) -> Array:
    """Torques of the load that the load data lack, shape (n, 7) [Nm]."""
    if arm.load is None:
        return np.zeros_like(of[4])
    rows = zip(*of[1:4], strict=True)
    return np.array([model.inverse_dynamics(IIWA, *row, load=arm.load) for row in rows]) - of[4]


def computed(arm: FittedArm, of: tuple[Array, Array, Array, Array, Array], *, seed: int) -> ArmSamples:
    """What an arm would report along a trajectory; the joints are wound at once."""
    random = np.random.default_rng(seed)
    t, q, dq, ddq, rigid = of
    friction = arm.friction
    assert friction is not None
    loss = friction.at(dq)
    without, rigid = rigid, rigid + held_up(arm, of)
    noise = arm.value("torque_noise", 0.0) * random.standard_normal(q.shape)
    shown = rigid * (1.0 + arm.value("torque_gain", 0.0)) + arm.value("torque_offset", 0.0) + noise
    wound = (loss + rigid - without) / arm["stiffness"].value
    measured = q - wound + arm.value("position_noise", 0.0) * random.standard_normal(q.shape)
    return ArmSamples(t, measured, q, shown, without - shown, rigid + loss + arm["rotor"].value * ddq)


def commanded(
    arm: FittedArm, *, seed: int, period_ms: int = 2, seconds: float = 2.0, has_set_points: bool = True
) -> FriCommands:
    """What FRI cycles show of an arm whose client swings two axes; the joints are wound at once.

    Args:
        arm: its delays, friction, stiffness and noise act.
        seed: draws the motion and the noise.
        period_ms: of the client's answers; a message is sent every millisecond.
        seconds: duration.
        has_set_points: the version of FRI sends them.
    """
    random, ticks = np.random.default_rng(seed), round(1e3 * seconds)
    late, shown = (
        round(1e3 * float(arm.value(name, 0.0)[0])) for name in ("fri_command_delay", "state_delay")
    )
    t: Array = 1e-3 * np.arange(ticks, dtype=np.float64)
    wanted, asked = np.tile(START, (ticks, 1)), t // (1e-3 * period_ms) * 1e-3 * period_ms
    for axis in (4, 6):
        size, speed = random.uniform(0.05, 0.1), random.uniform(2.5, 4.0)
        wanted[:, axis] += 0.5 * size * (1.0 - np.cos(speed * asked))
    interpolator = CommandInterpolator(IIWA, START.copy(), ticks=period_ms)
    points = [START] * (late + 1)
    for tick in range(ticks - late - 1):
        if tick >= 1 and (tick - 1) % period_ms == 0:
            interpolator.command(wanted[tick - 1], after=period_ms)
        points.append(interpolator.tick())
    q_cmd = np.array(points)
    dq = np.gradient(q_cmd, 1e-3, axis=0)
    friction, noise = arm.friction, arm.value("position_noise", 0.0) * random.standard_normal(q_cmd.shape)
    wound = 0.0 if friction is None else friction.at(dq) / arm["stiffness"].value
    q = np.roll(q_cmd - wound, shown, axis=0) + noise
    q[:shown] = START
    sent = np.where((np.arange(ticks) % period_ms == 0)[:, None], wanted, np.nan)
    none = np.full_like(q, np.nan)
    return FriCommands(
        0.0,
        1e-3,
        t,
        np.isfinite(sent[:, 0]),
        q,
        q_cmd if has_set_points else none,
        sent,
        none,
        none[:, :6],
    )
