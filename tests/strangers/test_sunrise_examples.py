"""Projects as laboratories write them run unchanged in the virtual cabinet, with clients that do not know heptarm.

`examples/sunrise` has a TCP server of text, an application that dials the PC and exchanges binary frames, a menu on the
smartPAD, an application beside a cyclic background task with signals, and a recorder of data.
"""

from __future__ import annotations

import re
import shutil

import pytest

from tests.strangers import driving

pytestmark = pytest.mark.skipif(shutil.which("javac") is None, reason="no javac here")


def driven(project: str) -> tuple[str, list[str]]:
    """Log of a project that ends without an error, and the lines of its client."""
    done = driving.DRIVERS[project]()
    assert done.returncode == 0, done.log
    return done.log, list(done.said)


def test_every_project_has_a_driver() -> None:
    here = {path.name for path in driving.SUNRISE.iterdir() if (path / "src").is_dir()}
    assert here - {"probe", "probe2"} == set(driving.DRIVERS)  # the commissioning run has tests of its own


def test_a_server_of_text_moves_the_arm_and_answers_what_is_wrong() -> None:
    log, said = driven("token_server")
    assert said[0:2] == ["rel: done", "moved by 0 60 -40 mm"]
    unknown, number, limit = said[2].removeprefix("wrong: ").split(" | ")
    assert unknown == "error unknown token dance"
    assert number.startswith("error no number")
    assert limit.startswith("error CommandInvalidException") and "A2" in limit
    assert said[3:] == [
        "ptp: done",
        "servo: done | error servo is on",
        "servo moved A7 by 0.2 rad",
        "off: done | error servo is off",
        "force below 5 N: True",
        "bye",
    ]
    assert "waiting on port" in log


@pytest.mark.long  # two of the projects run in every test
def test_an_application_dials_the_pc_and_exchanges_binary_frames() -> None:
    log, said = driven("dial_out")
    assert said == [
        "ptp 0 A1 at 0.30 rad",
        "lin 0 tip lower by 50 mm",
        "stop 0 before the goal: True",
        "far 0 errors 1",
        "refused 1 1",
        "touch 1 nothing was there",
        "end 0",
    ]
    assert "excluded: " in log and "the PC has ended it" in log


@pytest.mark.long  # two of the projects run in every test
def test_a_menu_is_operated_by_dialogs_and_user_keys() -> None:
    log, _ = driven("pad_menu")
    assert "search cancelled" in log
    assert "jobs done: 1 1 2" in log


def test_a_menu_runs_alone_with_answers() -> None:
    with driving.running("pad_menu", "--answer", "1", "--answer", "4") as cabinet:
        done = cabinet.end()
    assert done.returncode == 0, done.log
    assert "jobs done: null 1 null" in done.log


@pytest.mark.long  # two of the projects run in every test
def test_orders_come_by_signals_and_a_background_task_sends_the_state() -> None:
    log, said = driven("station_io")
    assert "2 orders are done" in log
    assert re.fullmatch(r"\w+ AUT busy [01] done 0 valve 5\.00 V", said[0]), said
    assert any(re.fullmatch(r"\w+ AUT busy 1 done 1 valve 3\.50 V", line) for line in said), said
    assert re.fullmatch(r"A7 has been at (5\d|60) deg, 0 of \d+ datagrams lost", said[-1]), said


@pytest.mark.long  # two of the projects run in every test
def test_a_path_is_recorded_by_the_controller_and_by_a_thread() -> None:
    log, said = driven("recorder")
    assert re.search(r"\d+ lines in path\.log, \d+ in samples\.csv", log), log
    assert re.search(r"highest torque of A2: [\d.]+ Nm", log), log
    samples, interval = map(int, re.findall(r"\d+", said[0]))
    assert samples > 100 and interval == 5
    late = re.fullmatch(r"starts (\d+) mm after the start of the path", said[1])
    assert late is not None and 10 <= int(late[1]) <= 40, (
        said
    )  # how soon the recorder starts is the machine's matter
    assert 140 <= int(re.findall(r"\d+", said[2])[0]) <= 155
    assert said[4].endswith("all forces valid: True")
