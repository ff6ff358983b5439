"""Keys of cabinets: every command finds them, nobody else can read them, weak ones are refused."""

from __future__ import annotations

import ast
import json
import os
import re
import socket
import stat
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from cyclopts import App

import heptarm as ha
from heptarm.arm.link.target import parse_target
from heptarm.cli import main, options
from heptarm.io import keys
from heptarm.rl.policy import shipped
from heptarm.sim.runtime.project import read_process_data
from tests.cli.running import objects, run, sim

ROOT = Path(__file__).resolve().parents[2]
KEY = "k7fh-9tqa-x2mn-p4cw-8r3e-vd6y-s5gj"
OTHER = "aaaa-bbbb-cccc-dddd-eeee-ffff-ghij"

#: Commands that connect to nothing that somebody else has started.
WITHOUT_A_CONNECTION = {
    "sim",
    "sim app",
    "sim fri",
    "install-cabinet",
    "key new",
    "key set",
    "key list",
    "key forget",
    "targets list",
    "targets add",
    "targets remove",
    "plot",
    "convert",
    "completion",
    "rl train",
    "rl eval",
    "rl record",
    "twin",
    "export",
    "calibrate board",
    "episodes",
}
#: What else the commands must be given to get as far as their connection.
ARGUMENTS = {
    "move ptp": "0 0 0 0 0 0 0",
    "move lin": "0.5 0 0.5 0 0 0",
    "plan ptp": "0 0 0 0 0 0 0",
    "plan lin": "0.5 0 0.5 0 0 0",
    "plan to": "0.5 0 0.5 0 0 0",
    "teleop": "--poses 30310",
    "teach": "{folder}/taught.npz",
    "replay": "{folder}/recorded.npz",
    "bench": "--fri",
    "calibrate eye": "--camera sim",
    "rl deploy": "{folder}/policy.npz",
}


def commands(app: App, prefix: str = "") -> Iterator[tuple[str, App]]:
    """Every command and how it is typed."""
    for name in app:
        if not name.startswith("-"):
            group = app[name]
            below = list(commands(group, f"{prefix}{name} "))
            yield from below
            if not below or name == "sim":  # a command and a group of others
                yield f"{prefix}{name}", group


EVERY = dict(commands(main.app))
CONNECTING = [name for name in EVERY if name not in WITHOUT_A_CONNECTION]


class Connected(Exception):
    """A command has come as far as its connection."""


@pytest.fixture(autouse=True)
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """No keys are stored, and none is in the environment."""
    monkeypatch.delenv(keys.VARIABLE, raising=False)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    return tmp_path / "config"


@pytest.fixture
def key_file(tmp_path: Path) -> Path:
    file = tmp_path / "cell.key"
    keys.write_key_file(file, KEY)
    return file


@pytest.fixture
def listening() -> Iterator[int]:
    """A port that accepts connections and answers nothing."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield server.getsockname()[1]


# ------------------------------------------------------------------------------------ every command


def test_every_command_names_its_target_and_its_key_in_one_way() -> None:
    assert set(EVERY) >= WITHOUT_A_CONNECTION, "a command of the list is gone"
    for name in CONNECTING:
        arguments = EVERY[name].assemble_argument_collection()
        kinds = [argument.hint for argument in arguments]
        assert {options.CommandTarget, options.CommandTargets} & set(kinds), (
            f"heptarm {name} connects without cli.options.CommandTarget"
        )
        names = {one for argument in arguments for one in argument.names}
        assert {"--target", "--key-file"} <= names, name


def test_no_command_connects_by_itself() -> None:
    for file in sorted((ROOT / "src/heptarm/cli").rglob("*.py")):
        found = [
            node.module
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
            if isinstance(node, ast.ImportFrom) and node.module == "heptarm.arm.connect"
        ]
        assert not found or file.name == "options.py", (
            f"{file.name} must connect by cli.options.CommandTarget.connect"
        )


def test_no_command_takes_the_key_itself(key_file: Path) -> None:
    done = run("sim", "--key", KEY)
    assert done.returncode == 1 and "--key-file" in done.stderr and KEY not in done.stderr
    for name, app in EVERY.items():
        shown = {one for a in app.assemble_argument_collection() if a.show for one in a.names}
        assert "--key" not in shown, name


@pytest.mark.parametrize("name", CONNECTING)
def test_every_command_uses_the_key(
    name: str,
    tmp_path: Path,
    key_file: Path,
    listening: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    if name == "rl deploy":
        monkeypatch.setattr("heptarm.cli.rl.deploy.policy_named", lambda *_: shipped())
    if name == "stop":  # stops before it connects, without a key
        monkeypatch.setattr("heptarm.cli.stop.halt", lambda *_, **__: None)
    if name == "live":  # its extra is not installed here
        monkeypatch.setattr("heptarm.cli.live.require", lambda *_, **__: None)
    if name == "replay":
        ha.Trajectory.of([0.0, 1.0], [[0.0] * 7, [0.1] * 7]).save(tmp_path / "recorded.npz")
    used: list[str | None] = []

    def connect(target: str, *, key_file: Path | None, **_: object) -> None:
        parsed = parse_target(target)
        used.append(keys.find_key(key_file=key_file, host=parsed.host, port=parsed.port))
        raise Connected

    monkeypatch.setattr("heptarm.arm.connect.connect", connect)
    words = [*ARGUMENTS.get(name, "").format(folder=tmp_path).split(), "--target", f"127.0.0.1:{listening}"]

    def key(*more: str) -> str | None:
        used.clear()
        with pytest.raises(Connected):
            main.app([*name.split(), *words, *more], exit_on_error=False)
        return used[0]

    assert key() is None
    stored = keys.stored_key("localhost", listening)
    keys.write_key_file(stored.file, "stored" + KEY)
    assert key() == "stored" + KEY
    monkeypatch.setenv(keys.VARIABLE, "environment" + KEY)
    assert key() == "environment" + KEY
    assert key("--key-file", str(key_file)) == KEY


def test_a_keyed_cabinet_from_the_command_line(key_file: Path, config: Path) -> None:
    with sim("--key-file", str(key_file)) as ready:
        target = ready["target"]
        refused = run("state", "--target", target)
        assert refused.returncode == 1 and "heptarm key set" in refused.stderr
        assert run("state", "--target", target, HEPTARM_KEY=OTHER).returncode == 1
        assert run("state", "--target", target, HEPTARM_KEY=KEY).returncode == 0
        (stopped,) = objects("stop", "--target", target, "--key-file", str(key_file))
        assert stopped == {"stopped": True, "at_rest": True}, "with the key, a stop sees the arm come to rest"
        assert run("key", "set", "--target", target, "--key-file", str(key_file)).returncode == 0
        (seen,) = objects("state", "--target", target)
        assert seen["virtual"]
        with ha.connect(target, timeout=30.0) as arm:
            assert arm.in_control
        assert KEY not in commands_of_this_user()


def commands_of_this_user() -> str:
    """The command lines of all processes, as any user of the machine can read them."""
    if sys.platform != "linux":
        return subprocess.run(["ps", "-Ao", "args"], capture_output=True, text=True, check=False).stdout
    found = []
    for one in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            found.append(one.read_bytes().decode(errors="replace"))
        except OSError:
            continue
    return "\n".join(found)


def test_a_private_simulator_takes_the_key_and_no_other_process_sees_it(key_file: Path) -> None:
    with ha.connect("sim://iiwa7", key_file=key_file, timeout=30.0) as arm:
        port = arm.connection.cabinet.port
        assert KEY not in commands_of_this_user()
        with pytest.raises(ha.ConnectFailed, match="asks for a pre-shared key"):
            ha.connect(f"127.0.0.1:{port}", control=False, timeout=30.0)
        with ha.connect(f"127.0.0.1:{port}", key=KEY, control=False, timeout=30.0) as observer:
            assert observer.controller == arm.controller


def test_a_cabinet_that_is_open_to_all_reports_it_on_the_smartpad_and_in_doctor(
    tmp_path: Path, key_file: Path
) -> None:
    risk = "any program in the network can move"
    with (tmp_path / "log").open("w") as log, sim("--host", "0.0.0.0", "--verbose", stderr=log) as ready:
        target = f"sim://127.0.0.1:{ready['port']}"
        assert verdict(target)["how"] == "note" and risk in verdict(target)["found"]
    assert risk in (tmp_path / "log").read_text()
    with (
        (tmp_path / "log").open("w") as log,
        sim("--host", "0.0.0.0", "--verbose", "--key-file", str(key_file), stderr=log) as ready,
    ):
        target = f"sim://127.0.0.1:{ready['port']}"
        assert verdict(target, "--key-file", str(key_file))["how"] == "ok"
    assert "listens on" in (tmp_path / "log").read_text() and risk not in (tmp_path / "log").read_text()


def verdict(target: str, *more: str) -> dict[str, str]:
    """What `heptarm doctor` finds about the protection of a cabinet."""
    done = run("doctor", "--target", target, "--json", *more)
    found: dict[str, str]
    (found,) = (one for one in map(json.loads, done.stdout.splitlines()) if one["what"] == "protection")
    return found


def test_the_application_refuses_a_weak_key_of_its_process_data(tmp_path: Path) -> None:
    project = tmp_path / "RoboticsAPI.data.xml"
    text = (ROOT / "cabinet/project/RoboticsAPI.data.xml").read_text(encoding="utf-8")
    project.write_text(re.sub(r'(id="heptarm.key" [^>]* value=)""', r'\1"hunter2"', text), encoding="utf-8")
    done = run("sim", "--port", "0", "--project", str(project))
    assert done.returncode == 1 and "got 20 bits" in done.stderr and "heptarm key new" in done.stderr
    assert "hunter2" not in done.stderr


# ------------------------------------------------------------------------------------ files and strength


@pytest.mark.skipif(sys.platform == "win32", reason="modes of POSIX")
@pytest.mark.parametrize("mode", [0o644, 0o640, 0o604, 0o620])
def test_a_key_that_others_can_read_is_refused(key_file: Path, mode: int) -> None:
    key_file.chmod(mode)
    with pytest.raises(ha.CommandRejected, match=rf"0600, got {mode:04o}.*chmod 600") as refused:
        keys.read_key_file(key_file)
    assert KEY not in str(refused.value)
    key_file.chmod(0o400)
    assert keys.read_key_file(key_file) == KEY


@pytest.mark.parametrize("content", ["", "\n", f"{KEY}\n{KEY}\n", "\xff", KEY * 200, "short", "a" * 40])
def test_a_file_without_a_usable_key_is_refused(key_file: Path, content: str) -> None:
    key_file.write_bytes(content.encode("latin-1"))
    with pytest.raises(ha.CommandRejected, match="must") as refused:
        keys.read_key_file(key_file)
    assert not content.strip() or content.strip() not in str(refused.value)


@pytest.mark.parametrize(
    "weak", ["sesame", "hunter2", "a" * 100, "abab" * 20, "12345678901234567890", f" {KEY}", f"{KEY}\x07"]
)
def test_a_weak_key_is_refused_before_anything_is_sent(weak: str) -> None:
    with pytest.raises(ha.CommandRejected, match="key new") as refused:
        ha.connect("127.0.0.1:9", key=weak)
    assert weak not in str(refused.value)


def test_generated_keys_are_strong_and_differ() -> None:
    made = {keys.new_key() for _ in range(50)}
    assert len(made) == 50
    for key in made:
        assert re.fullmatch(r"([a-km-np-z2-9]{4}-){6}[a-km-np-z2-9]{4}", key)
        assert keys.check_key(key, "a test") == key


def test_key_and_key_file_are_not_combined(key_file: Path) -> None:
    with pytest.raises(ha.CommandRejected, match="cannot be combined"):
        ha.connect("127.0.0.1:9", key=KEY, key_file=key_file)


def test_an_empty_key_overrides_what_is_stored(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(keys.VARIABLE, KEY)
    assert keys.find_key() == KEY
    assert keys.find_key(key="") is None


def test_keys_are_made_listed_and_forgotten(config: Path) -> None:
    assert objects("key", "list") == []
    (made,) = objects("key", "new", "--target", "Cell-1.example:30002")
    assert Path(made["file"]).read_text() == made["key"] + "\n"
    if sys.platform != "win32":
        assert stat.S_IMODE(os.stat(made["file"]).st_mode) == 0o600
        assert stat.S_IMODE(os.stat(config / "heptarm/keys").st_mode) == 0o700
    again = run("key", "new", "--target", "cell-1.example:30002")
    assert again.returncode == 1 and "--replace" in again.stderr
    (new,) = objects("key", "new", "--target", "cell-1.example:30002", "--replace")
    assert new["key"] != made["key"]
    assert run("key", "new", "--target", "[fe80::1]:30001").returncode == 0
    listed = objects("key", "list")
    assert {one["target"] for one in listed} == {"cell-1.example:30002", "[fe80::1]:30001"}
    assert new["key"] not in run("key", "list").stdout
    assert run("key", "forget", "--target", "cell-1.example:30002").returncode == 0
    assert run("key", "forget", "--target", "cell-1.example:30002").returncode == 1
    assert run("key", "new", "--target", "sim://iiwa14").returncode == 1


def test_install_cabinet_makes_a_key_unless_declined(tmp_path: Path) -> None:
    def key_in(folder: Path) -> object:
        return read_process_data(folder / "RoboticsAPI.data.xml").values["heptarm.key"]

    done = run("install-cabinet", "--out", str(tmp_path / "keyed"))
    assert done.returncode == 0, done.stderr
    key = keys.read_key_file(tmp_path / "keyed/heptarm.key")
    assert key_in(tmp_path / "keyed") == key and key not in done.stdout + done.stderr
    if sys.platform != "win32":
        assert stat.S_IMODE((tmp_path / "keyed/RoboticsAPI.data.xml").stat().st_mode) == 0o600

    (reported,) = objects("install-cabinet", "--out", str(tmp_path / "named"), "--target", "10.0.0.9")
    stored = keys.stored_key("10.0.0.9", 30001)
    assert reported["key_file"] == str(stored.file) and key_in(tmp_path / "named") == keys.read_key_file(
        stored.file
    )
    objects("install-cabinet", "--out", str(tmp_path / "once more"), "--target", "10.0.0.9")
    assert key_in(tmp_path / "once more") == key_in(tmp_path / "named"), "other clients keep their key"

    done = run("install-cabinet", "--out", str(tmp_path / "open"), "--no-key")
    assert done.returncode == 0 and "can move the robot" in done.stderr
    assert key_in(tmp_path / "open") == "" and not (tmp_path / "open/heptarm.key").exists()
