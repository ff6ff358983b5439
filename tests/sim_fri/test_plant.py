"""Overlays on the simulated arm: the arm follows the client's commands."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import cos, pi

import numpy as np
import pytest

from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.version import Version
from heptarm.model.kinematics import forward
from heptarm.planning.seam import TICK_NS
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.fri.controller_side import Controller
from heptarm.sim.fri.overlay import MotionOverlay, control_mode
from heptarm.sim.fri.sessions import PlantArm
from heptarm.sim.fri.settings import OverlayEnded, SessionConfiguration
from heptarm.sim.plant.plant import Plant
from heptarm.values.checks import Array
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import Mode, Position
from tests.sim import motions
from tests.sim.driving import Ear
from tests.sim_fri.rig import READY, Client, Law, State, mirror

FLOATING = JointImpedance(0.0)


@dataclass
class World:
    """A plant under a session, one tick after the other."""

    period: int = 1
    client: Client = field(default_factory=lambda: Client(Version.V1_15))

    def __post_init__(self) -> None:
        self.plant = Plant("iiwa14", q=READY)
        self.arm = PlantArm(self.plant)
        self.controller = Controller(SessionConfiguration(Version.V1_15, self.period), self.arm.robot)
        self.answer: bytes | None = None
        self.q: list[Array] = []
        self.ends: list[OverlayEnded] = []
        self.controller.open()

    @property
    def now(self) -> int:
        return self.plant.time_ns

    def run(self, ticks: int) -> None:
        for _ in range(ticks):
            if self.answer is not None:
                self.controller.receive(self.answer, self.now - TICK_NS // 2)
                self.answer = None
            datagram = self.controller.tick(self.arm.reading(), self.now)
            self.arm.overlay(self.controller.superposition)
            for event in self.controller.events():
                if isinstance(event, OverlayEnded):
                    self.ends.append(event)
                    self.arm.release()
            self.plant.tick()
            self.q.append(self.plant.snapshot.q)
            if datagram is not None:
                self.answer = self.client.answer(datagram)

    def active(self, mode: m.CommandMode, control: Mode) -> None:
        while self.controller.state is not State.MONITORING_READY:
            self.run(1)
        self.arm.hold(control)
        self.controller.start(MotionOverlay(mode, control_mode(control)))
        while self.controller.state is not State.COMMANDING_ACTIVE:
            self.run(1)


def swing(world: World, amplitude: float) -> Law:
    """All axes on sines without jerk; the command at a message's time."""
    start = world.now * 1e-9

    def law(message: m.Monitoring) -> m.Command:
        assert message.monitor is not None and message.monitor.stamp is not None
        stamp = message.monitor.stamp
        time = stamp.seconds + stamp.nanoseconds * 1e-9 - start
        return replace(mirror(message), q=tuple(target(time, amplitude).tolist()))

    return law


def target(time: float, amplitude: float) -> Array:
    return np.array(READY) + amplitude * 0.5 * (1.0 - cos(2.0 * time))


@pytest.mark.parametrize(("period", "behind"), [(1, 1), (5, 6)])
def test_a_position_overlay_is_tracked_within_a_milliradian(period: int, behind: int) -> None:
    world = World(period)
    world.active(m.CommandMode.POSITION, Position())
    start, first = world.now * 1e-9, len(world.q)
    world.client.law = swing(world, 0.3)
    world.run(3000)
    assert world.ends == []
    # the state after a tick is a tick later than the message that the tick's command answers
    late = [world.q[first + k] - target((k + 1 - behind) * 1e-3, 0.3) for k in range(100, 3000)]
    assert float(np.abs(late).max()) < 1e-3 and start > 0


def overlaid(goal: tuple[float, ...], law: Law = mirror) -> tuple[World, Ear]:
    """A motion under a client's overlay, as it begins."""
    world, ear = World(), Ear()
    while world.controller.state is not State.MONITORING_READY:
        world.run(1)
    world.plant.submit(MotionCommand(1, motions.ptp(goal), is_overlaid=True, listener=ear))
    world.run(50)
    assert (world.q[-1] == world.q[0]).all(), "it waits for its client"
    world.controller.start(MotionOverlay())
    world.client.law = law
    while world.controller.state is not State.COMMANDING_ACTIVE:
        world.run(1)
    return world, ear


def test_a_client_superposes_a_sine_on_a_motion() -> None:
    """It adds to the interpolator's positions, as programs do that weave along a path."""
    goal, began, seen = tuple(np.add(READY, 0.4).tolist()), [], []

    def law(message: m.Monitoring) -> m.Command:
        assert message.ipo is not None and message.ipo.q is not None and message.monitor is not None
        assert message.monitor.stamp is not None
        time = message.monitor.stamp.seconds + message.monitor.stamp.nanoseconds * 1e-9
        began.append(time)
        seen.append(message.ipo.q)
        weave = 0.05 * (1.0 - cos(8.0 * (time - began[0])))
        return replace(mirror(message), q=(*message.ipo.q[:6], message.ipo.q[6] + weave))

    world, ear = overlaid(goal, law)
    while "done" not in ear.causes and len(world.q) < 6000:
        world.run(1)
    assert ear.causes == ["started", "done"] and world.ends == []
    path, measured = np.array(seen), np.array(world.q[-len(seen) :])
    assert path[0] == pytest.approx(READY) and path[-1] == pytest.approx(goal, abs=1e-3)
    assert (np.diff(path, axis=0) >= -1e-12).all(), "the motion beneath goes on along its path"
    assert measured[-1][:6] == pytest.approx(goal[:6], abs=2e-3)
    assert 0.09 < float((measured - path)[:, 6].max()) < 0.11


def test_a_client_that_falls_silent_amid_a_motion_stops_the_arm() -> None:
    world, _ = overlaid(tuple(np.add(READY, 1.0).tolist()))
    world.run(400)
    moved = float(np.abs(world.q[-1] - READY).max())
    world.client.answer = lambda datagram: None  # type: ignore[method-assign]
    world.run(1500)
    assert [end.cause for end in world.ends] == ["quality"]
    assert moved > 0.02 and float(np.abs(world.plant.snapshot.dq).max()) < 1e-3
    assert float(np.abs(world.q[-1] - READY).max()) < 0.9, "it does not go on by itself"


def test_a_torque_law_balances_the_floating_arm() -> None:
    world = World()
    world.active(m.CommandMode.TORQUE, FLOATING)
    goal = np.array(READY)

    def law(message: m.Monitoring) -> m.Command:
        assert message.monitor is not None and message.monitor.q is not None
        q = np.array(message.monitor.q)
        dq, law.before = (q - law.before) * 1e3, q  # type: ignore[attr-defined]
        tau = np.clip(200.0 * (goal - q) - 20.0 * dq, -30.0, 30.0)
        return replace(mirror(message), q=message.monitor.q, tau=tuple(tau.tolist()))

    law.before = goal  # type: ignore[attr-defined]
    world.client.law = law
    world.plant.apply_wrench((10.0, 0.0, 0.0), duration=0.3)
    world.run(3000)
    assert world.ends == []
    assert float(np.abs(world.plant.snapshot.q - goal).max()) < 0.02


def test_a_torque_moves_the_joint_that_it_acts_on() -> None:
    world = World()
    world.active(m.CommandMode.TORQUE, FLOATING)
    world.client.law = lambda message: replace(mirror(message), tau=(*(0.0,) * 6, 0.8))
    world.run(150)
    moved = world.plant.snapshot.q - READY
    assert moved[6] > 5e-3 and world.ends == []


def test_a_wrench_pushes_with_its_force_against_the_spring() -> None:
    world = World()
    world.active(m.CommandMode.WRENCH, CartesianImpedance((500.0, 500.0, 500.0, 50.0, 50.0, 50.0)))
    here = world.plant.snapshot.q
    world.client.law = lambda message: replace(mirror(message), wrench=(0.0, 0.0, -10.0, 0.0, 0.0, 0.0))
    world.run(2500)
    travel = forward(world.plant.robot, world.plant.snapshot.q) - forward(world.plant.robot, here)
    assert world.ends == [] and travel[2, 3] == pytest.approx(-10.0 / 500.0, abs=1e-3)


def test_an_overlay_that_ends_at_speed_brakes_within_the_axes_acceleration() -> None:
    world = World()
    world.active(m.CommandMode.POSITION, Position())
    world.client.law = swing(world, 0.5)
    world.run(int(1e3 * pi / 4))
    world.client.law = lambda message: replace(mirror(message), q=(0.0,) * 7)
    world.run(800)
    assert [end.cause for end in world.ends] == ["limit"]
    assert world.plant.idle and np.abs(world.plant.snapshot.dq).max() < 1e-3
    speed = np.diff(np.array(world.q)[-800:], axis=0) * 1e3
    acceleration = np.diff(speed, axis=0) * 1e3
    assert float(np.abs(acceleration).max()) < 1.5 * float(world.plant.robot.ddq_max[0])


def test_the_next_overlay_mirrors_where_the_arm_came_to_rest() -> None:
    world = World()
    world.active(m.CommandMode.POSITION, Position())
    world.client.law = swing(world, 0.5)
    world.run(700)
    world.controller.stop()
    world.run(500)
    rest = world.plant.snapshot.q_cmd
    world.client.law = mirror
    world.active(m.CommandMode.POSITION, Position())
    world.run(200)
    assert np.abs(world.plant.snapshot.q - rest).max() < 1e-4 and abs(rest[0] - READY[0]) > 0.1
