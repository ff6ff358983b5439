"""Every command against a virtual cabinet, as a user types it."""

from __future__ import annotations

import itertools
import json
import math
import re
import subprocess
import sys
import threading
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

import heptarm as ha
from heptarm.cli.demo import demo
from heptarm.cli.options import CommandTarget
from heptarm.cli.output import answer_of, confirm
from heptarm.io.panel_box import PanelBox, PlanOutline
from heptarm.values.robot import robot
from heptarm.wire.messages import MAJOR, MINOR
from tests.cli.running import HEPTARM, objects, refused, run, sim
from tests.conftest import RunningCabinet
from tests.retry import retry, starved


@pytest.fixture
def target(cabinet: RunningCabinet) -> str:
    return cabinet.target


def test_help_names_every_command() -> None:
    text = run("--help").stdout
    for command in (
        "sim",
        "state",
        "move",
        "servo",
        "teach",
        "replay",
        "stop",
        "doctor",
        "install-cabinet",
        "demo",
    ):
        assert command in text


def test_the_package_runs_as_the_command() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "heptarm", "move", "--help"],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert done.stdout.startswith("Usage: heptarm move")


def test_help_imports_no_command() -> None:
    listing = (
        "import sys\n"
        "sys.argv = ['heptarm', '--help']\n"
        "from heptarm.cli import main\n"
        "try:\n    main.main()\nexcept SystemExit:\n    pass\n"
        "names = [place.split(':')[0] for place in main.COMMANDS.values()]\n"
        "loaded = [one for one in (*names, 'numpy') if {one, f'heptarm.cli.{one}'} & set(sys.modules)]\n"
        "print('imported:', loaded)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", listing], capture_output=True, text=True, timeout=60, check=True
    )
    assert "imported: []" in done.stdout
    assert "Record a trajectory while a person guides the arm by hand." in done.stdout  # the summary of teach


def test_sim_can_be_connected_to_and_ends_on_ctrl_c() -> None:
    with sim("--model", "med14") as ready:
        (state,) = objects("state", "--target", ready["target"])
        assert state["robot"] == "LBR Med 14 R820" and state["virtual"]
    assert run("state", "--target", ready["target"]).returncode == 1


def test_an_error_of_the_host_ends_with_a_line_of_heptarm() -> None:
    done = run("sim", "--port", "0", JAVA_TOOL_OPTIONS="-XX:+NoSuchOption")
    assert done.returncode == 1 and "Traceback" not in done.stderr
    last = done.stderr.splitlines()[-1]
    assert last.startswith("heptarm: the virtual cabinet does not start") and "--port" not in last


def test_sim_on_a_taken_port_reports_it() -> None:
    with sim() as ready:
        done = run("sim", "--port", str(ready["port"]))
        assert done.returncode == 1 and str(ready["port"]) in done.stderr and "--port" in done.stderr


def test_state_as_a_table(target: str) -> None:
    done = run("state", "--target", target)
    assert done.returncode == 0
    for word in ("q [deg]", "tau_ext [Nm]", "flange", "ready to move"):
        assert word in done.stdout


def test_state_watched_into_a_pipe_appears_at_once(target: str) -> None:
    command = [*HEPTARM, "state", "--watch", "--target", target]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as watching:
        assert watching.stdout is not None
        titles = [line for line, _ in zip((one for one in watching.stdout if "LBR" in one), range(2))]
        watching.kill()
    assert len(titles) == 2


def test_state_watched_for_a_while(target: str) -> None:
    seen = objects("state", "--watch", "--rate", "20", "--duration", "0.5", "--target", target)
    assert 1 <= len(seen) <= 12
    assert all(a["stamp_ns"] < b["stamp_ns"] for a, b in itertools.pairwise(seen))


def test_move_ptp_in_degrees_with_negative_angles(target: str) -> None:
    (done,) = objects(
        "move", "ptp", "10", "30", "0", "-90", "0", "60", "-5", "--deg", "--speed", "0.5", "--target", target
    )
    assert done["cause"] == "finished" and done["residual_rad"] < 1e-4
    assert done["q"][6] == pytest.approx(math.radians(-5), abs=1e-3)


def test_servo_swings_an_axis_and_reports_how_the_stream_went(target: str) -> None:
    words = ("servo", "--axis", "6", "--rate", "20", "--duration", "2", "--json", "--target", target)
    done = retry(lambda: run(*words), starved)
    reported = json.loads(done.stdout)
    assert reported["received"] == reported["sent"] > 1
    assert reported["refused"] == reported["late"] == 0 and reported["largest_lag_rad"] < 0.5
    done = retry(lambda: run("servo", "--duration", "1", "--datagrams", "--target", target), starved)
    rate = re.search(r" targets at ([\d.]+) Hz", done.stdout)
    assert rate and 1.0 < float(rate[1]) < 110.0 and "when applied" in done.stdout
    assert run("servo", "--axis", "8", "--target", target).returncode == 1


def test_move_lin_and_lin_rel(target: str) -> None:
    objects(
        "move", "ptp", "0", "30", "0", "-90", "0", "60", "0", "--deg", "--speed", "0.5", "--target", target
    )
    (down,) = objects(
        "move", "lin-rel", "--z", "-0.05", "--frame", "base", "--speed", "0.5", "--target", target
    )
    x, y, z = down["xyz"]
    pose = [f"{v:.6f}" for v in (x, y + 0.05, z)]
    (side,) = objects("move", "lin", *pose, "180", "0", "180", "--deg", "--speed", "0.5", "--target", target)
    assert side["xyz"] == pytest.approx([x, y + 0.05, z], abs=2e-4)


def test_dry_run_moves_nothing(target: str) -> None:
    (before,) = objects("state", "--target", target)
    done = run(
        "move", "ptp", "50", "30", "0", "-90", "0", "60", "0", "--deg", "--dry-run", "--target", target
    )
    (after,) = objects("state", "--target", target)
    assert done.returncode == 0 and "nothing was moved" in done.stdout and "at full override" in done.stdout
    assert after["q"] == pytest.approx(before["q"], abs=1e-6)


@contextmanager
def open_panel() -> Iterator[list[PlanOutline]]:
    """The plans that an open panel takes meanwhile."""
    panel, taken, ended = PanelBox(["iiwa14"]), list[PlanOutline](), threading.Event()

    def take() -> None:
        is_last = False
        while not is_last:
            is_last = ended.wait(0.5)
            plan = panel.take()
            taken.extend([plan] if plan else [])

    panel.take()
    looking = threading.Thread(target=take)
    looking.start()
    try:
        yield taken
    finally:
        ended.set()
        looking.join()
        panel.close()


def test_plan_reports_limits_and_collisions_and_moves_nothing(
    target: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    (before,) = objects("state", "--target", target)
    words = ("plan", "ptp", "0", "90", "0", "-30", "0", "60", "0", "--deg", "--speed", "0.5")
    (ahead,) = objects(*words, "--out", str(tmp_path / "plan.svg"), "--target", target)
    assert ahead["closest"]["velocity"]["fraction"] == pytest.approx(0.5, abs=0.02)
    assert ahead["duration_s"] > 0.5 and (tmp_path / "plan.svg").stat().st_size > 1000
    assert ahead["checked"] is False and ahead["end_q"] == pytest.approx(
        np.radians([0, 90, 0, -30, 0, 60, 0])
    )
    with open_panel() as ghosts:
        done = run(*words, "--box", "0.6,0,0.1,0.6,0.8,0.2", "--show", "--target", target)
    assert done.returncode == 1 and re.search(r"collisions .*link_\d .*box 0 after", done.stdout)
    (ghost,) = ghosts
    assert len(ghost.touches) == 1 and ghost.q[-1] == pytest.approx(ahead["end_q"])
    refused = run("plan", "lin-rel", "--x", "3", "--target", target)
    assert refused.returncode == 1 and "Can not plan motion" in refused.stderr
    (after,) = objects("state", "--target", target)
    assert after["q"] == pytest.approx(before["q"], abs=1e-6)


#: Joint positions beside a wall [deg].
RIGHT = ("40", "50", "0", "-80", "0", "50", "0")


def test_plan_to_finds_a_path_around_a_box_and_moves_nothing(target: str) -> None:
    run("move", "ptp", "-40", *RIGHT[1:], "--deg", "--speed", "1", "--target", target)
    (before,) = objects("state", "--target", target)
    goal = ("plan", "to", *RIGHT, "--deg", "--box", "0.6,0,0.3,0.5,0.02,0.6")
    words = (*goal, "--timeout", "60", "--seed", "4", "--target", target)
    (found,) = objects(*words)
    assert found["end_q"] == pytest.approx(np.radians([40, 50, 0, -80, 0, 50, 0]), abs=1e-6)
    assert found["clearance_m"] > 0.004 and found["states"] >= 2 and len(found["points"]) >= 2
    (faster,) = objects(*words, "--improve", "100")
    assert faster["states"] >= found["states"] + 100 and faster["duration_s"] <= found["duration_s"]
    printed = run(*words)
    assert printed.returncode == 0 and "waypoints, clearance" in printed.stdout.splitlines()[0]
    (after,) = objects("state", "--target", target)
    assert after["q"] == pytest.approx(before["q"], abs=1e-6)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ("move", "ptp", "0", "150", "0", "-90", "0", "60", "0", "--deg"),
            ("A2", "150.00", "[-120, 120] deg"),
        ),
        (("move", "ptp", "0", "inf", "0", "-1", "0", "1", "0"), ("inf",)),
        (("move", "lin-rel", "--x", "3"), ("Can not plan motion",)),
        (("move", "lin", *"000000", "--frame", "/Table"), ("one of base, got '/Table'", "heptarm.frames")),
        (("plan", "lin", *"000000", "--frame", "/Table"), ("one of base, got '/Table'",)),
        (("plan", "to", *"0000"), ("seven joint positions or the six numbers of a pose, got 4 numbers",)),
        (
            ("plan", "to", "0.6", "0", "0.15", "180", "0", "180", "--deg", "--box", "0.6,0,0.1,0.6,0.8,0.2"),
            ("goal is in collision",),
        ),
        (("move", "lin-rel", "--x", "0.01", "--speed", "1.5"), ("speed", "(0, 1]")),
        (("move", "lin-rel", "--x", "0.01", "--speed", "50"), ("did you mean 0.5?",)),
        (("move", "ptp", "0", "90", "0", "-90", "0", "60", "0"), ("did you mean them in degrees? --deg",)),
        (("move", "lin", "0.5", "0", "0.4", "180", "0", "180"), ("did you mean them in degrees? --deg",)),
    ],
)
def test_refusals_are_one_sentence_and_exit_code_1(
    target: str, arguments: tuple[str, ...], words: tuple[str, ...]
) -> None:
    done = refused(*arguments, "--target", target)
    assert done.returncode == 1 and done.stdout == ""
    assert len(done.stderr.strip().splitlines()) == 1 and "Traceback" not in done.stderr
    for word in words:
        assert word in done.stderr


def test_a_missing_target_shows_examples() -> None:
    done = run("state")
    assert done.returncode == 1 and "HEPTARM_TARGET" in done.stderr and "sim://iiwa14" in done.stderr


def test_the_target_may_come_from_the_environment(target: str) -> None:
    assert run("stop", HEPTARM_TARGET=target).stdout.split("\n")[-2] == "the arm is at rest"


def test_doctor_looks_at_a_cabinet(target: str) -> None:
    verdicts = {one["what"]: one for one in objects("doctor", "--target", target)}
    assert verdicts["session"]["how"] == verdicts["network"]["how"] == verdicts["safety"]["how"] == "ok"
    assert "us median" in verdicts["round trip"]["found"]
    assert verdicts["options"]["how"] == "ok" and "Sunrise.FRI" in verdicts["options"]["found"]
    docs = Path(__file__).parents[2] / "docs"
    for verdict in verdicts.values():
        place, _, _ = verdict["page"].partition("/docs/")[2].partition("#")
        assert (docs / place).is_file(), verdict
    assert re.search(r"\d+ of \d+ pings answered by UDP", verdicts["datagrams"]["found"])


def test_doctor_names_what_to_do_when_nobody_answers() -> None:
    done = run("doctor", "--target", "127.0.0.1:9")
    assert done.returncode == 1 and "does not answer" in done.stdout.replace("\n", " ")


def test_install_cabinet_writes_sources_and_steps_once(tmp_path: Path) -> None:
    out = tmp_path / "cabinet"
    (reported,) = objects("install-cabinet", "--out", str(out))
    assert reported["protocol"] == f"{MAJOR}.{MINOR}"
    assert (out / "src/heptarm/app/HeptarmApplication.java").exists()
    assert (out / "src/heptarm/wire/Messages.java").exists()
    with zipfile.ZipFile(reported["archive"]) as archive:  # one file to carry to Workbench
        names = archive.namelist()
        assert len(names) == reported["files"] and all((out / "src" / name).exists() for name in names)
        settings = archive.read("heptarm/core/session/ServerSettings.java").decode()
    assert f'SOURCES = "{reported["sources"]}"' in settings and len(reported["sources"]) == 12
    assert "heptarm.key" not in names
    assert (
        "heptarm.port" in (out / "RoboticsAPI.data.xml").read_text()
        and "T1" in (out / "INSTALL.md").read_text()
    )
    again = run("install-cabinet", "--out", str(out))
    assert again.returncode == 1 and "must be a new or empty folder" in again.stderr


def test_install_cabinet_leaves_options_out(tmp_path: Path) -> None:
    (reported,) = objects("install-cabinet", "--out", str(tmp_path / "some"), "--without", "hand-guiding,fri")
    assert reported["without"] == ["fri", "hand-guiding"]
    (other,) = objects("install-cabinet", "--out", str(tmp_path / "all"))
    assert reported["sources"] != other["sources"]
    app = tmp_path / "some/src/heptarm/app"
    assert "left out" in (app / "SunriseFri.java").read_text(encoding="utf-8")
    assert "SmartServo" in (app / "SunriseServo.java").read_text(encoding="utf-8")
    done = run("install-cabinet", "--out", str(tmp_path / "none"), "--without", "welding")
    assert done.returncode == 1 and "servoing, fri, hand-guiding, got 'welding'" in done.stderr
    assert not (tmp_path / "none").exists()


def test_demo_goes_as_designed_and_saves_a_plot(tmp_path: Path) -> None:
    plot = tmp_path / "demo.png"
    steps = objects("demo", "--plot", str(plot))
    assert [one["cause"] for one in steps] == [
        "finished",
        "finished",
        "finished",
        "cancelled",
        "refused",
        "finished",
    ]
    assert all(one["as_designed"] for one in steps)
    assert plot.read_bytes().startswith(b"\x89PNG") and plot.stat().st_size > 20_000


def test_the_demo_moves_no_real_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    arm = Mock(robot=robot("iiwa14"), is_virtual=False)
    monkeypatch.setattr(CommandTarget, "connect", lambda *_, **__: nullcontext(arm))
    with pytest.raises(ha.CommandRejected, match="must be a virtual arm, got the real LBR iiwa 14"):
        demo(target=CommandTarget(text="172.31.1.147"))
    arm.move.assert_not_called()


def test_the_end_of_the_terminal_is_no(monkeypatch: pytest.MonkeyPatch) -> None:
    def ended(_: str) -> str:
        raise EOFError

    monkeypatch.setattr("sys.stdin", Mock(isatty=lambda: True))
    monkeypatch.setattr("builtins.input", ended)
    assert not confirm("Move the real robot?") and answer_of("success?") == ""
