"""The panel's wizard without a browser: it asks before it moves, shows how far it is, and saves only what is to be."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm import model as kinematics
from heptarm.errors import CommandRejected, HeptarmError, ModeConflict, ShapeError
from heptarm.io.panel_box import PlanOutline
from heptarm.io.targets import SavedTarget, add_target, saved_targets
from heptarm.panel import texts
from heptarm.panel.wizard import Wizard, WizardSettings, WizardStep
from tests.simulators import FASTER

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
TIP, POINT = np.array([0.012, -0.034, 0.187]), np.array([0.55, 0.0, 0.25])
TURNS = ((0, 30, 0), (25, -30, 0), (-25, 0, 30), (0, 0, -30))
PATIENCE = 60.0


class Person:
    """In front of the wizard: what was shown and reported, and the button that is pressed."""

    def __init__(self, arm: ha.Arm) -> None:
        self.errors, self.plans = list[HeptarmError](), list[PlanOutline]()
        self.wizard = Wizard(arm, "lab1", show=self.plans.append, report=self.errors.append)

    def sees(self, what: Callable[[WizardStep], object]) -> WizardStep:
        """Wait until the wizard is so far."""
        deadline = time.monotonic() + PATIENCE
        while not what(self.wizard.step):
            assert time.monotonic() < deadline, (self.wizard.step, self.errors)
            time.sleep(0.01)
        return self.wizard.step

    def asked(self, words: str) -> None:
        """Wait until the wizard asks for something."""
        self.sees(lambda step: words in step.asks)


@pytest.fixture(scope="module")
def arm() -> Iterator[ha.Arm]:
    target = f"sim://iiwa14?speed={FASTER:g}&payload=2,0.01,-0.02,0.08"
    with ha.connect(target, state_rate=50.0, watchdog=5.0, timeout=30.0) as arm:
        arm.move(ha.ptp(HOME))
        yield arm


@pytest.fixture(autouse=True)
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))


def test_a_load_is_shown_agreed_to_measured_and_saved(arm: ha.Arm) -> None:
    person, settings = Person(arm), WizardSettings(speed=1.0, seconds=0.3)
    person.wizard.begin("load", settings)
    asked = person.sees(lambda step: step.asks)
    assert "A1 to A3 stay" in asked.asks and "A1 to A3 stay" in texts.wizard(asked)
    assert len(person.plans) == 1 and np.abs(arm.state.q_cmd - HOME).max() < 1e-6
    with pytest.raises(ModeConflict, match="a measurement runs"):
        person.wizard.begin("load", settings)
    person.wizard.give_up()
    person.sees(lambda step: not step.is_running)
    assert "nothing moves" in str(person.errors.pop())

    person.wizard.begin("load", settings)
    person.sees(lambda step: step.asks)
    person.wizard.go_on()
    person.sees(lambda step: step.done)
    with pytest.raises(CommandRejected, match="asks nothing now"):
        person.wizard.go_on()
    found = person.sees(lambda step: not step.is_running)
    assert not person.errors and found.done == found.count == 9
    assert "measured 2.0" in found.result and "nothing is changed" in texts.wizard(found)
    assert arm.state_rate == 50.0
    with pytest.raises(CommandRejected, match="is not a saved target"):
        person.wizard.save("gripper")
    add_target(SavedTarget("lab1", "172.31.1.147"))
    person.wizard.save("gripper")
    assert saved_targets()["lab1"].tools[0].mass == pytest.approx(2.0, abs=0.04)
    assert person.wizard.step.is_saved and "<small>saved" in texts.wizard(person.wizard.step)


@pytest.mark.parametrize("how", ["Give up", "STOP", "the page is closed"])
def test_what_is_given_up_between_two_motions_moves_no_more(arm: ha.Arm, how: str) -> None:
    person = Person(arm)
    person.wizard.begin("load", WizardSettings(speed=1.0, seconds=4.0))
    person.sees(lambda step: step.asks)
    person.wizard.go_on()
    arm.wait_until(lambda state: state.motion.active, timeout=PATIENCE)
    arm.wait_until(lambda state: not state.motion.active, timeout=PATIENCE)  # it measures a rest
    rest = arm.wait_for_rest(timeout=PATIENCE).q_cmd
    if how == "STOP":
        person.wizard.end()  # as the panel does
        arm.stop()
    else:
        person.wizard.give_up() if how == "Give up" else person.wizard.close()
    person.sees(lambda step: not step.is_running)
    assert "given up, nothing moves any more" in str(person.errors.pop())
    assert np.abs(arm.state.q_cmd - rest).max() < 1e-6
    with pytest.raises(CommandRejected, match="no measurement runs"):
        person.wizard.give_up()
    arm.move(ha.ptp(HOME))


def test_a_tip_from_poses_that_a_person_confirms(arm: ha.Arm) -> None:
    person, home = Person(arm), ha.Pose.from_matrix(kinematics.forward(arm.robot, HOME))
    person.wizard.begin("poses", WizardSettings(count=4))
    for number, abc in enumerate(TURNS, 1):
        person.asked(f"pose {number} of 4")
        turn = home.rotated(*ha.deg(*abc))
        flange = ha.Pose.of(POINT - turn.rotation @ TIP, turn.quat)
        arm.move(ha.ptp(kinematics.solve(arm.robot, flange, near=HOME)))
        person.wizard.go_on()
    found = person.sees(lambda step: not step.is_running)
    shown = re.search(r"x (\S+) ± \S+  y (\S+) ± \S+  z (\S+) ±", found.result)
    assert not person.errors and shown is not None
    np.testing.assert_allclose([float(number) for number in shown.groups()], 1e3 * TIP, atol=0.3)
    arm.move(ha.ptp(HOME))


def test_what_makes_no_sense_moves_nothing(arm: ha.Arm) -> None:
    person = Person(arm)
    for kind, settings, error, words in (
        ("touch", WizardSettings(surface="table"), CommandRejected, "surface must be plane:X,Y,Z"),
        ("camera", WizardSettings(camera="/dev/nowhere.avi"), CommandRejected, "cannot be opened"),
        ("arm", WizardSettings(), ShapeError, "kind must be"),
    ):
        with pytest.raises(error, match=words):
            person.wizard.begin(kind, settings)
    with pytest.raises(CommandRejected, match="nothing is measured yet"):
        person.wizard.save("gripper")
    person.wizard.begin("touch", WizardSettings())
    person.sees(lambda step: not step.is_running)
    assert "the tip must be 2 to 50 mm over the plane" in str(person.errors.pop())
