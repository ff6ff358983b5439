"""Torques and wrenches wind the spring of the control mode: whatever ends them, or keeps them away, throws no axis."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from heptarm.fri.loop.settings import Law
from heptarm.fri.loop.user_api import Output, State
from heptarm.fri.protocol.messages import CommandMode
from heptarm.sim.controller.safety import StopRequest
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.robot import robot
from tests.long import longer
from tests.sim_fri.lockstep import Lockstep

ARM = robot("iiwa14")
POSTURES = np.radians(
    [
        [0, 30, 0, -90, 0, 60, 0],
        [20, 0, 40, -90, 0, 60, 0],
        [90, 60, 0, -60, 0, 30, 90],
        [0, 45, 0, -90, 5, 10, 0],
    ]
)
#: How answers cease, or how a session ends.
MANNERS = ("leave", "stop", "close", "silence", "late", "lost")


def square(rng: np.random.Generator, size: int, name: str) -> Law:
    """A law that knows no measure: full torques or forces, which turn round at random times."""
    size_of = 10.0 ** rng.uniform(1.0, 3.0, size) * rng.choice((-1.0, 1.0), size)
    rate, phase = float(rng.choice((0.0, 1.0, 3.0, 10.0))), rng.uniform(0.0, 6.0, size)

    def law(s: State, out: Output, p: object) -> None:
        getattr(out, name)[:] = size_of * (np.sign(np.sin(rate * s.t + phase)) if rate else 1.0)

    return law


def ended(seed: int, manner: str, *, kind: str) -> Lockstep:
    """A session of a random law, period, stiffness and posture that ends, or loses answers, at a random moment."""
    rng = np.random.default_rng(seed)
    stiffness, q = float(rng.choice((0.0, 50.0, 100.0, 300.0, 1000.0))), POSTURES[rng.integers(len(POSTURES))]
    mode: JointImpedance | CartesianImpedance
    if kind == "torque":
        mode, period = JointImpedance(stiffness), int(rng.choice((1, 5)))
        law, command = square(rng, 7, "tau"), CommandMode.TORQUE
    else:
        mode, period = (
            CartesianImpedance(stiffness=(stiffness,) * 3 + (0.1 * stiffness,) * 3),
            int(rng.choice((1, 5, 10))),
        )
        law, command = square(rng, 6, "wrench"), CommandMode.WRENCH
    start = tuple((q + rng.uniform(-0.3, 0.3, 7)).tolist())
    session = Lockstep(law, {}, command=command, control=mode, q=start, period_ms=period)
    session.plant.model.opt.disableflags |= (
        mujoco.mjtDisableBit.mjDSBL_CONTACT
    )  # a clash turns an axis by itself
    session.run(float(rng.uniform(0.1, 1.0)))
    if manner == "late":
        session.back = lambda: int(rng.integers(0, 4) * period)
    elif manner == "lost":
        for _ in range(3):
            session.lose(int(rng.integers(2, 6)) * period)
            session.run(0.08)
    else:
        session.end(manner)
    session.run(longer(0.35, 0.7))
    return session


@pytest.mark.parametrize(
    ("kind", "manner", "seed"),
    longer(
        [("torque", "silence", 3), ("wrench", "lost", 6)],
        [(kind, manner, seed) for kind in ("torque", "wrench") for manner in MANNERS for seed in range(40)],
    ),
)
def test_no_axis_is_thrown(kind: str, manner: str, seed: int) -> None:
    """Axes got up to 1.55 times their speed, and drives tripped."""
    session = ended(seed, manner, kind=kind)
    speed = np.array([abs(state.dq) / ARM.dq_max for state in session.track])
    q = np.array([state.q for state in session.track])
    assert StopRequest.DRIVE_ERROR not in session.plant.safety.stop_requests
    assert speed.max() <= 1.0, speed.max(axis=0)
    assert ((q > ARM.q_min) & (q < ARM.q_max)).all()
