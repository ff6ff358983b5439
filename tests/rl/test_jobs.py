"""Jobs of `heptarm rl`: what a sweep makes of settings, scripts, and what is refused before anything runs."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import get_type_hints

import numpy as np
import pytest

pytest.importorskip("torch", reason="torch is not installed")

import heptarm as ha
from heptarm.cli.rl import policies
from heptarm.cli.rl.jobs import JobOptions, cases_of
from heptarm.cli.rl.record import _keep
from heptarm.errors import CommandRejected, LimitError
from heptarm.rl.contact.peg_in_hole import PegInHole
from heptarm.rl.jobs import RecordedEpisode, RecordJob, Script
from heptarm.rl.sim.randomisation import STRONG
from heptarm.rl.sweep import sweep, with_setting, with_settings
from heptarm.rl.task import ReachTask
from heptarm.rl.train.recipe import Recipe
from heptarm.values.files import writable_file
from tests.cli.running import objects, refused
from tests.rl.test_pool import Square

PICK_PLACE = Path(__file__).parents[2] / "examples/learning/pick_place.py"


def test_a_sweep_has_all_combinations_of_seeds_and_values() -> None:
    assert list(sweep([])) == [{}]
    assert cases_of("0..1", 0, ["gamma=0.9,0.95", "steps=10"]) == [
        (0, {"gamma": "0.9", "steps": "10"}),
        (1, {"gamma": "0.9", "steps": "10"}),
        (0, {"gamma": "0.95", "steps": "10"}),
        (1, {"gamma": "0.95", "steps": "10"}),
    ]
    assert cases_of("", 7, []) == [(7, {})] and [seed for seed, _ in cases_of("4,2", 0, [])] == [4, 2]
    for text in ("gamma", "gamma=", "=1", "gamma=1,", "gamma=0.9,0.9"):
        with pytest.raises(CommandRejected, match="NAME=VALUE"):
            list(sweep([text]))
    for text in ("4..1", "0..x", "1,1", "-1", "a"):
        with pytest.raises(CommandRejected, match="seeds must be"):
            cases_of(text, 0, [])
    with pytest.raises(CommandRejected, match="cannot be combined"):
        cases_of("0..4", 3, [])


def test_settings_are_those_of_recipe_algorithm_and_task() -> None:
    recipe = Recipe(PegInHole())
    changed = with_settings(
        recipe, {"gamma": "0.9", "clearance": "1e-3", "steps": "5000", "randomisation": "strong", "envs": "8"}
    )
    assert (changed.settings.gamma, changed.settings.envs, changed.steps) == (0.9, 8, 5000)
    assert (changed.task.clearance, changed.randomisation) == (1e-3, STRONG)
    assert with_settings(changed, {}) == changed
    reach = Recipe(ReachTask())
    assert with_settings(reach, {"task.spread": "0.2"}).task.spread == 0.2
    assert with_settings(reach, {"settings.spread": "-1"}).settings.spread == -1.0
    assert with_setting(ReachTask(), "robot", "iiwa7").robot == "iiwa7"
    with pytest.raises(CommandRejected, match=r"settings\.spread or task\.spread"):
        with_settings(reach, {"spread": "0.2"})
    with pytest.raises(CommandRejected, match="one of .*clearance.*gamma.*got 'no'"):
        with_settings(recipe, {"no": "1"})
    with pytest.raises(CommandRejected, match="envs must be an integer, got '1e2'"):
        with_settings(recipe, {"envs": "1e2"})
    with pytest.raises(CommandRejected, match="gamma must be a number, got 'much'"):
        with_settings(recipe, {"gamma": "much"})
    with pytest.raises(LimitError, match="gamma must be 0 to 1"):
        with_settings(recipe, {"gamma": "2"})


def test_the_help_has_the_numbers_of_steps_of_the_recipes() -> None:
    shown = get_type_hints(policies.train, include_extras=True)["steps"].__metadata__[0].help
    known = [
        Recipe(ReachTask()).steps,
        Recipe(ReachTask(feature="kinematic")).steps,
        Recipe(PegInHole()).steps,
    ]
    assert [float(one) for one in re.findall(r"\d\.\d", shown)] == [steps / 1e6 for steps in known]


def test_a_job_whose_result_cannot_be_kept_leaves_the_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cases = [({"number": n}, Square(f"square {n}", n, tmp_path)) for n in (4, 5)]

    def figures(_: object, value: int) -> dict[str, object]:
        if value == 16:
            raise OSError(28, "No space left on device")
        return {"square": value}

    table = writable_file(tmp_path / "new" / "squares.csv", overwrite=False)
    assert JobOptions(workers=1).run(cases, figures, table=table) == 1
    with table.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["square"] for row in rows] == ["", "25"] and "No space left" in rows[0]["error"]
    table.unlink()
    table.mkdir()  # in the way
    with pytest.raises(CommandRejected, match="cannot be written: is a directory"):
        JobOptions(workers=1).run(cases, figures, table=table)
    assert "25" in capsys.readouterr().out, "the table is printed all the same"


def test_a_recording_keeps_what_is_finished_and_replaces_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = RecordedEpisode(0, "success", b"first")
    (tmp_path / "episode-00000.mcap").write_bytes(b"of another program")
    _keep(tmp_path, done)
    _keep(tmp_path, RecordedEpisode(1, "success", b"second"))
    assert [file.read_bytes() for file in sorted(tmp_path.glob("*.mcap"))] == [
        b"of another program",
        b"first",
        b"second",
    ]

    def fails(_: RecordJob, recorded: list[RecordedEpisode]) -> None:
        recorded.append(done)
        raise ZeroDivisionError("of the script")

    monkeypatch.setattr(RecordJob, "_record", fails)
    made = RecordJob("episodes", Script.load(PICK_PLACE), "sim://iiwa14", (0, 1)).run()
    assert made.episodes == (done,) and made.error == "ZeroDivisionError: of the script"


def test_a_script_is_a_file_with_a_function(tmp_path: Path) -> None:
    file = tmp_path / "script.py"
    with pytest.raises(CommandRejected, match="is not a script"):
        Script.load(file)
    file.write_text("1 / 0")
    with pytest.raises(CommandRejected, match="ZeroDivisionError"):
        Script.load(file)
    file.write_text("def reset(arm, random): pass")
    with pytest.raises(CommandRejected, match="no function `demonstrate`"):
        Script.load(file)
    script = Script.load(PICK_PLACE)
    assert script.reset is not None
    for target in ("172.31.1.147", "sim://localhost:30001"):
        with pytest.raises(CommandRejected, match="target must be a private simulator"):
            RecordJob("episodes", script, target, (0,))


def test_the_command_refuses_what_contradicts_itself(tmp_path: Path) -> None:
    out = tmp_path / "reach.npz"
    for words, why in (
        (["--seeds", "0..1", "--resume"], "--resume is of one training"),
        (["--seeds", "0..1", "--sweep", "no=1"], "sweep must name one of"),
        (["--seeds", "0..1", "--workers", "0"], "workers must be"),
    ):
        done = refused("rl", "train", "--out", str(out), *words)
        assert done.returncode == 1 and why in done.stderr
    for words, why in (
        (["--episodes", "0"], "--episodes must be in [1, "),
        (["--seed", "-1"], "--seed must be in [0, "),
        (
            ["peginhole"],
            "policy must be a file, or a task whose policy is part of heptarm, reach, peg-in-hole",
        ),
        (["polish"], "heptarm rl train polish"),
    ):
        done = refused("rl", "eval", *words)
        assert done.returncode == 1 and why in done.stderr and "Traceback" not in done.stderr
    out.with_name("reach-seed1.npz").touch()
    done = refused("rl", "train", "--out", str(out), "--seeds", "0..1")
    assert done.returncode == 1 and "reach-seed1.npz" in done.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["reach-seed1.npz"]


@pytest.mark.long
def test_evaluations_of_policies_and_settings_make_one_table(tmp_path: Path) -> None:
    words = ["reach", "peg-in-hole", "--seeds", "0..1", "--episodes", "20", "--workers", "2"]
    rows = objects("rl", "eval", *words, "--out", str(tmp_path / "table"))
    assert sorted((row["policy"], row["seed"]) for row in rows) == [
        (policy, seed) for policy in ("peg-in-hole", "reach") for seed in (0, 1)
    ]
    assert all(row["success_rate"] > 0.9 and not row["error"] for row in rows)
    with (tmp_path / "table.csv").open(encoding="utf-8") as file:
        assert [row["policy"] for row in csv.DictReader(file)] == [
            "reach",
            "reach",
            "peg-in-hole",
            "peg-in-hole",
        ]
    (one, other) = objects("rl", "eval", "reach", "--sweep", "robot=iiwa14,iiwa7", "--episodes", "20")
    assert {one["robot"], other["robot"]} == {"iiwa14", "iiwa7"}


@pytest.mark.long
def test_episodes_of_a_script_do_not_depend_on_who_records_them(tmp_path: Path) -> None:
    """Seven episodes in jobs of five and two, more of the same set afterwards; all the same as alone."""
    target = ["--target", "sim://iiwa14?scene=bins&speed=2", "--rate", "10", "--task", "Move the cube"]
    rows = objects(
        "rl", "record", str(PICK_PLACE), str(tmp_path / "set"), "--episodes", "7", "--workers", "2", *target
    )
    assert sum(row["success"] for row in rows) == 7 and not any(row["error"] for row in rows)
    assert {row["episodes"] for row in rows} == {"0..4", "5..6"}
    objects("rl", "record", str(PICK_PLACE), str(tmp_path / "set"), "--episodes", "1", *target)
    found = ha.load_episodes(tmp_path / "set")
    assert [episode.number for episode in found] == list(range(8)) and found[0].task == "Move the cube"
    (alone,) = RecordJob("one", Script.load(PICK_PLACE), target[1], (6,), rate=10.0).run().episodes
    (tmp_path / "alone").mkdir()
    (tmp_path / "alone/episode-00006.mcap").write_bytes(alone.content)
    (again,) = ha.load_episodes(tmp_path / "alone")
    grasps = [episode["q"][len(episode) // 2] for episode in (found[6], again, found[5])]
    assert np.abs(grasps[0] - grasps[1]).max() < 0.05, "the same place of the cube"
