"""Saved targets: the file, the commands, and programs that connect by a name."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

import heptarm as ha
from heptarm.arm.link.target import parse_target
from heptarm.errors import CommandRejected
from heptarm.io import targets
from heptarm.io.targets import SavedTarget
from tests.cli.running import objects, run

KEY = "k7fh-9tqa-x2mn-p4cw-8r3e-vd6y-s5gj"


@pytest.fixture(autouse=True)
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    yield tmp_path / "config" / "heptarm"


def test_the_file_of_a_person_is_kept_but_for_what_was_asked(config: Path) -> None:
    config.mkdir(parents=True)
    file = config / "targets.toml"
    file.write_text('# our robots\n[old]\naddress = "10.0.0.1" # by the door\n')
    targets.add_target(SavedTarget("lab1", "172.31.1.147", tool="gripper", speed=0.3))
    assert file.read_text().startswith('# our robots\n[old]\naddress = "10.0.0.1" # by the door\n')
    assert targets.saved_targets() == {
        "old": SavedTarget("old", "10.0.0.1"),
        "lab1": SavedTarget("lab1", "172.31.1.147", "", "gripper", 0.3),
    }
    with pytest.raises(CommandRejected, match="there is a target lab1"):
        targets.add_target(SavedTarget("lab1", "172.31.1.148"))
    targets.add_target(SavedTarget("lab1", "172.31.1.148"), replace=True)
    assert targets.saved_targets()["lab1"] == SavedTarget("lab1", "172.31.1.148")
    targets.remove_target("old")
    assert list(targets.saved_targets()) == ["lab1"]
    with pytest.raises(CommandRejected, match="saved are lab1"):
        targets.remove_target("old")


def test_a_measured_tool_is_kept_with_its_target(config: Path) -> None:
    config.mkdir(parents=True)
    file = config / "targets.toml"
    others = '# ours\n[lab1]  # by the door\naddress = "10.0.0.1"\n\n[lab2]\naddress = "10.0.0.2"\n'
    file.write_text(others)
    first = ha.Tool("my gripper", mass=1.2, com=(0, 0, 0.06), tcp=ha.Pose.at(0, 0, 0.15))
    targets.save_tool("lab1", first)
    targets.save_tool("lab1", ha.Tool("pen", frames={"a tip": ha.Pose.xyz_abc(0, 0, 0.1, 0.2, 0.1, 3.0)}))
    assert file.read_text().startswith(others)
    better = ha.Tool("my gripper", mass=1.3, com=(0, 0, 0.061), inertia=(1e-3, 1e-3, 1e-3, 0, 0, 0))
    targets.save_tool("lab1", better)
    saved = targets.saved_targets()
    assert {one.name: one for one in saved["lab1"].tools}["my gripper"] == better
    assert len(saved["lab1"].tools) == 2 and saved["lab2"].tools == ()
    targets.add_target(SavedTarget("lab1", "10.0.0.3"), replace=True)  # measured tools stay
    assert set(targets.saved_targets()["lab1"].tools) == set(saved["lab1"].tools)
    targets.remove_target("lab1")
    assert targets.saved_targets() == {"lab2": SavedTarget("lab2", "10.0.0.2")}
    with pytest.raises(CommandRejected, match="there is no target lab1"):
        targets.save_tool("lab1", first)


def test_a_tool_that_cannot_be_replaced_stays(config: Path) -> None:
    config.mkdir(parents=True)
    file = config / "targets.toml"
    text = '[lab1]\naddress = "10.0.0.1"\ntools = { pen = { mass = 1.0 } }\n'
    file.write_text(text)
    with pytest.raises(CommandRejected, match="has no table of its own"):
        targets.save_tool("lab1", ha.Tool("pen", mass=2.0))
    assert file.read_text() == text and targets.saved_targets()["lab1"].tools == (ha.Tool("pen", mass=1.0),)


def test_a_measured_tool_is_attached_by_its_name(cabinet) -> None:  # type: ignore[no-untyped-def]
    targets.add_target(SavedTarget("bench", cabinet.target, tool="pen"))
    targets.save_tool("bench", ha.Tool("pen", mass=0.4, tcp=ha.Pose.at(0, 0, 0.2)))
    with ha.connect("bench") as arm:
        assert arm.state.tool == "pen" and arm.tools["pen"].mass == 0.4
        assert arm.load is not None and arm.load.mass == 0.4
        assert arm.pose("tool").distance_to(arm.pose("flange")) == pytest.approx(0.2, abs=1e-6)
        arm.detach_tool()
        arm.attach_tool("pen")
        assert arm.state.tool == "pen"
        arm.detach_tool()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("lab1 = 3", "must have an address"),
        ("[lab1]\naddress = 7", "must have an address"),
        ('[lab1]\naddress = "a"\nspeed = 0', "speed must be in (0, 1], got 0"),
        ('[lab1]\naddress = "a"\nspeeed = 1', "has speeed, which no such entry has"),
        ("[lab1", "cannot be read"),
        ('[lab1]\naddress = "a"\n[lab1.tools.pen]\nweight = 1', "has weight, which no such entry has"),
        ('[lab1]\naddress = "a"\n[lab1.tools.pen]\nmass = -1', "mass must be in"),
        ('[lab1]\naddress = "a"\n[lab1.tools.pen]\nframes.tip = [1, 2]', "a frame is x y z qx qy qz qw"),
        ('[lab1]\naddress = "a"\ntools = 3', "tools must be tables"),
        ('["lab 1"]\naddress = "a"', "must begin with a letter"),
    ],
)
def test_a_wrong_entry_is_named(config: Path, text: str, words: str) -> None:
    config.mkdir(parents=True)
    (config / "targets.toml").write_text(text)
    with pytest.raises(CommandRejected) as refused:
        parse_target("lab1")
    assert (words in str(refused.value) and str(config) in str(refused.value)) or "letter" in words


def test_addresses_need_no_file_of_targets(config: Path) -> None:
    config.mkdir(parents=True)
    (config / "targets.toml").write_text("broken [")
    assert parse_target("172.31.1.147").host == "172.31.1.147"
    assert parse_target("sim://iiwa14").is_private


def test_commands_add_list_and_remove(tmp_path: Path) -> None:
    file = tmp_path / "key"
    file.touch(mode=0o600)
    file.write_text(KEY)
    assert "no targets are saved" in run("targets").stdout
    done = run("targets", "add", "lab1", "172.31.1.147", "--key-file", str(file), "--speed", "0.3")
    assert done.returncode == 0, done.stderr
    assert run("targets", "add", "lab1", "172.31.1.147").returncode == 1
    (listed,) = objects("targets")
    assert listed == {
        "name": "lab1",
        "address": "172.31.1.147",
        "key": str(file),
        "tool": "",
        "speed": 0.3,
        "flange": "",
        "last_used": None,
    }
    assert "last used: never" in run("targets", "list").stdout
    refused = run("targets", "add", "lab 2", "172.31.1.147")
    assert refused.returncode == 1 and "must begin with a letter" in refused.stderr
    assert run("targets", "remove", "lab1").returncode == 0 and objects("targets") == []


def test_a_name_connects_with_its_speed_and_is_marked(cabinet) -> None:  # type: ignore[no-untyped-def]
    targets.add_target(SavedTarget("bench", cabinet.target, speed=0.4))
    with ha.connect("bench", control=False) as arm:
        assert arm.speed == 0.4
    (listed,) = objects("targets")
    assert listed["last_used"] is not None
    (state,) = objects("state", "--target", "bench")
    assert state["virtual"]
    (state,) = [one for one in objects("doctor", "--target", "bench") if one["what"] == "session"]
    assert state["how"] == "ok"
    assert run("stop", "--target", "bench").returncode == 0


def test_an_unknown_tool_of_a_target_is_refused_with_the_known_ones(cabinet) -> None:  # type: ignore[no-untyped-def]
    targets.add_target(SavedTarget("bench", cabinet.target, tool="no_such_tool"))
    with pytest.raises(CommandRejected, match="no_such_tool"):
        ha.connect("bench")


def test_the_key_of_a_name_is_used(tmp_path: Path) -> None:
    file = tmp_path / "key"
    file.touch(mode=0o600)
    file.write_text(KEY)
    targets.add_target(SavedTarget("private", "sim://iiwa14?speed=3", str(file)))
    assert os.environ.get("HEPTARM_KEY") is None
    with ha.connect("private") as arm:
        assert arm.is_virtual
