"""Random programs on one virtual cabinet, judged by the plant's own record.

hypothesis makes the programs, prints the seed of a run that fails, and shrinks it to a short one.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, seed, settings

import heptarm as ha
from heptarm.arm.link import local_simulator
from heptarm.planning.seam import TICK_NS
from tests.long import longer
from tests.random_programs.judge import Judge, Violation
from tests.random_programs.programs import Move, Outside, Posture, Step, Stream, programs, refusals

pytestmark = [pytest.mark.slow, pytest.mark.timeout(longer(600, 8 * 3600))]
HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
#: Simulated seconds per second: streams of this machine's clock have gaps, which is part of the test.
SPEED = 10
#: Simulated time and wall time after which no more programs are tried [s]: an hour in the long run, else what fits.
SIMULATED, PATIENCE = longer(200.0, 3600.0), longer(15.0, 4 * 3600.0)
EXAMPLES = longer(300, 20_000)
#: How often a busy machine may lose the connection on the way home.
_ATTEMPTS = 4
#: Of the programs; printed, and given again by the environment variable HEPTARM_SEED. The long run takes new ones.
SEED = int(os.environ.get("HEPTARM_SEED") or longer(38, time.time_ns() % 2**32))
#: Programs that this test has found, and that moved the arm beyond its limits once.
FOUND: tuple[list[Step], ...] = (
    [Stream("joint", Posture(2, (60, 15, -60, -15, 1, 60, -60)), 0.2, "step", 300, "leave", "direct")],
    [Stream("lin", Posture(0, (0,) * 7), 0.2, "step", 5, "leave", "smart")],
    [Move("lin", Posture(4, (0, 0, 0, 0, 0, 0, -60)), 1.0, "position", "override", 0.02)],
    [Move("ptp pose", Posture(6, (15, 0, 0, 15, 15, 15, -15)), 1.0, "position", "pause", 0.8)],
    [Move("home", Posture(3, (0, 0, -15, 0, 15, -15, -60)), 1.0, "position", "protective_stop", 0.8)],
    [Move("lin_rel", Posture(7, (0, 15, 0, 0, 0, 0, 1)), 0.2, "position", "emergency_stop", 0.02)],
    [Move("ptp pose", Posture(2, (0, 0, 60, -60, 0, -15, 0)), 0.2, "cartesian", "override", 0.8)] * 2,
    [Stream("joint", Posture(0, (60,) * 7), 1.0, "step", 60, "lost", "smart"), Outside("recover")],
)


class Rig:
    """A virtual cabinet with a record, and the arm of a client."""

    def __init__(self, trace: Path) -> None:
        start = local_simulator.PrivateCabinet.start

        def recorded(target, **more):  # type: ignore[no-untyped-def]
            return start(replace(target, options=(*target.options, ("trace", str(trace)))), **more)

        local_simulator.PrivateCabinet.start = recorded  # type: ignore[method-assign]
        try:
            self.arm = ha.connect(f"sim://iiwa14?speed={SPEED}", watchdog=5.0, timeout=30.0, black_box=False)
        finally:
            local_simulator.PrivateCabinet.start = start  # type: ignore[method-assign]
        self.judge = Judge(self.arm.robot, trace)
        self.programs, self.has_found, self._began = 0, False, time.monotonic()

    @property
    def is_done(self) -> bool:
        """Whether enough was tried; never once something was found, which hypothesis then shrinks."""
        return not self.has_found and (
            self.simulated >= SIMULATED or time.monotonic() - self._began > PATIENCE
        )

    @property
    def simulated(self) -> float:
        """Time that was judged [s]."""
        return self.judge.ticks * TICK_NS * 1e-9

    def __str__(self) -> str:
        """For the log."""
        return f"HEPTARM_SEED={SEED}: {self.programs} programs, {self.simulated:.0f} s of simulated time"

    def restore(self) -> None:
        """Bring the arm home, whatever a program has left; again where this machine was too busy to stay connected."""
        for _ in range(_ATTEMPTS):
            with contextlib.suppress(ha.ConnectionLost, ha.Timeout, ha.MotionAborted):
                self._go_home()
                return
        self._go_home()

    def _go_home(self) -> None:
        arm = self.arm
        arm.operator.clear()
        arm.operator.choose("aut")
        recovery = arm.recover(timeout=30.0)
        assert arm.connected and arm.in_control, recovery
        arm.stop("fast")  # what recovery has resumed
        arm.wait_for_rest(timeout=60.0)
        arm.set_override(1.0)
        arm.detach_tool()
        arm.move(ha.ptp(HOME), speed=1.0)
        arm.wait_for_rest(timeout=60.0)

    def run(self, program: list[Step]) -> list[Violation]:
        """Run a program from home; what the plant has shown meanwhile and on the way home."""
        self.programs += 1
        self.judge.skip()
        for step in program:
            with refusals():
                step.run(self.arm)
        self.restore()
        assert np.abs(self.arm.state.q - HOME).max() < 0.02, self.arm.state.q  # a push may last
        found = self.judge.violations(compliant=any(step.is_compliant for step in program))
        self.has_found = self.has_found or bool(found)
        return found


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    made = Rig(tmp_path_factory.mktemp("record") / "plant.trace")
    yield made
    print(made)
    made.arm.close()


@pytest.mark.parametrize("program", FOUND)
def test_what_was_found_once(rig: Rig, program: list[Step]) -> None:
    found = rig.run(program)
    assert not found, "\n".join(map(str, found))


@seed(SEED)
@settings(
    max_examples=EXAMPLES,
    print_blob=True,
    phases=(Phase.explicit, Phase.reuse, Phase.generate, Phase.shrink),
    suppress_health_check=list(HealthCheck),
)
@given(program=programs)
def test_no_program_moves_the_arm_beyond_its_limits(rig: Rig, program: list[Step]) -> None:
    if rig.is_done:
        return
    found = rig.run(program)
    assert not found, "\n".join(map(str, found))
