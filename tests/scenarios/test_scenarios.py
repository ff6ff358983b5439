"""Every scenario on one virtual cabinet that runs faster than time; and what the runner does with the others."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import heptarm as ha
from heptarm import testing
from heptarm.cli import check
from heptarm.cli.options import NO_TARGET, CommandTarget
from heptarm.testing import Outcome, Report, Risk, Verdict
from heptarm.testing.runner import tidy
from heptarm.testing.scenario import LINES
from tests.long import LONG
from tests.retry import answers_late, held_up, retry

#: Simulated seconds per second.
SPEED = 4.0
#: Of the noise.
SEED = 7


#: FRI sessions, which need answers within milliseconds of this machine's time; streams of velocities, which a thread
#: integrates by this machine's clock; a hand that lets go at a place. If this machine is late, the arm moves later, and
#: in a fast simulator farther.
IN_REAL_TIME = [
    one.name
    for one in testing.scenarios()
    if one.group == "laws" or one.name in ("servo.joint_velocities", "servo.twist", "guiding.precise")
]
#: All others: the cabinet runs faster than time.
FAST = [one.name for one in testing.scenarios() if one.name not in IN_REAL_TIME]
#: What touches something, by its group: their thresholds decide when, so noise may neither break them nor be needed.
_TOUCHING = {one.group: one.name for one in reversed(testing.scenarios()) if one.risk is Risk.CONTACT}
#: What every run shows with noisy sensors as well, one of each group. The long run shows everything with both: an arm
#: with noisy sensors is never at rest, which costs five times the processor time.
WITH_NOISE = [one.name for one in testing.scenarios()] if LONG else list(_TOUCHING.values())

#: Speeds and sensors of the arms; each arm is closed before the next is connected.
IDEAL, NOISY = (SPEED, "ideal"), (SPEED, f"noisy:{SEED}")
IDEAL_IN_REAL_TIME, NOISY_IN_REAL_TIME = (1.0, "ideal"), (1.0, f"noisy:{SEED}")


@pytest.fixture(scope="module")
def arm(request: pytest.FixtureRequest) -> Iterator[ha.Arm]:
    speed, sensors = request.param
    with ha.connect(testing.stage(speed=speed, sensors=sensors), watchdog=10.0, timeout=30.0) as arm:
        yield arm


def on(stage: tuple[float, str]) -> pytest.MarkDecorator:
    """Run a test with this arm."""
    return pytest.mark.parametrize("arm", [stage], indirect=True, ids=[f"{stage[1]}-{stage[0]:g}"])


def shows(arm: ha.Arm, name: str) -> None:
    """Run a scenario, again if states of it are missing, and require that it is shown and ends with the arm at home."""
    began = 0

    def run() -> Report:
        nonlocal began
        began = time.monotonic_ns()
        return testing.run(arm, only=[name])

    report = retry(
        run, lambda report: "" if isinstance(report, Report) and report.ok else held_up(arm, began)
    )
    _check(report, name)
    assert np.abs(arm.state.q - testing.HOME).max() < 2e-3 or not report.outcomes[0].scenario.moves


def shows_in_real_time(arm: ha.Arm, name: str) -> None:
    """Run a scenario in real time, again if this machine was late, and require that it is shown."""
    began = 0

    def run() -> Report:
        nonlocal began
        began = time.monotonic_ns()
        return testing.run(arm, only=[name])

    def late(report: Report | Exception) -> str:
        if not isinstance(report, Report):
            return held_up(arm, began)
        return "" if report.ok else answers_late(report.outcomes[0].text) or held_up(arm, began)

    _check(retry(run, late), name)


def _check(report: Report, name: str) -> None:
    assert [outcome.scenario.name for outcome in report.outcomes] == [name]
    assert report.outcomes[0].verdict is Verdict.SHOWN, report.table()
    assert report.outcomes[0].measured


@pytest.mark.parametrize("name", [name for name in IN_REAL_TIME if name in WITH_NOISE])
@on(NOISY_IN_REAL_TIME)
def test_the_virtual_cabinet_shows_with_noisy_sensors_in_real_time(arm: ha.Arm, name: str) -> None:
    shows_in_real_time(arm, name)


@pytest.mark.parametrize("name", [name for name in IN_REAL_TIME if LONG or name not in WITH_NOISE])
@on(IDEAL_IN_REAL_TIME)
def test_the_virtual_cabinet_shows_in_real_time(arm: ha.Arm, name: str) -> None:
    shows_in_real_time(arm, name)


@pytest.mark.parametrize("name", [name for name in FAST if name in WITH_NOISE])
@on(NOISY)
def test_the_virtual_cabinet_shows_with_noisy_sensors(arm: ha.Arm, name: str) -> None:
    shows(arm, name)


@pytest.mark.parametrize("name", [name for name in FAST if LONG or name not in WITH_NOISE])
@on(IDEAL)
def test_the_virtual_cabinet_shows(arm: ha.Arm, name: str) -> None:
    shows(arm, name)


def test_each_line_has_a_scenario_and_each_scenario_a_title() -> None:
    every = testing.scenarios()
    assert {one.line for one in every} == set(LINES)
    for one in every:
        assert one.title and len(one.title) < 120, one.name
        assert (one.space > 0.0) is one.moves


class Real:
    """An arm that reports it is a real one."""

    is_virtual = False

    def __init__(self, arm: ha.Arm) -> None:
        object.__setattr__(self, "_arm", arm)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._arm, name)

    def __setattr__(self, name: str, value: object) -> None:
        setattr(self._arm, name, value)


@on(IDEAL)
def test_a_robot_is_asked_for_and_slow(arm: ha.Arm) -> None:
    real: Any = Real(arm)
    tidy(arm, home=True)
    asked: list[str] = []
    fastest = 0.0

    def ask(question: str) -> bool:
        asked.append(question)
        return "ptp_joints" in question

    def began(scenario: testing.Scenario) -> None:
        nonlocal fastest
        fastest = max(fastest, arm.speed)

    names = [
        "motions.ptp_joints",
        "motions.straight",
        "conditions.touch",
        "link.lost",
        "state.push",
        "state.whole",
    ]
    report = testing.run(real, only=names, ask=ask, on_begin=began)
    verdicts = {outcome.scenario.name: outcome for outcome in report.outcomes}
    assert verdicts["state.whole"].verdict is verdicts["motions.ptp_joints"].verdict is Verdict.SHOWN
    assert verdicts["motions.straight"].text == "not wanted"
    assert "touches" in verdicts["conditions.touch"].text
    for name in ("state.push", "link.lost"):
        assert verdicts[name].verdict is Verdict.LEFT_OUT
    assert len(asked) == 2 and "10% of the full speed" in asked[0]
    assert fastest == 0.1 and arm.speed == 1.0
    nobody = testing.run(real, only=["motions.straight"])
    assert nobody.outcomes[0].verdict is Verdict.LEFT_OUT and not nobody.ok


@on(IDEAL)
def test_what_fails_is_reported_with_what_was_measured(arm: ha.Arm) -> None:
    def show(_: ha.Arm) -> None:
        from heptarm.testing.measure import near

        near(1.0, 1.0, 0.1, "one")
        near(2.0, 1.0, 0.1, "two", unit="m")

    broken = replace(testing.find(["state.whole"])[0], name="state.broken", show=show)
    from heptarm.testing import runner

    outcome = runner._try(broken, arm)
    assert outcome.verdict is Verdict.FAILED and "two: 2 m; wanted 1" in outcome.text
    assert len(outcome.measured) == 2
    report = Report("a robot", (outcome, Outcome(broken, Verdict.LEFT_OUT, "no table", 0.0)))
    assert not report.ok and "1 failed" in report.summary and "two: 2 m" in report.table()
    suite = ElementTree.fromstring(report.junit())
    assert (suite.get("failures"), suite.get("skipped")) == ("1", "1")


def test_scenarios_are_found_by_name_group_and_pattern() -> None:
    assert [one.name for one in testing.find(["motions.ptp_joints"])] == ["motions.ptp_joints"]
    assert {one.group for one in testing.find(["servo"])} == {"servo"}
    assert len(testing.find(["*.lost", "state"])) > 3
    with pytest.raises(ha.CommandRejected, match="no scenario 'dance'"):
        testing.find(["dance"])
    assert any(one.risk is Risk.STILL for one in testing.find())


@on(IDEAL)
def test_the_command_names_runs_and_reports(
    capsys: pytest.CaptureFixture[str], tmp_path: Any, arm: ha.Arm, monkeypatch: pytest.MonkeyPatch
) -> None:
    options: dict[str, Any] = {
        "contact": False,
        "faults": False,
        "sim_speed": 4.0,
        "noisy": False,
        "yes": False,
        "target": NO_TARGET,
    }
    assert check.check("model", list_only=True, junit=None, as_json=True, **options) == 0
    reported = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert reported[0]["scenario"] == "model.forward" and reported[0]["risk"] == "still"

    class Lent:
        """The arm of these tests, which the command must not close."""

        def __enter__(self) -> ha.Arm:
            return arm

        def __exit__(self, *_: object) -> None:
            pass

    monkeypatch.setattr(CommandTarget, "connect", lambda *_, **__: Lent())
    junit = tmp_path / "report.xml"
    assert check.check("model.forward", list_only=False, junit=junit, as_json=True, **options) == 0
    *outcomes, last = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert outcomes[0]["verdict"] == "shown" and outcomes[0]["measured"] and last["ok"]
    assert ElementTree.parse(junit).getroot().get("tests") == "1"
