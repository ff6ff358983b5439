"""Figures: the verdict of a record, the comparison in blocks, the store, and the page generated from a stored run."""

from __future__ import annotations

import importlib
import importlib.util
import json
import os
import sys
import tempfile
from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path
from types import ModuleType

import pytest

from bench import __main__ as command
from bench.measure import blocks, store
from bench.measure.figure import BENCHMARKS, Benchmark, Figure
from bench.measure.noise import Noise

ROOT = Path(__file__).resolve().parents[2]
#: Without those that need ROS.
MODULES = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for path in (ROOT / "bench").glob("*/*.py")
    if path.stem not in ("__init__", "ros1_peer", "ros2_peer")
)


@pytest.fixture(scope="module")
def figures_page() -> ModuleType:
    spec = importlib.util.spec_from_file_location("figures_page", ROOT / "scripts" / "figures_page.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_page_agrees_with_the_newest_stored_runs(figures_page: ModuleType) -> None:
    assert figures_page.PAGE.read_text() == figures_page.page(figures_page.newest()), "run make figures"


def test_every_benchmark_is_on_the_page_in_its_group(figures_page: ModuleType) -> None:
    described = {group["name"]: sorted(group["benchmarks"]) for group in figures_page.groups()}
    registered: dict[str, list[str]] = {}
    for name, one in BENCHMARKS.items():
        registered.setdefault(one.group, []).append(name)
    assert described == {group: sorted(names) for group, names in registered.items()}


@pytest.mark.parametrize("module", MODULES)
def test_every_module_can_be_imported(module: str) -> None:
    importlib.import_module(module)


def test_every_pattern_of_the_texts_stands_for_figures_of_one_row(figures_page: ModuleType) -> None:
    patterns = [pattern for group in figures_page.groups() for pattern in group["figures"]]
    names = [one for one in patterns if "*" not in one]
    assert len(patterns) == len(set(patterns))
    for pattern in set(patterns) - set(names):
        assert not [name for name in names if fnmatchcase(name, pattern)]


@pytest.mark.parametrize(
    ("ratios", "noisy", "ok"),
    [
        ((1.0, 1.1, 1.2, 1.3, 9.0), (4,), True),
        ((2.5, 2.6, 2.7, 2.8, 0.1), (), False),
        ((1.0, 1.1, 1.9, 2.2, 2.4), (), None),
        ((1.0, 1.0, 1.0, 1.0, 1.0), (0, 1, 2), None),
    ],
)
def test_no_single_block_decides(ratios: tuple[float, ...], noisy: tuple[int, ...], ok: bool | None) -> None:
    assert Figure("one", 10.0, "us", limit=2.0, reference=8.0, ratios=ratios, noisy=noisy).ok is ok


def test_a_stalled_machine_excuses_a_missed_limit_and_nothing_else() -> None:
    assert Figure("lost", 47.0, "count", limit=0, disturbed=True).ok is None
    assert Figure("lost", 47.0, "count", limit=0).ok is False
    assert Figure("lost", 0.0, "count", limit=0, disturbed=True).ok is True


def test_a_machine_that_is_late_by_itself_decides_nothing_about_what_is_as_rare() -> None:
    found = blocks.Comparison(blocks.Placement("here", frozenset(), frozenset()))
    for stalled in (0.001, 0.02, 0.03, 0.04, 0.009):
        found.add([3.0, 4.0], [1.0, 1.0], Noise(stalled=stalled))
    p99 = found.figure("age_p99", 99, "us", limit=1.6)
    assert p99.noisy == (1, 2, 3) and p99.ok is None
    assert found.figure("age", 50, "us", limit=1.6).ok is False


@pytest.mark.parametrize(
    ("noisy", "error", "ok"),
    [
        (False, TimeoutError("no answer"), False),
        (True, TimeoutError("no answer"), None),
        (True, KeyError("no answer"), False),
    ],
)
def test_a_benchmark_that_fails_keeps_what_it_measured(
    noisy: bool, error: Exception, ok: bool | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Noise, "is_noisy", noisy)

    def run():  # type: ignore[no-untyped-def]
        yield Figure("first", 1.0, "s")
        raise error

    first, failed = Benchmark("long", "fri", "", run).figures()
    assert (first.name, first.group, first.ok) == ("first", "fri", True)
    record = failed.as_dict()
    assert (record["name"], record["value"], record["ok"]) == ("long_failed", None, ok)
    assert record["detail"]["error"] == f"{type(error).__name__}: {error}"


def test_value_and_floor_take_turns_in_blocks_and_processors_come_back() -> None:
    before, order = os.sched_getaffinity(0), []
    places: list[str] = []
    found = blocks.by_turns(
        lambda: order.append("value") or [2.0, 4.0, 6.0],
        lambda: order.append("floor") or [1.0, 2.0, 3.0],
        lambda placement: places.append(placement.name),
    )
    assert os.sched_getaffinity(0) == before
    assert places[: len(found)] == [one.placement.name for one in found]
    assert order[: 2 * len(found)] == ["value", "floor"] * len(found)
    assert order[2 * len(found) : 4 * len(found)] == ["floor", "value"] * len(found)
    figure = found[0].figure("age", 50, "us", limit=3.0, scale=1e6)
    assert figure.name == "age_one_core" and figure.value == pytest.approx(4e6)
    assert figure.ratio == pytest.approx(2.0) and len(figure.ratios) >= 5


def test_a_stored_benchmark_replaces_its_figures_and_leaves_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store, "RESULTS", tmp_path)
    monkeypatch.setattr(store, "commit", lambda: "abc")
    kept = store.Store()
    kept.put("round_trip", [{"name": "a", "value": 1.0}], 0.0)
    kept.put("blending", [{"name": "b", "value": 2.0}], 0.5)
    kept.put("round_trip", [{"name": "a", "value": 3.0}], 1.0)
    head, *records = map(json.loads, kept.path.read_text().splitlines())
    assert set(head["machine"]) == {"cpu", "cores", "kernel", "real_time", "python"}
    assert {one["name"]: one["value"] for one in records} == {"a": 3.0, "b": 2.0}
    assert {one["name"]: one["run"]["load"] for one in records} == {"a": 1.0, "b": 0.5}


def test_unknown_names_are_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["bench", "--group", "frei"])
    assert command.main() == 2
    assert "no group 'frei'; there are calibration, contact, fri, lab, motion" in capsys.readouterr().err


def test_what_failed_names_no_path_of_the_machine() -> None:
    def fails() -> Iterator[Figure]:
        raise RuntimeError(f"{ROOT}/.venv/bin/python {tempfile.gettempdir()}/x")
        yield  # a generator

    (found,) = Benchmark("broken", "house", "", fails).figures()
    assert found.detail["error"] == "RuntimeError: ./.venv/bin/python TMP/x"
