"""Poses by the client's whole loop, through the stand-alone controller 2.5 to the simulated arm."""

from __future__ import annotations

import math
import socket
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from heptarm.fri.guard.fallback import Missing, Policy
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.cycle import Cycle
from heptarm.fri.loop.settings import Law, LoopSettings
from heptarm.fri.loop.user_api import Output, Params, State
from heptarm.fri.protocol.messages import CommandMode
from heptarm.fri.protocol.version import Version
from heptarm.io.shared import MemoryBlock
from heptarm.model.kinematics import forward
from heptarm.sim.fri.sessions import PlantArm
from heptarm.sim.fri.settings import SessionConfiguration, describe
from heptarm.sim.plant.plant import Plant
from heptarm.sim.runtime.standalone_fri import Standalone, StandaloneSettings
from heptarm.values.checks import Array
from heptarm.values.pose import Pose
from tests.sim_fri.rig import READY
from tests.sim_fri.rig import State as Session

HERE = "127.0.0.1"
EPOCH = 10**12
NAN = math.nan


class Both:
    """Controller, plant and the client's loop, one after the other on the ticks' clock; between them is a network."""

    def __init__(self, law: Law | None) -> None:
        settings = LoopSettings(law=law, policy=Policy(Missing.HOLD, patience=1e6), history=64)
        block = MemoryBlock(at.Layout.words(**settings.sizes))
        block.unlink()
        self.layout = at.Layout(block, **settings.sizes)
        self.plant = Plant("iiwa14", q=READY)
        self.cycle = Cycle(self.layout, settings)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((HERE, 0))
        self.socket.settimeout(20.0)
        self.said: list[str] = []
        self.track: list[Array] = []  # position of the flange, shape (3,) [m]
        standalone = StandaloneSettings(
            configuration=SessionConfiguration(Version.V2_5, 1),
            client=self.socket.getsockname(),
            port=0,
            command=CommandMode.CARTESIAN_POSE,
            speed=0.0,
        )
        self.controller = Standalone(
            PlantArm(self.plant), standalone, listener=lambda event: self.said.append(describe(event))
        )

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 1e3)):
            self.controller.tick()
            datagram, sender = self.socket.recvfrom(2048)
            now = EPOCH + self.plant.time_ns
            answer = self.cycle.turn(datagram, now)
            if answer is not None:
                self.socket.sendto(answer, sender)
            self.cycle.finish(now + 50_000)
            self.track.append(self.flange[:3, 3])

    @property
    def flange(self) -> Array:
        return forward(self.plant.robot, self.plant.snapshot.q)

    def command(self, pose: Array) -> None:
        """The command of the user's process, shape (7,) [m, x y z w]."""
        numbers = np.zeros(at.COMMAND_WORDS)
        numbers[at.C_POSE : at.C_POSE + 7] = pose
        ints = numbers.view(np.int64)
        ints[at.C_AT : at.C_GIVEN + 1] = EPOCH + self.plant.time_ns, at.GIVEN_POSE
        ints[at.C_EPOCH] = self.layout.header[at.EPOCH]
        self.layout.commands.write(numbers[1:])

    @property
    def limited(self) -> list[str]:
        return at.report_lines(self.layout)

    @property
    def is_commanding(self) -> bool:
        return self.controller.server.controller.state is Session.COMMANDING_ACTIVE


@contextmanager
def session(law: Law | None = None) -> Iterator[Both]:
    """Until commands become effective."""
    both = Both(law)
    both.controller.server.open()
    try:
        for _ in range(3000):
            if both.is_commanding:
                break
            both.run(1e-3)
        assert both.is_commanding
        both.track.clear()
        yield both
    finally:
        both.controller.server.release()
        both.socket.close()


def there_and_back(state: State, out: Output, params: Params) -> None:
    out.pose[2] -= 0.025 * (1.0 - math.cos(math.pi * min(state.t, 2.0)))


def test_a_law_moves_the_flange_5_cm_and_back() -> None:
    with session(there_and_back) as both:
        start = both.flange
        both.run(1.0)
        assert both.flange[:3, 3] - start[:3, 3] == pytest.approx((0.0, 0.0, -0.05), abs=5e-4)
        both.run(1.3)
        assert both.flange == pytest.approx(start, abs=1e-5)
        away = np.array(both.track) - start[:3, 3]
        assert np.abs(away[:, :2]).max() < 5e-4, "along a line"
        assert both.limited == [] and both.is_commanding


def elbow(state: State, out: Output, params: Params) -> None:
    out.e1 += 0.15 * (1.0 - math.cos(math.pi * min(state.t, 1.0)))


def test_the_elbow_turns_about_a_flange_that_stays() -> None:
    with session(elbow) as both:
        start, before = both.flange, both.plant.snapshot.q.copy()
        both.run(1.2)
        assert both.flange == pytest.approx(start, abs=2e-3)
        assert both.plant.snapshot.q[2] - before[2] == pytest.approx(0.3, abs=2e-3)
        assert both.limited == [] and both.is_commanding


def test_a_step_of_half_a_metre_and_numbers_that_are_none() -> None:
    with session() as both:
        start = Pose.from_matrix(both.flange)
        both.command(np.full(7, NAN))
        both.run(0.1)
        assert both.flange == pytest.approx(start.matrix, abs=1e-6)
        goal = start.array + (0.0, -0.5, 0.0, 0.0, 0.0, 0.0, 0.0)
        both.command(goal)
        both.run(1.0)
        both.command(np.full(7, NAN))  # the step is the last command
        both.run(1.6)
        assert both.flange == pytest.approx(Pose.of(goal[:3], goal[3:]).matrix, abs=1e-4)
        speeds = np.diff(np.array(both.track), axis=0) * 1e3
        assert 0.24 < np.linalg.norm(speeds, axis=1).max() < 0.26
        assert any("flange: velocity limited" in line and "0.25 allowed" in line for line in both.limited)
        assert any("rotation: target not finite" in line for line in both.limited)
        assert both.is_commanding and not any("overlay ended" in line for line in both.said)
