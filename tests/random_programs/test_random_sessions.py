"""Random FRI sessions, judged by the plant's own record: client, line, controller and arm on the clock of the plant.

The programs of `test_random_programs.py` open sessions over UDP, by the clock of this machine: answers are late when it
is busy, and never twice in the same way. Here a seed repeats a session exactly, with what is late and lost in it.
"""

from __future__ import annotations

import os
import time
from typing import Any

import mujoco
import numpy as np
import pytest

from heptarm.fri.loop.settings import Law
from heptarm.fri.loop.user_api import Output, State
from heptarm.fri.protocol.messages import CommandMode
from heptarm.planning.seam import SLOTS
from heptarm.sim.controller.safety import StopRequest
from heptarm.values.checks import Array
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import Mode
from tests.long import few, longer
from tests.random_programs.judge import Violation, judged
from tests.sim_fri.lockstep import Lockstep
from tests.sim_fri.test_late import bad_line
from tests.sim_fri.test_taken_back import ARM, POSTURES, square

pytestmark = pytest.mark.timeout(longer(300, 8 * 3600))
#: Of the first session; the long run takes new ones.
SEED = int(os.environ.get("HEPTARM_SEED") or longer(38, time.time_ns() % 2**32))
ENDS = ("leave", "stop", "close", "silence", *StopRequest)


class Recorded(Lockstep):
    """A session with the plant's record."""

    def __init__(self, *args: Any, **settings: Any) -> None:
        self.rows: list[Array] = []
        super().__init__(*args, **settings)
        self.rows.clear()  # what follows is judged

    def _tick(self) -> None:
        super()._tick()
        self.rows.append(self.plant.shared.floats[self.plant.tick_count % SLOTS].copy())


def positions(rng: np.random.Generator) -> Law:
    """A law that steps, or swings, towards random postures."""
    goals, rate = rng.uniform(1.1 * ARM.q_min, 1.1 * ARM.q_max, (3, 7)), float(rng.choice((0.3, 1.0, 5.0)))
    swings = rng.random() < 0.5

    def law(s: State, out: Output, p: object) -> None:
        part = np.sin(rate * s.t) if swings else 1.0
        out.q[:] = out.q + part * (goals[int(2.0 * s.t) % 3] - out.q)

    return law


def kind_of_session(rng: np.random.Generator) -> tuple[Law, CommandMode, Mode | None, int]:
    """Law, what it commands, control mode underneath and period [ms]."""
    stiffness = float(rng.choice((0.0, 50.0, 100.0, 500.0, 2000.0)))
    springs = CartesianImpedance(stiffness=(stiffness,) * 3 + (0.1 * stiffness,) * 3)
    match int(rng.integers(4)):
        case 0:
            return (
                square(rng, 7, "tau"),
                CommandMode.TORQUE,
                JointImpedance(stiffness),
                int(rng.choice((1, 5))),
            )
        case 1:
            return square(rng, 6, "wrench"), CommandMode.WRENCH, springs, int(rng.choice((1, 5, 10)))
        case _:
            return positions(rng), CommandMode.POSITION, None, int(rng.choice((1, 5, 10, 20)))


def session(seed: int) -> tuple[list[Violation], float]:
    """What a session has shown, and how long it was [s]."""
    rng = np.random.default_rng(seed)
    law, command, mode, period = kind_of_session(rng)
    start = POSTURES[rng.integers(len(POSTURES))] + rng.uniform(-0.3, 0.3, 7)
    made = Recorded(law, {}, command=command, control=mode, q=tuple(start.tolist()), period_ms=period)
    made.plant.model.opt.disableflags |= (
        mujoco.mjtDisableBit.mjDSBL_CONTACT
    )  # a clash turns an axis by itself
    if rng.random() < 0.5:
        made.back = bad_line(rng, first=200 // period)
    if rng.random() < 0.3:
        made.there = bad_line(rng, first=200 // period)
    for _ in range(int(rng.integers(1, 4))):
        made.run(float(rng.uniform(0.05, 0.5)))
        if rng.random() < 0.2:
            made.plant.apply_wrench(tuple(rng.uniform(-20.0, 20.0, 3).tolist()), duration=0.1)
    end = ENDS[rng.integers(len(ENDS))]
    if isinstance(end, StopRequest):
        made.plant.safety.request_stop(end)
    else:
        made.end(end)
    made.run(0.5)
    found = judged(ARM, np.array(made.rows), compliant=command is not CommandMode.POSITION)
    return found, 1e-3 * len(made.rows)


@pytest.mark.parametrize("seed", few([1617, 1475], 1))
def test_what_was_found_once(seed: int) -> None:
    """After a load was missing for one tick the set-point went back at once, and a pulse of 320 Nm turned A5."""
    found, _ = session(seed)
    assert not found, "\n".join(map(str, found))


def test_no_session_moves_the_arm_beyond_its_limits() -> None:
    simulated = 0.0
    for seed in range(SEED, SEED + longer(3, 3000)):
        found, seconds = session(seed)
        simulated += seconds
        assert not found, f"HEPTARM_SEED={seed}, after {simulated:.0f} s:\n" + "\n".join(map(str, found))
    print(f"HEPTARM_SEED={SEED}: {simulated:.0f} s of simulated time")
