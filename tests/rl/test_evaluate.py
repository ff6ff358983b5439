"""Reports: figures checked by hand."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.rl.contact.peg_in_hole import PegInHole
from heptarm.rl.contact.pick_place import PickPlace
from heptarm.rl.contact.polish import Polish
from heptarm.rl.contact.push import Push
from heptarm.rl.contact.task import ContactTask
from heptarm.rl.evaluate import evaluate, held_back
from heptarm.rl.report import EpisodeReport
from heptarm.rl.task import ReachTask


def still(observation: np.ndarray) -> np.ndarray:
    return np.zeros((len(observation), 7))


def test_an_arm_that_stands_still_ends_as_far_as_it_began() -> None:
    task = ReachTask(steps=10)
    goals = held_back(task, 5)
    report = evaluate(still, goals, task=task)
    assert (report.targets == goals).all()
    begun = np.linalg.norm(report.paths[:, 0] - goals, axis=1)
    assert report.final == pytest.approx(begun, abs=1e-9)
    assert report.success_rate == 0.0
    assert "never" in report.summary()


def test_a_target_where_the_arm_stands_is_reached_at_once() -> None:
    task = ReachTask(steps=5, spread=0.0)
    report = evaluate(still, task.tip(np.asarray(task.home))[None], task=task)
    assert report.success_rate == 1.0
    assert report.time_to_reach == pytest.approx([1 / 30])


def test_held_back_targets_are_the_same_every_time_and_not_those_of_training() -> None:
    task = ReachTask()
    assert (held_back(task, 10) == held_back(task, 10)).all()
    assert not (held_back(task, 10) == held_back(task, 10, seed=1)).any()
    for seed in range(5):
        drawn = task.targets(np.random.default_rng(np.random.SeedSequence([seed, 0])), 1000)
        assert not np.isin(held_back(task, 100), drawn).any()


def test_a_function_needs_its_task() -> None:
    with pytest.raises(CommandRejected, match="task"):
        evaluate(still, 3)
    with pytest.raises(LimitError, match="targets"):
        evaluate(still, 0, task=ReachTask())
    with pytest.raises(ShapeError, match="targets"):
        evaluate(still, np.zeros((2, 4)), task=ReachTask())


def by_hand() -> EpisodeReport:
    """Three episodes of four decisions: reached at once, late, never."""
    distances = np.array([[0.03, 0.02, 0.01, 0.004], [0.3, 0.2, 0.035, 0.008], [0.5, 0.4, 0.3, 0.2]])
    return EpisodeReport(
        ReachTask(),
        np.zeros((3, 3)),
        distances,
        np.zeros((3, 5, 3)),
        joints=np.zeros((3, 5, 7)),
        facts={"robot": "none"},
    )


def test_figures_by_hand() -> None:
    report = by_hand()
    assert report.time_to_reach.tolist() == [1 / 30, 3 / 30, np.inf]
    assert report.success.tolist() == [True, True, False]
    assert report.success_rate == pytest.approx(2 / 3)
    assert report.mean == pytest.approx(0.212 / 3)
    assert report.median == pytest.approx(0.008)
    assert report.reached_within(1 / 30) == pytest.approx(1 / 3)
    assert report.reached_within(0.1) == pytest.approx(2 / 3)
    assert "66.7 % within 35 mm" in report.summary()


def test_a_report_in_files(tmp_path: Path) -> None:
    report = by_hand()
    entries = json.loads(report.save(tmp_path / "reach.json").read_text())
    assert entries["success_rate"] == pytest.approx(2 / 3)
    assert entries["per_target"]["time_to_reach"][2] is None
    again = EpisodeReport.load(report.save(tmp_path / "reach.npz"))
    assert (again.distances == report.distances).all()
    assert again.facts == report.facts
    picture = report.plot(tmp_path / "reach.png")
    assert picture.read_bytes()[:4] == b"\x89PNG"
    picture.write_text("mine")
    with pytest.raises(CommandRejected, match=r"reach\.png exists .*overwrite=True"):
        report.plot(picture)
    assert picture.read_text() == "mine"
    assert report.plot(picture, overwrite=True).read_bytes()[:4] == b"\x89PNG"
    with pytest.raises(CommandRejected, match=r"\.json"):
        report.save(tmp_path / "reach.txt")


def test_arrays_that_do_not_belong_together_make_no_report() -> None:
    with pytest.raises(ShapeError, match="belong"):
        EpisodeReport(
            ReachTask(), np.zeros((2, 3)), np.zeros((3, 4)), np.zeros((3, 5, 3)), joints=np.zeros((3, 5, 7))
        )


@pytest.mark.parametrize("kind", [PegInHole, Push, PickPlace, Polish])
def test_a_picture_marks_places_only(kind: type[ContactTask], tmp_path: Path) -> None:
    task = kind()
    targets = task.targets(np.random.default_rng(3), 4)
    goals = task.goals(targets)
    paths, joints = np.zeros((4, 10, 3)), np.zeros((4, 10, 7))
    report = EpisodeReport(task, targets, np.ones((4, 9)), paths, joints=joints)
    assert report.plot(tmp_path / "paths.png").is_file()
    if kind is Polish:
        assert goals is None
    else:
        assert goals is not None and goals.shape == (4, 3)
    if kind in (Push, PickPlace):
        assert goals is not None
        np.testing.assert_array_equal(goals[:, :2], targets[:, 2:])
    narrow = EpisodeReport(Polish(), targets[:, :1], np.ones((4, 9)), paths, joints=joints)
    assert narrow.plot(tmp_path / "narrow.png").is_file()
