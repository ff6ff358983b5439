"""A parameter of a law is checked wherever it is set, and the law sees a step of it as a ramp."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm import laws
from heptarm.errors import CommandRejected, HeptarmError, LimitError, ShapeError
from heptarm.fri import LawTrial
from heptarm.fri.loop.law_interface import flat
from heptarm.fri.loop.parameters import RateLimiter, merged
from heptarm.fri.loop.user_api import Params
from heptarm.laws import ReadyLaw
from heptarm.values.robot import ROBOTS, robot

from .plant import ARM, DT, HOME

READY: dict[str, Callable[[], Any]] = {
    "cartesian_impedance": laws.cartesian_impedance,
    "joint_impedance": laws.joint_impedance,
    "free_guiding": laws.free_guiding,
    "admittance": laws.admittance,
    "hybrid": laws.hybrid,
    "minimum_jerk": laws.minimum_jerk,
    "jerk_limited": laws.jerk_limited,
    "low_pass": laws.low_pass,
    "low_pass_readings": laws.low_pass_readings,
    "search": laws.search,
}


def live(law: ReadyLaw, name: str = "iiwa14") -> tuple[Params, list[int]]:
    """The parameters of a law as a session has them, and how often they were sent."""
    declared, sent = merged(law.parameters(robot(name)), None), list[int]()
    values, schema = flat(declared, "params")
    return Params(values, schema, changed=lambda: sent.append(1), declared=declared), sent


SIX, SEVEN = np.ones(6), np.ones(7)


@pytest.mark.parametrize(
    ("law", "name", "value"),
    [
        ("cartesian_impedance", "damping", -1000.0),
        ("cartesian_impedance", "damping", 1e12),
        ("cartesian_impedance", "stiffness", -1000.0 * SIX),
        ("cartesian_impedance", "stiffness", 1e12 * SIX),
        ("cartesian_impedance", "force_max", -1.0),
        ("cartesian_impedance", "tau_max", -SEVEN),
        ("cartesian_impedance", "goal", [0.5, 0.0, 0.5, 0.0, 3.0, 0.0, 0.0]),
        ("cartesian_impedance", "posture", 4.0 * SEVEN),
        ("joint_impedance", "damping", -1000.0),
        ("joint_impedance", "stiffness", 1e12 * SEVEN),
        ("joint_impedance", "goal", 4.0 * SEVEN),
        ("joint_impedance", "speed", 0.0 * SEVEN),
        ("free_guiding", "damping", -1000.0 * SEVEN),
        ("free_guiding", "wall_stiffness", 1e12),
        ("free_guiding", "box", [[1.0, 1.0, 1.0], [0.0, 0.0, 0.0]]),
        ("free_guiding", "gravity", [0.0, 0.0, 9.81]),
        ("admittance", "mass", 0.0 * SIX),
        ("admittance", "damping", -1000.0 * SIX),
        ("hybrid", "damping", -1000.0 * SIX),
        ("hybrid", "goal", [0.5, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0]),
        ("hybrid", "wrench", [5.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        ("minimum_jerk", "acceleration", -SEVEN),
        ("jerk_limited", "speed", -SEVEN),
        ("jerk_limited", "jerk", 0.0 * SEVEN),
        ("jerk_limited", "jerk", math.nan * SEVEN),
        ("low_pass", "frequency", math.inf),
        ("low_pass_readings", "damping", -1.0),
        ("search", "amplitude", -1.0),
    ],
)
def test_what_making_a_law_refuses_is_refused_on_the_way(law: str, name: str, value: Any) -> None:
    params, sent = live(READY[law]())
    before = np.array(params.words)
    with pytest.raises(CommandRejected) as one:
        setattr(params, name, value)
    with pytest.raises(CommandRejected):
        params.set(**{name: value})
    assert one.value.parameter.startswith(name)
    assert not sent and np.array_equal(params.words, before, equal_nan=True), "nothing is half applied"
    with pytest.raises(ValueError, match="read-only"):
        params.words[:] = -1000.0
    with pytest.raises(CommandRejected):  # by params= of the session, too
        merged(READY[law]().parameters(ARM), {name: value}) if name != "gravity" else params.set(
            gravity=value
        )


@pytest.mark.parametrize("name", READY)
def test_all_parameters_of_the_ready_laws_are_declared_and_take_their_own_values(name: str) -> None:
    for model in ROBOTS:
        params, sent = live(READY[name](), model)
        declared = READY[name]().parameters(robot(model))
        for one, declaration in declared.items():
            bounded = np.isfinite(declaration.low).all() and np.isfinite(declaration.high).all()
            assert not declaration.live or bounded, f"{one} has a range"
            if declaration.live:
                setattr(params, one, declaration.value)
        assert len(sent) == sum(one.live for one in declared.values())


def test_several_parameters_change_together_or_none_does() -> None:
    params, sent = live(laws.cartesian_impedance())
    with pytest.raises(LimitError, match=r"damping must be in \[0, 2\], got -1"):
        params.set(force_max=10.0, damping=-1.0)
    assert params.force_max == 60.0 and not sent


def test_errors_name_value_unit_range_and_index() -> None:
    params, _ = live(laws.joint_impedance())
    with pytest.raises(
        LimitError, match=r"goal\[3\] must be in \[-2.09\d*, 2.09\d*\] rad, got 90 rad"
    ) as error:
        params.goal = [0.0, 0.0, 0.0, 90.0, 0.0, 0.0, 0.0]
    assert error.value.hint == "angles are in radians: did you mean math.radians(90)?"


def test_a_program_declares_its_own_parameters() -> None:
    law = ha.law(params={"k": ha.param(500.0, low=0.0, high=2000.0, unit="Nm/rad"), "free": 1.0})(
        lambda s, o, p: 0
    )
    declared = merged(law.parameters(ARM), {"k": 700.0})
    values, schema = flat(declared, "params")
    params = Params(values, schema, changed=lambda: None, declared=declared)
    assert params.k == 700.0
    with pytest.raises(LimitError, match=r"k must be in \[0, 2000\] Nm/rad, got -5 Nm/rad"):
        params.k = -5.0
    with pytest.raises(LimitError, match="free must be finite, got nan"):
        params.free = math.nan
    with pytest.raises(LimitError, match=r"k must be in \[0, 2000\]"):
        merged(law.parameters(ARM), {"k": 3000.0})
    with pytest.raises(ShapeError, match="k must have shape"):
        params.k = [1.0, 2.0]
    params.free = -1e9


@pytest.mark.parametrize(
    "make",
    [
        lambda: ha.param(3.0, low=4.0),
        lambda: ha.param(3.0, low=4.0, high=2.0),
        lambda: ha.param(3.0, rate=0.0),
        lambda: ha.param(math.nan),
        lambda: ha.param([1.0, 2.0], low=[0.0, 0.0, 0.0]),
        lambda: ha.param("3"),
        lambda: ha.param(3.0, check="no"),  # type: ignore[arg-type]
        lambda: ha.param(3.0, check=lambda value: "not today"),
    ],
)
def test_a_declaration_that_cannot_be_is_refused(make: object) -> None:
    with pytest.raises(HeptarmError) as error:
        make()  # type: ignore[operator]
    assert error.value.parameter


def test_a_step_reaches_the_law_as_a_ramp() -> None:
    values, rates = np.array([0.0, 0.0, math.nan, 1.0]), np.array([10.0, math.inf, 1.0, 5.0])
    follower = RateLimiter(values, rates)
    follower.target[:] = 1.0, 1.0, 1.0, math.nan
    follower.step(0.01)
    assert values[:3].tolist() == [0.1, 1.0, 1.0] and math.isnan(values[3])
    for _ in range(10):
        follower.step(0.01)
    assert values[0] == 1.0, "there, exactly"


def test_a_step_of_the_stiffness_does_not_jerk_the_arm() -> None:
    """The torque of a stretched spring rises as fast as its stiffness may."""
    trial = LawTrial(laws.joint_impedance(smoothing=0.1, stiffness=[50.0] * 7), dt=DT)
    trial(HOME)
    trial.params.goal = HOME + 0.05
    for _ in range(3000):
        out = trial(HOME)
    trial.params.stiffness = [250.0] * 7
    taus = np.array([[*out.tau], *([*trial(HOME).tau] for _ in range(200))])
    assert taus[-1] == pytest.approx(np.minimum(250.0 * 0.05, 0.3 * ARM.tau_max), rel=1e-3)
    assert np.abs(np.diff(taus, axis=0)).max() <= 4000.0 * 0.05 * DT * 1.01
