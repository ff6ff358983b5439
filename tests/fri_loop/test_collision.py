"""The collision watch of the loop: both parts of the loop brake at the same torque, and name the same joint."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from heptarm.errors import ShapeError
from heptarm.fri import Client
from heptarm.fri.guard.fallback import Missing, Policy
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.native import COLLIDED
from heptarm.fri.loop.settings import LoopSettings
from heptarm.fri.protocol.messages import CommandMode
from heptarm.fri.protocol.version import Version
from heptarm.values.condition.collision import CollisionGuard
from tests.long import few
from tests.oracles.fri import codec

from .controller import IPO, Controller
from .test_native import Twins

BASELINE = (0.5,) * 7


class Touched(Controller):
    """A controller with external torques that a test sets."""

    torques: tuple[float, ...] | None = BASELINE

    def datagram(self) -> bytes:
        message = codec.decode_monitoring(super().datagram(), self.wire)
        assert message.monitor is not None
        touched = replace(message, monitor=replace(message.monitor, tau_ext=self.torques))
        return codec.encode_monitoring(touched, self.wire)


def watching(guard: CollisionGuard) -> LoopSettings:
    return LoopSettings(collision=guard, policy=Policy(Missing.HOLD, patience=1e6), history=256)


def watched(guard: CollisionGuard, wire: Version = Version.V1_15) -> tuple[Twins, Touched]:
    """Both loops with a guard, and their controller, while commands are effective and the arm moves."""
    twins = Twins(wire=wire, settings=watching(guard))
    controller = twins.pure.controller
    controller.__class__ = Touched
    assert isinstance(controller, Touched)
    twins.activate()
    for k in range(300):
        twins.command(q=np.add(IPO, 2e-6 * k * k).tolist())
        follow(twins)
    return twins, controller


def follow(twins: Twins) -> None:
    """The next message of an arm that follows its commands."""
    twins.step()
    assert twins.answer is not None
    controller = twins.pure.controller
    controller.answers[:] = [codec.decode_command(twins.answer, controller.wire)]


def with_torque(axis: int, torque: float) -> tuple[float, ...]:
    return tuple(rest + (torque if i == axis else 0.0) for i, rest in enumerate(BASELINE))


@pytest.mark.parametrize("wire", few(Version, 2))
@pytest.mark.parametrize("mode", [CommandMode.POSITION, CommandMode.TORQUE])
def test_at_a_collision_both_loops_brake_and_name_the_joint(wire: Version, mode: CommandMode) -> None:
    guard = CollisionGuard.of(10.0, baseline=BASELINE)
    twins = Twins(wire=wire, settings=watching(guard))
    controller = twins.pure.controller
    controller.mode, controller.__class__ = mode, Touched
    assert isinstance(controller, Touched)
    controller.torques = with_torque(3, -25.0)
    twins.step()
    assert at.read_collision(twins.pure.layout) is None, "only while commands are effective"
    controller.torques = with_torque(3, -9.9)
    twins.activate()
    for k in range(200):
        twins.command(q=np.add(IPO, 2e-6 * k * k).tolist(), tau=[5.0] * 7)
        twins.step()
    assert at.read_collision(twins.pure.layout) is None and twins.pure.states[-1].q_sent[0] > IPO[0] + 0.05
    controller.torques = with_torque(3, -25.0)
    twins.step()
    for bench in (twins.pure, twins.other):
        found = at.read_collision(bench.layout)
        assert found is not None and str(found) == "A4: -25.0 Nm external torque, allowed are 10.0 Nm"
        words = bench.layout.events.newest()
        assert words is not None and f"{COLLIDED}A4: -25.0 Nm".encode() in words.tobytes()
    controller.torques = BASELINE
    for _ in range(600):
        twins.command(q=np.add(IPO, 0.5).tolist(), tau=[5.0] * 7)
        twins.step()
    sent = [one.q_sent for one in twins.pure.states[-100:]]
    assert np.ptp(sent, axis=0).max() == 0.0, "the arm stands, whatever is commanded"
    if mode is CommandMode.TORQUE:
        # this arm does not move when it is pushed: the guard of torques holds against what it takes for an unknown load
        torques = [one.tau_sent for one in twins.pure.states[-100:]]
        assert np.ptp(torques, axis=0).max() < 0.05, "whatever is commanded"
    twins.check()


def test_a_margin_allows_more_torque_to_a_joint_that_moves() -> None:
    moving, controller = watched(CollisionGuard.of(10.0, baseline=BASELINE, margin=20.0))
    speed = abs(float(moving.pure.cycle.record.dq[0]))
    assert speed > 0.3
    controller.torques = with_torque(0, 10.0 + 19.0 * speed)
    follow(moving)
    assert at.read_collision(moving.pure.layout) is None
    controller.torques = with_torque(0, 10.0 + 25.0 * speed)
    follow(moving)
    found = at.read_collision(moving.other.layout)
    assert (
        found is not None
        and found.joint == 0
        and found.allowed == pytest.approx(10.0 + 20.0 * speed, rel=0.1)
    )
    moving.check()


@pytest.mark.parametrize("torques", [None, (*BASELINE[:6], math.nan)])
def test_without_torques_nothing_is_watched_so_the_arm_brakes(torques: tuple[float, ...] | None) -> None:
    twins, controller = watched(CollisionGuard.of(10.0, baseline=BASELINE))
    controller.torques = torques
    twins.step()
    assert twins.pure.cycle.is_ending
    found = at.read_collision(twins.other.layout)
    assert found is not None and math.isnan(found.torque)
    twins.check()


def test_a_client_reports_the_collision() -> None:
    guard = CollisionGuard.of(10.0, baseline=BASELINE)
    with Client(0, collision=guard, realtime=False) as client:
        controller = Touched(client.port)
        with controller.running():
            controller.active()
            client.wait("COMMANDING_ACTIVE")
            assert client.collision is None
            controller.torques = with_torque(6, 11.0)
            for _ in client:
                if client.collision is not None:
                    break
            assert (client.collision.joint, client.collision.torque) == (6, pytest.approx(11.0))  # type: ignore[attr-defined]
            assert any(COLLIDED in one.text for one in client.events())
    with pytest.raises(ShapeError, match="collision"):
        Client(0, collision=10.0)  # type: ignore[arg-type]
