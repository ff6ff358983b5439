"""The external wrench: sent by the controller, or estimated from the torques of the joints."""

from __future__ import annotations

import math
import random
from functools import partial

import numpy as np
import pytest

from heptarm import model
from heptarm.fri import RedundancyStrategy
from heptarm.fri.guard.fallback import Missing, Policy
from heptarm.fri.loop.settings import LoopSettings
from heptarm.fri.loop.user_api import State
from heptarm.fri.loop.wrench import chain_of, external_wrench
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.messages import SessionState
from heptarm.fri.protocol.version import Version
from heptarm.values.robot import ROBOTS, robot
from tests.oracles.fri.wrench import WrenchEstimator

from .controller import Controller
from .test_cycle import Bench
from .test_native import Twins

WRENCH = (3.0, -5.0, 12.0, 0.4, -0.3, 0.2)


@pytest.mark.parametrize("name", ROBOTS)
def test_the_wrench_of_its_torques_is_found_again(name: str) -> None:
    arm, rng = robot(name), np.random.default_rng(5)
    oracle = WrenchEstimator(chain_of(arm))
    for _ in range(20):
        q = rng.uniform(0.9 * arm.q_min, 0.9 * arm.q_max)
        jacobian = model.jacobian(arm, q)
        if np.linalg.svd(jacobian, compute_uv=False)[-1] < 0.1:
            continue  # near a singular posture the damping makes it smaller
        found = external_wrench(arm, q, jacobian.T @ WRENCH)
        assert found == pytest.approx(WRENCH, rel=0.02, abs=0.1)
        assert found.tolist() == oracle.wrench(tuple(q), tuple(jacobian.T @ WRENCH))


def test_with_a_media_flange_it_acts_on_that_flange() -> None:
    """A Touch is 26 mm above the plain flange: taken for plain, a push of 30 N across has a moment of 0.78 Nm more."""
    touch, q = robot("iiwa14", flange="touch"), np.radians([10.0, 40.0, -20.0, -80.0, 30.0, 50.0, 20.0])
    axis = model.forward(touch, q)[:3, 2]
    push = 30.0 * np.cross(axis, [1.0, 0.0, 0.0]) / np.linalg.norm(np.cross(axis, [1.0, 0.0, 0.0]))
    torques = model.jacobian(touch, q).T @ np.concatenate([push, np.zeros(3)])
    found, plain = external_wrench(touch, q, torques), external_wrench(robot("iiwa14"), q, torques)
    assert found == pytest.approx(np.concatenate([push, np.zeros(3)]), rel=0.02, abs=0.1)
    assert np.linalg.norm(plain[3:]) == pytest.approx(0.026 * 30.0, abs=0.05)


def test_in_a_singular_posture_it_stays_bounded() -> None:
    """Stretched upwards, no torque shows a force along the arm; noise must not appear as one."""
    arm = robot("iiwa14")
    noise = tuple(random.Random(1).uniform(-0.5, 0.5) for _ in range(7))
    found = external_wrench(arm, (0.0,) * 7, noise)
    assert np.abs(found[:3]).max() < 30.0


class Pushed(Controller):
    """A controller whose arm is pushed: it sends the torques of a wrench."""

    sent: tuple[float, ...] | None = None

    def datagram(self) -> bytes:
        plain = super().datagram()
        jacobian = model.jacobian(robot("iiwa14"), self.position())
        return _with(plain, self.wire, tau_ext=tuple(jacobian.T @ WRENCH), wrench=self.sent)


def _with(datagram: bytes, wire: Version, **values: object) -> bytes:
    """A message with other values of its monitor data."""
    from dataclasses import replace

    from tests.oracles.fri import codec

    message = codec.decode_monitoring(datagram, wire)
    assert message.monitor is not None
    return codec.encode_monitoring(replace(message, monitor=replace(message.monitor, **values)), wire)  # type: ignore[arg-type]


def test_the_loop_estimates_it_at_the_media_flange() -> None:
    touch = robot("iiwa14", flange="touch")
    bench = Bench(settings=LoopSettings(model=touch, policy=Policy(Missing.HOLD, patience=1e6), history=256))
    bench.controller.__class__ = Pushed
    bench.activate()
    bench.run(20, SessionState.COMMANDING_ACTIVE)
    words = bench.layout.states.newest()
    assert words is not None
    state = State(words)
    place = (
        0.026 * model.forward(touch, state.q)[:3, 2]
    )  # from the plain flange, on which the torques' wrench acts
    moment = np.array(WRENCH[3:]) - np.cross(place, WRENCH[:3])
    assert state.is_wrench_estimated
    assert state.wrench == pytest.approx(np.concatenate([WRENCH[:3], moment]), rel=0.02, abs=0.1)
    assert np.abs(moment - WRENCH[3:]).max() > 0.15


@pytest.mark.parametrize("wire", Version)
def test_the_loop_estimates_it_where_none_is_sent(wire: Version) -> None:
    twins = Twins(wire=wire)
    twins.pure.controller.__class__ = Pushed
    twins.activate()
    for _ in range(20):
        twins.step()
    state = twins.pure.states[-1]
    assert state.is_wrench_estimated
    assert state.wrench.tolist() == pytest.approx(WRENCH, rel=0.02, abs=0.1)
    if wire is Version.V2_7:
        twins.pure.controller.sent = tuple(reversed(WRENCH))  # type: ignore[attr-defined]
        twins.step()
        twins.step()
        state = twins.pure.states[-1]
        assert state.wrench.tolist() == list(reversed(WRENCH)) and not state.is_wrench_estimated
    twins.check()


def test_without_external_torques_there_is_no_wrench() -> None:
    bench = Bench()
    plain = bench.controller.datagram
    bench.controller.datagram = lambda: _with(plain(), Version.V1_15, tau_ext=None)  # type: ignore[method-assign]
    bench.run(3, SessionState.MONITORING_READY)
    state = bench.states[-1]
    assert np.isnan(state.wrench).all() and not state.is_wrench_estimated


def test_redundancy_strategy_and_receive_multiplier_are_read() -> None:
    twins = Twins(wire=Version.V2_5)
    twins.activate()
    assert twins.pure.states[-1].redundancy_strategy is None and twins.pure.states[-1].multiplier == 1
    plain = twins.pure.controller.datagram
    for strategy in (m.RedundancyStrategy.E1, m.RedundancyStrategy.NONE):
        redundancy = m.Redundancy(strategy, 0.3)
        replies = partial(lambda one: _with(plain(), Version.V2_5, redundancy=one), redundancy)
        twins.pure.controller.datagram = replies  # type: ignore[method-assign]
        twins.step()
        twins.step()
        state = twins.pure.states[-1]
        assert state.redundancy_strategy is RedundancyStrategy[strategy.name] and state.e1 == 0.3
    twins.check()
    with_old = Bench(wire=Version.V1_15)
    with_old.run(2, SessionState.MONITORING_READY)
    assert with_old.states[-1].redundancy_strategy is None and math.isnan(with_old.states[-1].e1)
