"""The commissioning run on the virtual cabinet, and the page of assumptions that it settles."""

from __future__ import annotations

import json
import re
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import heptarm as ha
from heptarm import testing
from heptarm.cli import commissioning as command
from heptarm.errors import CommandRejected, ModeConflict
from heptarm.testing import commissioning
from heptarm.testing.commissioning.person import PROVES
from heptarm.testing.commissioning.run import announcement
from heptarm.values.state import OperationMode
from tests.cli.running import run
from tests.retry import held_up, retry

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "explanation" / "fidelity.md"
STEPS = {one.name: one for one in commissioning.steps()}
#: Steps in which a simulator measures nothing: a document, a person or a program on the cabinet has the answer.
READ = {
    "sunrise.names",
    "sunrise.device",
    "sunrise.hold_zero",
    "sunrise.reading",
    "drives.thresholds",
    "drives.message",
    "drives.med_torques",
    "safety.counted_load",
    "fri.limit_text",
}


def tables() -> Iterator[tuple[str, list[dict[str, str]]]]:
    """Section and rows of each table of the page that states how sure its rows are."""
    section, columns = "", [""]
    found: list[dict[str, str]] = []
    for line in [*PAGE.read_text(encoding="utf-8").splitlines(), ""]:
        section = line.removeprefix("## ") if line.startswith("## ") else section
        cells = [cell.strip() for cell in line.strip("|").split("|")] if line.startswith("|") else []
        if not cells:
            if "sure?" in columns:
                yield section, found
            columns, found = [], []
        elif not columns:
            columns = cells
        elif not set(line) <= set("|-"):
            found.append(dict(zip(columns, cells, strict=True)))


def rows() -> Iterator[tuple[str, str, list[str]]]:
    """Behaviour, certainty and named steps of each row that names steps or has a place for them."""
    for _, found in tables():
        for row in found:
            if "settled by" in row:
                names = re.findall(r"`([\w.]+)`", row["settled by"])
                yield next(iter(row.values())), row["sure?"], names


def test_every_table_names_the_steps_that_settle_it() -> None:
    without = {section for section, found in tables() if "settled by" not in found[0]}
    assert not without, "add a column `settled by` with a step for each assumption"


def test_each_assumption_names_the_steps_that_settle_it() -> None:
    found = list(rows())
    assert len(found) > 20
    for behaviour, sure, names in found:
        doubtful = re.search(r"assumed|unknown|guess", sure)
        assert bool(names) == bool(doubtful), behaviour
        assert set(names) <= set(STEPS), behaviour


def test_each_step_settles_an_assumption() -> None:
    named = {name for _, _, names in rows() for name in names}
    assert named == set(STEPS)


def test_each_step_announces_what_moves() -> None:
    for one in STEPS.values():
        assert one.question.endswith("?"), one.name
        if one.movement is not None:
            assert re.search(r"\d|to three postures", one.movement.far), one.name
            assert one.movement.fast and 0.0 < one.movement.ceiling <= 0.5, one.name
    assert [one.name for one in STEPS.values() if one.movement and one.movement.ceiling > 0.1] == [
        "safety.t1_speed"
    ]


@pytest.fixture(scope="module")
def arm() -> Iterator[ha.Arm]:
    with ha.connect(testing.stage(speed=2), timeout=30.0, watchdog=5.0) as connected:
        yield connected


@pytest.mark.long
def test_every_step_without_fri_agrees_on_the_virtual_cabinet(arm: ha.Arm) -> None:
    seen: list[int] = []
    gaps: list[str] = []
    only = [
        group for group in ("sunrise", "sensors", "dynamics", "redundancy", "contact", "drives", "safety")
    ]
    began = 0

    def commission() -> commissioning.CommissioningReport:
        nonlocal began
        began = time.monotonic_ns()
        seen.clear()
        gaps.clear()
        return commissioning.commission(arm, commissioning.SimulatedPerson(arm), only=only, on_end=ended)

    def ended(report: commissioning.CommissioningReport) -> None:
        nonlocal began
        seen.append(len(report.outcomes))
        gaps.append(held_up(arm, began))  # the states of a step, before newer ones take their place
        began = time.monotonic_ns()

    def late(report: object) -> str:
        agrees = isinstance(report, commissioning.CommissioningReport) and report.ok
        return "" if agrees else next(filter(None, gaps), held_up(arm, began))

    report = retry(commission, late)
    assert seen == list(range(1, len(report.outcomes) + 1))
    for one in report.outcomes:
        expected = (
            commissioning.Agreement.SKIPPED if one.step.name in READ else commissioning.Agreement.AGREES
        )
        assert one.verdict is expected, report.markdown()
        if one.step.name in READ:
            assert one.text.startswith(PROVES)
        else:
            assert one.comparisons
    assert report.ok and report.is_simulated
    assert "proves the run, not the robot" in report.markdown()
    assert json.loads(report.json())["counts"]["differs"] == 0
    assert arm.wait_until(lambda s: s.safety.mode is OperationMode.AUT)
    assert arm.speed == 1.0


@pytest.mark.long
def test_every_step_of_fri_agrees_on_the_virtual_cabinet() -> None:
    def attempt() -> commissioning.CommissioningReport:
        with ha.connect(testing.stage(speed=0.5), timeout=30.0, watchdog=5.0) as slow:
            return commissioning.commission(slow, commissioning.SimulatedPerson(slow), only=["fri"])

    def late(report: object) -> str:
        if not isinstance(report, commissioning.CommissioningReport) or report.ok:
            return ""
        return "FRI answers came late" if "came too late" in report.markdown() else ""

    report = retry(attempt, late)
    verdicts = {one.step.name: one.verdict.value for one in report.outcomes}
    assert verdicts.pop("fri.limit_text") == "skipped"
    assert set(verdicts.values()) == {"agrees"}, report.markdown()


class Answering:
    """A person with prepared answers; keeps what was asked."""

    def __init__(self, *, willing: bool = True, **answers: str) -> None:
        self.willing = willing
        self.answers = answers
        self.asked: list[str] = []

    def agrees(self, question: str) -> bool:
        self.asked.append(question)
        return self.willing

    def does(self, action: commissioning.PersonTask) -> None:
        raise AssertionError(action)

    def finds(self, action: commissioning.PersonTask) -> bool:
        return False

    def reads(self, question: str) -> str:
        self.asked.append(question)
        return next((answer for word, answer in self.answers.items() if word in question), "")


def verdict(arm: ha.Arm, person: commissioning.Person, name: str) -> commissioning.StepOutcome:
    return commissioning.commission(arm, person, only=[name]).outcomes[0]


def test_without_consent_nothing_moves(arm: ha.Arm) -> None:
    before = arm.wait_for_rest().q_cmd
    person = Answering(willing=False)
    outcome = verdict(arm, person, "dynamics.braking")
    assert outcome.verdict.value == "skipped" and outcome.text == "not wanted"
    assert (arm.wait_for_rest().q_cmd == before).all()
    assert "A7 moves by less than 60 deg and back, a tenth of its speed. Go on?" in person.asked[0]
    assert person.asked[0].endswith(announcement(STEPS["dynamics.braking"], arm)[-40:])


def test_what_a_person_reads_is_compared(arm: ha.Arm) -> None:
    agrees = verdict(arm, Answering(multiple="1,5"), "drives.thresholds")
    assert [one.agrees for one in agrees.comparisons] == [True, False]  # of the speed, of the torque
    outcome = verdict(arm, Answering(error="ERROR: Achse 4 ausgefallen"), "drives.message")
    assert outcome.verdict.value == "differs"
    assert outcome.comparisons[0].measured == "ERROR: Achse 4 ausgefallen"
    assert "must be a number" in verdict(arm, Answering(multiple="fast"), "drives.thresholds").text
    assert "no drive has tripped" in verdict(arm, Answering(), "drives.acknowledging").text
    text = "MotionAborted: illegal AXIS delta in A2"
    assert verdict(arm, Answering(limit=text), "fri.limit_text").verdict.value == "agrees"


def test_a_robot_outside_t1_is_refused_and_yes_is_for_simulators_only(
    arm: ha.Arm, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("heptarm.testing.commissioning.run.has_operator", lambda _: False)
    arm.wait_until(lambda s: s.safety.mode is OperationMode.AUT, timeout=30.0)  # the run before ends with it
    with pytest.raises(ModeConflict, match=r"must be T1 .*, got AUT"):
        commissioning.commission(arm, Answering())
    monkeypatch.setattr(type(arm), "is_virtual", property(lambda _: False))
    with pytest.raises(CommandRejected, match="--yes is refused"):
        command.person(arm, yes=True, console=None)  # type: ignore[arg-type]


def test_a_step_that_does_not_exist_is_refused(arm: ha.Arm) -> None:
    with pytest.raises(CommandRejected, match="no step 'dance'"):
        commissioning.commission(arm, Answering(), only=["dance"])


def test_the_command_line_writes_both_files(tmp_path: Path) -> None:
    base = tmp_path / "robot.md"
    words = (
        "check",
        "--commission",
        "dynamics.braking",
        "drives.message",
        "--sim-speed",
        "3",
        "--report",
        str(base),
    )

    def lost(done: object) -> str:
        said = str(getattr(done, "stdout", ""))
        return "a controller was silent" if "the connection to" in said and " is lost" in said else ""

    done = retry(lambda: run(*words), lost)
    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads(base.with_suffix(".json").read_text())
    assert [one["verdict"] for one in found["steps"]] == ["agrees", "skipped"]
    assert "| dynamics.braking | A7 moves on after the brake began by |" in base.read_text()
    assert "1 agrees, 0 differs, 1 skipped" in done.stdout
    done = run("check", "--commission", "--list")
    assert all(name in done.stdout for name in ("fri.handshake", "safety.t1_speed"))
    assert run("check", "--report", "x").returncode != 0


@pytest.mark.skipif(shutil.which("javac") is None, reason="no javac here")
def test_the_probe_on_the_cabinet_settles_what_only_a_program_there_sees(tmp_path: Path, arm: ha.Arm) -> None:
    probe = ROOT / "examples" / "sunrise" / "probe"
    done = run("sim", "--app", str(probe), "--app-data", f"folder={tmp_path}")
    assert done.returncode == 0, done.stdout + done.stderr
    person = Answering(SunriseProbe=str(tmp_path / "sunrise-probe.txt"))
    report = commissioning.commission(arm, person, only=["sunrise"])
    verdicts = {one.step.name: one.verdict.value for one in report.outcomes}
    assert "skipped" not in verdicts.values(), report.markdown()
    timed = {"sunrise.hold_zero", "sunrise.reading"}  # a busy machine may be slower than a cabinet
    assert {verdicts[name] for name in set(verdicts) - timed} == {"agrees"}, report.markdown()
    facts = (tmp_path / "sunrise-probe.txt").read_text()
    assert "device = LBR_iiwa_14_R820_1" in facts and "java = " in facts
