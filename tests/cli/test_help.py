"""Help, completion, and how the command line refuses: for every command and every option."""

from __future__ import annotations

import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from cyclopts import App

from heptarm.arm.link.local_simulator import PrivateCabinet
from heptarm.arm.link.target import parse_target
from heptarm.cli.main import app, current_spelling
from heptarm.cli.progress import timed
from heptarm.errors import ConnectFailed
from tests.cli.running import HEPTARM, refused, run
from tests.interrupts import ctrl_c_interrupts
from tests.retry import retry, silent
from tests.simulators import FASTER


def commands(group: App = app, words: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], App]]:
    for name in group:
        if name.startswith("-"):
            continue
        one = group[name]
        below = [name for name in one if not name.startswith("-")]
        yield from commands(one, (*words, name))
        if not below or one.default_command is not None:
            yield (*words, name), one


COMMANDS = dict(commands())


def test_the_table_has_every_command() -> None:
    assert ("move", "lin-rel") in COMMANDS and ("targets", "add") in COMMANDS and len(COMMANDS) > 20


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_every_option_has_a_help_text_and_no_double(words: tuple[str, ...]) -> None:
    wrong = []
    for argument in COMMANDS[words].assemble_argument_collection(default_parameter=app.default_parameter):
        if not argument.show:
            continue
        if not (argument.parameter.help or "").strip():
            wrong.append(argument.name)
        wrong += [
            name for name in argument.names if name.startswith(("--no-", "--empty-")) and name != "--no-key"
        ]
    assert not wrong


def test_help_lists_no_double() -> None:
    assert "--empty" not in run("sim", "--help").stdout


@pytest.mark.parametrize("words", [("move", "ptp"), ("state",), ("targets", "add"), ("servo",)], ids=" ".join)
def test_help_shows_an_example(words: tuple[str, ...]) -> None:
    done = refused(*words, "--help")
    assert (
        done.returncode == 0 and "For example" in done.stdout and f"heptarm {' '.join(words)} " in done.stdout
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("state", "--no-watch"), "--no-watch"),
        (("move", "ptp", "0", "0"), "ptp"),
        (("servo", "--rate", "fast"), "fast"),
        (("sim", "--empty-fault"), "--empty-fault"),
        (("rotate",), "rotate"),
        (("state", "--rate", "0"), "rate must be in (0, 1000] Hz, got 0 Hz"),
        (("state", "--duration", "-1"), "duration must be in (0, 86400] s, got -1 s"),
        (("servo", "--rate", "0", "--target", "sim://iiwa14"), "rate must be in (0, 1000] Hz, got 0 Hz"),
        (("recover", "--timeout", "-1"), "timeout must be in [0, 86400] s, got -1 s"),
        (("replay", "nowhere.npz"), "nowhere.npz"),
    ],
    ids=lambda one: " ".join(one) if isinstance(one, tuple) else "",
)
def test_every_refusal_is_one_sentence(words: tuple[str, ...], said: str) -> None:
    done = refused(*words)
    assert done.returncode == (2 if "--help" in done.stderr else 1) and done.stdout == "", done.stdout
    (line,) = done.stderr.strip().splitlines()
    assert line.startswith("heptarm: ") and said in line


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_knows_commands_and_options(shell: str) -> None:
    script = refused("completion", shell).stdout
    for word in ("install-cabinet", "lin-rel", "targets", "speed-scaling"):
        assert word in script
    if shell == "bash":
        subprocess.run(["bash", "-n"], input=script, text=True, check=True, timeout=60)


def test_completion_is_installed_by_one_command(tmp_path: Path) -> None:
    home = {"HOME": str(tmp_path), "SHELL": "/bin/bash", "XDG_DATA_HOME": ""}
    done = run("completion", "bash", "--install", **home)
    (script,) = tmp_path.rglob("heptarm")
    assert done.returncode == 0 and str(script) in done.stdout and "lin-rel" in script.read_text()
    assert str(script) in (tmp_path / ".bashrc").read_text()
    done = run("completion", **home)
    assert done.returncode == 1 and "bash, zsh, fish" in done.stderr


@pytest.mark.parametrize(
    ("older", "current"),
    [
        ("sim --app lab --answer 0 --json", "sim app lab --answer 0 --json"),
        ("sim --json --fri=1.15 --fri-port 0", "sim fri 1.15 --json --fri-port 0"),
        ("sim --fri 1.15 --app lab", "sim fri 1.15 --app lab"),
        ("sim --speed 2", "sim --speed 2"),
        ("bench --fri --listen", "bench --fri --listen"),
        ("sim --app", "sim app"),
    ],
)
def test_older_spellings_of_sim_are_still_understood(older: str, current: str) -> None:
    assert current_spelling(older.split()) == current.split()
    assert current_spelling(current.split()) == current.split()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("sim --fri-io Cell.Door<bool", "--fri-io needs heptarm sim fri VERSION (heptarm sim --help)"),
        ("sim app . --fri-io Cell.Door<bool", "--fri-io cannot be used with heptarm sim app: an FRI session"),
        ("sim fri 1.15 --panel", "--panel cannot be used with heptarm sim fri: there is no cabinet"),
        ("sim fri 1.15 --app .", "--app cannot be used with heptarm sim fri: there is no cabinet"),
        ("sim app . --scale 2", "Unknown option: --scale"),
        ("sim app", "heptarm sim app --help"),
    ],
)
def test_an_option_of_another_simulation_names_it(words: str, said: str) -> None:
    done = refused(*words.split())
    assert done.returncode == 2 and said in done.stderr, done.stderr


def test_nothing_is_coloured_in_a_pipe(cabinet) -> None:  # type: ignore[no-untyped-def]
    for words in (("--help",), ("state", "--target", cabinet.target), ("doctor", "--target", cabinet.target)):
        done = run(*words)
        assert "\x1b" not in done.stdout + done.stderr


def on_a_terminal(*words: str, interrupt: str = "") -> tuple[int, str]:
    """A command with a terminal; Ctrl-C once its output matches `interrupt`."""
    ours, theirs = pty.openpty()
    with ctrl_c_interrupts():
        process = subprocess.Popen([*HEPTARM, *words], stdin=theirs, stdout=theirs, stderr=theirs)
    os.close(theirs)
    seen, deadline = "", time.monotonic() + 120
    while time.monotonic() < deadline:
        try:
            if select.select([ours], [], [], 1.0)[0]:
                seen += os.read(ours, 4096).decode()
        except OSError:  # the terminal's other end is closed
            break
        if interrupt and re.search(interrupt, seen):
            process.send_signal(signal.SIGINT)
            interrupt = ""
    code = process.wait(timeout=60)
    os.close(ours)
    return code, seen


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
def test_a_long_motion_shows_progress_and_ctrl_c_reports_that_the_arm_rests() -> None:
    words = ("move", "ptp", "160", "0", "0", "-90", "0", "60", "0", "--deg", "--speed", "0.1")
    target = f"sim://iiwa14?speed={FASTER:g}"

    def attempt() -> subprocess.CompletedProcess[str]:
        code, seen = on_a_terminal(*words, "--target", target, interrupt=r"\d+%, [\d.]+ s left")
        return subprocess.CompletedProcess(words, code, seen, seen)

    done = retry(attempt, silent)
    code, seen = done.returncode, done.stdout
    assert re.search(r"\d+%, [\d.]+ s left", seen), seen
    assert code == 130 and "heptarm: Ctrl-C: the arm was stopped and is at rest" in seen, seen


def test_progress_of_a_known_time() -> None:
    assert timed(1.0, 4.0) == " 25%, 3.0 s left" and timed(5.0, 4.0) == "100%, 0.0 s left"


def test_a_view_without_viser_is_one_sentence() -> None:
    program = (
        "import sys\nsys.modules['viser'] = None\n"
        "from heptarm.panel.process import main\nsys.exit(main(['--target', 'sim://localhost:1']))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False
    )
    first = json.loads(done.stdout)
    assert done.returncode == 1 and done.stderr == ""
    assert (
        first["error"]
        == "this needs the package 'viser', which is not installed (pip install 'heptarm[viz]')"
    )


def test_a_simulator_that_starts_too_slowly_is_one_sentence() -> None:
    with pytest.raises(ConnectFailed, match=r"did not start within 0\.001 s \(check the load"):
        PrivateCabinet.start(parse_target("sim://iiwa14"), timeout=0.001)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("moove", "ptp"), "heptarm --help"),
        (("move", "pttp"), "heptarm move --help"),
        (("move", "ptp", "1"), "heptarm move ptp --help"),
    ],
)
def test_a_wrong_word_names_the_help_that_there_is(words: tuple[str, ...], named: str) -> None:
    done = refused(*words)
    assert done.returncode == 2 and done.stderr.endswith(f"({named})\n"), done.stderr


def test_without_a_target_the_option_is_named() -> None:
    done = run("state")
    assert done.returncode == 1 and "--target sim://iiwa14" in done.stderr, done.stderr
