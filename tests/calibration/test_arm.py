"""Identification of an arm whose numbers are hidden in the simulator: accurate, honest, and of use for another run."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm import calibration
from heptarm.calibration import ArmSamples, FittedArm, FittedNumbers, arm_fit
from heptarm.calibration.load_estimate import load_regressor
from heptarm.cli import calibrate
from heptarm.cli.rl.policies import recipe_of
from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.model.dynamics import GRAVITY, inverse_dynamics_rows
from heptarm.rl.sim.randomisation import MILD, STRONG, Randomisation
from heptarm.rl.task import ReachTask
from heptarm.sim.plant.plant import Plant, fitted_arm
from heptarm.values.checks import Array
from heptarm.values.robot import Body, robot
from tests.calibration.hidden_arm import (
    HIDDEN,
    IIWA,
    START,
    TWO_SIGMA,
    computed,
    drawn,
    number,
    recorded,
    trajectory,
)
from tests.long import longer
from tests.simulators import FASTER

Along = tuple[Array, Array, Array, Array, Array]


@pytest.fixture(scope="module")
def along() -> Along:
    return trajectory(20.0)


@pytest.fixture(scope="module")
def samples() -> ArmSamples:
    return recorded(HIDDEN, longer(15.0, 60.0))


@pytest.fixture(scope="module")
def fit(samples: ArmSamples) -> calibration.ArmFit:
    return calibration.simulator(samples, robot="iiwa14")


def test_hidden_friction_and_stiffness_are_found_within_five_percent(fit: calibration.ArmFit) -> None:
    true, found = HIDDEN.friction, fit.arm.friction
    assert true is not None and found is not None
    for speed in (0.005, 0.02, 0.1, 0.3):  # of the whole curve, in both directions
        for dq in (np.full(7, speed), np.full(7, -speed)):
            assert np.allclose(found.torque(dq), true.torque(dq), rtol=0.05), (dq, found.torque(dq))
    assert np.allclose(fit.arm["stiffness"].value, HIDDEN["stiffness"].value, rtol=0.05)
    assert np.allclose(fit.arm["rotor"].value, 0.2, rtol=0.1)


def test_offsets_noise_and_delay_are_found(fit: calibration.ArmFit) -> None:
    for name in ("torque_offset", "torque_gain"):
        found = fit.arm[name]
        assert (np.abs(found.value - HIDDEN[name].value) <= 4.0 * found.sigma + 1e-9).all(), name
    assert np.allclose(fit.arm["torque_noise"].value, HIDDEN["torque_noise"].value, rtol=0.05)
    assert np.allclose(fit.arm["position_noise"].value, 1e-5, rtol=0.05)
    assert fit.arm["state_delay"].value[0] == pytest.approx(0.002, abs=1e-4)
    assert "load" not in fit.arm and not fit.arm.contradictions


def test_it_predicts_another_recording_within_its_noise(fit: calibration.ArmFit) -> None:
    other = recorded(HIDDEN, 3.0, seed=11)
    tried = calibration.validate(fit.arm, other)
    assert tried.is_good and (tried.ratio <= 1.2).all() and not tried.contradictions
    blind = calibration.validate(FittedArm("iiwa14"), other)
    assert not blind.is_good and "Nm off the prediction" in blind.contradictions[0]


def test_an_arm_with_a_media_flange_is_validated_with_it(
    along: Along, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    touch, file = robot("iiwa14+touch"), tmp_path / "my-arm.toml"
    of = (*along[:4], inverse_dynamics_rows(touch, *along[1:4]))
    samples = computed(drawn(1), of, seed=1)
    fit = calibration.simulator(samples, robot=touch)
    assert fit.validation.is_good and not fit.arm.contradictions
    fit.save(file)
    read = calibration.load_fitted(file)
    assert read.robot == "iiwa14+touch" and calibration.validate(read, samples).is_good
    assert fitted_arm(file, IIWA) is not None, "the simulator takes it with any flange"
    # a recording names its robot: the flange is that of the recording, also with an arm that has another one
    for named, is_good in (("iiwa14+touch", True), ("iiwa14", False), ("", True)):
        monkeypatch.setattr(arm_fit, "samples_of", lambda *_, named=named: (samples, named))
        assert calibration.validate(read, "run.mcap").is_good is is_good, named
    monkeypatch.setattr(arm_fit, "samples_of", lambda *_: (samples, "iiwa14+touch"))
    assert calibration.validate(replace(read, robot="iiwa14"), "run.mcap").is_good, "the file of an older fit"


def test_a_recording_of_another_robot_validates_nothing(
    fit: calibration.ArmFit, samples: ArmSamples, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = {"run": "iiwa14", "validation": "iiwa7"}
    monkeypatch.setattr(arm_fit, "samples_of", lambda _, name: (samples, names[name]))
    with pytest.raises(
        CommandRejected, match="validation must be a recording of an iiwa14, got one of an iiwa7"
    ):
        calibration.simulator(samples, validation="other.mcap")
    names["run"] = "med14"
    with pytest.raises(CommandRejected, match="run must be a recording of an iiwa14, got one of an med14"):
        calibration.validate(fit.arm, "other.mcap")


def test_a_fitted_simulator_behaves_like_the_arm(fit: calibration.ArmFit, tmp_path: Path) -> None:
    file = tmp_path / "my-arm.toml"
    fit.save(file)
    read = fitted_arm(file, IIWA)
    assert read is not None and "stiffness" in read
    twin = calibration.validate(HIDDEN, recorded(read, 3.0, seed=11))
    assert twin.is_good and (twin.deflection < 3e-5).all()


def test_the_truth_is_within_two_sigma(along: Along) -> None:
    runs = longer(4, 100)
    inside = {name: 0 for name in TWO_SIGMA}
    for seed in range(runs):
        hidden = drawn(seed)
        found = calibration.simulator(computed(hidden, along, seed=seed), robot=IIWA).arm
        for name in TWO_SIGMA:
            assert name in found, name
            off = np.abs(found[name].value - hidden[name].value)
            inside[name] += int((off <= 2.0 * found[name].sigma).sum())
    assert min(inside.values()) >= longer(0.85, 0.9) * 7 * runs, inside


def test_a_load_that_nobody_declared_is_found(along: Along) -> None:
    load = Body(2.0, np.array([0.01, -0.02, 0.08]))
    moment = 2.0 * load.com
    about = 2.0 * (load.com @ load.com * np.eye(3) - np.outer(load.com, load.com))
    given = number("load", [2.0, *moment, *about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]])
    hidden = drawn(1).with_numbers([given])
    found = calibration.simulator(computed(hidden, along, seed=1), robot=IIWA).arm
    assert found.load is not None
    assert found.load.mass == pytest.approx(2.0, rel=0.02)
    assert np.abs(found.load.com - load.com).max() < 3e-3
    assert np.allclose(found["stiffness"].value, hidden["stiffness"].value, rtol=0.05)
    plant = Plant(q=tuple(START.tolist()), fitted=FittedArm("iiwa14", (given,)))
    plant.step(2000)
    expected = load_regressor(IIWA, START)[:, :4] @ [2.0, *moment]
    assert np.allclose(plant.snapshot.tau_ext, -expected, atol=0.1)


def test_a_push_is_named_and_left_out(along: Along) -> None:
    hidden = drawn(2)
    free = computed(hidden, along, seed=2)
    push = np.where(np.abs(free.t - 8.0) < 0.5, 1.0, 0.0)[:, None] * [0, 25, 0, 20, 0, 8, 0]
    pushed = replace(
        free,
        q=free.q + push / hidden["stiffness"].value,
        tau=free.tau - push,
        tau_ext=free.tau_ext + push,
        tau_cmd=free.tau_cmd - push,
    )
    fit = calibration.simulator(pushed, robot=IIWA)
    assert re.match(r"from 7\.[45] to 8\.[56] s: .* Nm act on A. from outside", fit.arm.contradictions[0])
    clear = calibration.simulator(free, robot=IIWA).arm
    for name in ("coulomb", "torque_offset", "stiffness"):
        assert (np.abs(fit.arm[name].value - clear[name].value) <= 2.0 * clear[name].sigma).all(), name


def test_what_cannot_be_identified_is_refused(samples: ArmSamples) -> None:
    def some(**changed: object) -> ArmSamples:
        names = ("t", "q", "q_cmd", "tau", "tau_ext", "tau_cmd")
        return ArmSamples(**({name: getattr(samples, name)[:3000] for name in names} | changed))

    still = np.tile(START, (3000, 1))
    with pytest.raises(CommandRejected, match=r"every axis must move for at least 3 s, got 0.0 s of A1"):
        calibration.simulator(some(q=still, q_cmd=still), robot=IIWA)
    with pytest.raises(CommandRejected, match="at least 200 states per second, got 100"):
        calibration.simulator(some(t=0.01 * np.arange(3000)), robot=IIWA)
    with pytest.raises(CommandRejected, match="states in a row"):
        calibration.simulator(some(t=np.cumsum(1e-3 + 0.05 * (np.arange(3000) % 20 == 0))), robot=IIWA)
    with pytest.raises(CommandRejected, match="robot must be given"):
        calibration.simulator(samples)
    with pytest.raises(CommandRejected, match="t must ascend"):
        some(t=np.zeros(3000))
    with pytest.raises(ShapeError, match="q_cmd must have shape"):
        some(q_cmd=still[:5])


def test_the_file_has_each_number_with_sigma_source_and_date(tmp_path: Path) -> None:
    file = tmp_path / "arm.toml"
    known = replace(HIDDEN["coulomb"], sigma=np.full(7, 0.01), source="run.mcap: 598 s", date="2026-11-28")
    arm = replace(HIDDEN.with_numbers([known]), contradictions=('A2 "slips"',))
    arm.save(file)
    assert calibration.load_fitted(file) == arm
    assert 'source = "run.mcap: 598 s"\ndate = "2026-11-28"' in file.read_text()
    assert 'contradicted: A2 "slips"' in str(arm)
    with pytest.raises(CommandRejected, match="exists"):
        arm.save(file)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("robot = 1", "names no robot"),
        ("robot = ", "not TOML"),
        ('robot = "iiwa14"\n[coulomb]\nvalue = [1, 2]', "coulomb must have shape"),
        (
            'robot = "iiwa14"\n[coulomb]\nvalue = [-1, 0, 0, 0, 0, 0, 0]',
            r"coulomb\[0\] must be in \[0, 100\] Nm",
        ),
        ('robot = "iiwa14"\n[coulomb]\nsigma = [1, 0, 0, 0, 0, 0, 0]', "must have value"),
        ('robot = "iiwa14"\n[slip]\nvalue = [1]', "slip must be a table of one of"),
        ('robot = "r2d2"', "robot must be one of"),
        ('robot = "iiwa7"', "is of the robot iiwa7, and the simulated one is iiwa14"),
        (
            'robot = "iiwa14"\n[stiffness]\nvalue = [9e3, 9e3, 9e3, 9e3, 9e3, 9e3, 4e4]',
            "stiffness of A7 must be in",
        ),
    ],
)
def test_a_file_that_is_not_right_is_refused(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "arm.toml"
    file.write_text(text)
    with pytest.raises(CommandRejected, match=said):
        fitted_arm(file, robot("iiwa14"))


def test_the_stiffest_arm_that_is_taken_is_stable() -> None:
    stiff = FittedArm("iiwa14", (number("stiffness", 29e3), number("rotor", 0.1)))
    seen = recorded(stiff, 2.0)
    assert np.abs(seen.q_cmd - seen.q).max() < 1e-3


def test_what_a_commissioning_run_found_is_kept(along: Along, tmp_path: Path) -> None:
    samples, report = computed(HIDDEN, along, seed=0), tmp_path / "report.json"
    report.write_text(
        '{"date": "2026-11-28", "steps": [{"step": "contact.stiffness", "comparisons": ['
        '{"quantity": "deflection", "expected": "1 mm", "measured": "2 mm", "agrees": false}]}]}'
    )
    fit = calibration.simulator(samples, robot=IIWA, commissioning=report, acceleration=GRAVITY)
    assert "contact.stiffness: deflection: expected 1 mm, measured 2 mm" in fit.arm.contradictions[-1]
    report.write_text("{}")
    with pytest.raises(CommandRejected, match="is not the report of a commissioning run"):
        calibration.simulator(samples, robot=IIWA, commissioning=report)


def test_a_plant_of_another_arm_has_its_rotors() -> None:
    assert (Plant(fitted=FittedArm("iiwa14", (number("rotor", 0.4),))).model.dof_armature[:7] == 0.4).all()
    with pytest.raises(LimitError, match="too long for a stiffer one|must be in"):
        Plant(fitted=FittedArm("iiwa14", (number("stiffness", 45e3),)))


@pytest.mark.long
def test_a_virtual_cabinet_of_a_fitted_arm_is_identified_again(tmp_path: Path) -> None:
    file = tmp_path / "my-arm.toml"
    HIDDEN.save(file)
    with ha.connect(f"sim://iiwa14?speed={FASTER:g}&fitted={file}", state_rate=500.0, timeout=30.0) as arm:
        arm.move(ha.ptp(START))
        plan = calibration.excitation(arm, seconds=20.0, collision_check=ha.CollisionModel("iiwa14"))
        assert plan.is_checked and "none foreseen" in str(plan)
        with pytest.raises(CommandRejected, match="nothing moves"):
            calibration.record_excitation(arm, tmp_path / "no.mcap", plan=plan, confirm=lambda plan: False)
        run = calibration.record_excitation(arm, tmp_path / "run.mcap", plan=plan)
    fit = calibration.simulator(run)
    assert fit.validation.is_good
    assert np.allclose(fit.arm["coulomb"].value, HIDDEN["coulomb"].value, rtol=0.05)
    saved = tmp_path / "found.toml"
    assert calibrate.arm(run, save=saved, validate=run) == 0
    assert calibration.load_fitted(saved)["coulomb"].value == pytest.approx(fit.arm["coulomb"].value)
    assert fit.arm["coulomb"].date.startswith("20") and "run.mcap" in fit.arm["coulomb"].source


def test_a_cabinet_refuses_a_file_that_is_not_right(tmp_path: Path) -> None:
    with pytest.raises(ha.HeptarmError, match="cannot be read|no such file"):
        ha.connect(f"sim://iiwa14?fitted={tmp_path / 'none.toml'}")


def test_learning_takes_its_ranges_from_the_arm() -> None:
    load = replace(number("load", [1.0, *[0.0] * 9]), sigma=np.full(10, 0.1))
    late = replace(number("state_delay", 0.02), sigma=np.array([0.001]))
    ranges = Randomisation.of_arm(FittedArm("iiwa14", (load, late)), period=0.015)
    assert ranges.latency == (1, 2) and ranges.payload == pytest.approx((0.8, 1.2))
    assert ranges.bandwidth == MILD.bandwidth
    with pytest.raises(LimitError, match="period must be"):
        Randomisation.of_arm(FittedArm("iiwa14"), period=0.0)


def test_a_training_varies_about_the_fitted_arm(tmp_path: Path) -> None:
    file = tmp_path / "my-arm.toml"
    late = FittedNumbers("state_delay", np.array([0.04]), np.array([0.001]))
    FittedArm("iiwa14", (late,)).save(file)
    task = ReachTask("iiwa14")
    recipe = recipe_of(task, seed=3, steps=1000, fitted=file)
    assert recipe.randomisation.latency == (1, 2) and recipe.steps == 1000 and recipe.seed == 3
    assert recipe_of(task, seed=3, steps=0, fitted=None).randomisation == STRONG
    with pytest.raises(CommandRejected, match="no such file|cannot be read|does not exist"):
        recipe_of(task, seed=0, steps=0, fitted=tmp_path / "none.toml")
