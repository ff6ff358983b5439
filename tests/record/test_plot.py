"""Figures of recordings: what is drawn, where limits, motions and events are, two recordings on each other."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from heptarm import Recording
from heptarm.errors import CommandRejected, MissingExtra
from heptarm.record import plot
from heptarm.record.plot.page import page
from heptarm.record.recorded import RecordedEvent, RecordedMotion
from heptarm.values.robot import ROBOTS

ROBOT = ROBOTS["iiwa14"]
T = np.linspace(0.0, 2.0, 9001)


def recording(name: str = "run.mcap", *, zero: float = 0.0) -> Recording:
    q = np.sin(T)[:, None] * np.ones(7)
    xyz = np.stack([np.cos(T), np.sin(T), 0.1 * T], axis=1)
    signals = {
        "t": T,
        "q": q,
        "dq": np.cos(T)[:, None] * ROBOT.dq_max,
        "tau": 0.5 * np.ones((len(T), 7)) * ROBOT.tau_max,
        "wrench": np.zeros((len(T), 6)),
        "xyz": xyz,
        "text": np.array(["x"] * len(T)),
    }
    signals["wrench"][4321, 2] = 77.0
    motions = (
        RecordedMotion(3, "Ptp", zero + 0.2, zero + 1.2, "finished"),
        RecordedMotion(4, "Lin", 1.4, float("nan")),
    )
    events = (
        RecordedEvent(0.5, "note", "note", "third try"),
        RecordedEvent(1.0, "event", "SafetyChanged", "stop"),
    )
    return Recording(
        Path(name), {"robot": "iiwa14", "title": "LBR iiwa 14 R820"}, signals, motions, events, True
    )


def test_the_usual_figure_shows_all_that_was_recorded() -> None:
    figure = recording().plot()
    assert [axes.name for axes in figure.axes] == ["rectilinear"] * 4 + ["3d"]
    labels = [axes.get_ylabel() for axes in figure.axes[:4]]
    assert "joint position\n[deg]" in labels and "joint speed\n[fraction of limit]" in labels
    speed = figure.axes[1].lines[0].get_ydata()
    assert np.max(speed) == pytest.approx(1.0) and any(
        np.asarray(line.get_ydata()).tolist() == [1.0, 1.0] for line in figure.axes[1].lines
    )
    texts = [text.get_text().strip() for text in figure.axes[0].texts]
    assert {"Ptp", "Lin", "third try", "SafetyChanged"} <= set(texts)
    assert len(figure.axes[0].patches) == 2  # the bands of the motions


def test_a_part_is_drawn_from_its_beginning_to_its_end() -> None:
    part = recording().between("third try", 1.6)
    assert [one.text for one in part.motions] == ["Ptp", "Lin"]  # one began before, one ends behind
    axes, *_ = part.plot("q").axes
    begin, end = axes.get_xlim()
    assert 0.3 < begin <= 0.5 and 1.6 <= end < 1.8
    assert all(begin < text.get_position()[0] < end for text in axes.texts)


def test_a_part_whose_end_is_before_its_beginning_is_refused() -> None:
    run = recording()
    with pytest.raises(
        CommandRejected, match=r"end must not be before begin at 0\.500 s, got 0\.200 s"
    ) as caught:
        run.between("third try", 0.2)
    assert caught.value.parameter == "end" and "exchange" in caught.value.hint
    assert len(run.between(0.5, 0.5)) <= 1


def test_no_peak_is_lost_by_drawing_fewer_points() -> None:
    figure = recording().plot("wrench")
    (axes,) = figure.axes
    every = [np.asarray(line.get_ydata()) for line in axes.lines]
    drawn = [line for line in every if len(line) > 2]
    assert len(drawn) == 6 and len(drawn[0]) < len(T)
    assert max(float(np.max(line)) for line in drawn) == 77.0


def test_a_comparison_begins_with_the_first_motions() -> None:
    chart = plot.compare([recording("a.mcap"), recording("b.mcap", zero=0.5)], signals=("q", "path"))
    axes, path = chart.figure().axes
    first, second = axes.lines[1], axes.lines[8]  # behind the line of the event
    assert (first.get_linestyle(), second.get_linestyle()) == ("-", "--")
    assert np.asarray(first.get_xdata())[0] == pytest.approx(-0.2)
    assert np.asarray(second.get_xdata())[0] == pytest.approx(-0.7)
    assert len(path.lines) == 2


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf", ".html"])
def test_a_figure_is_saved(tmp_path: Path, suffix: str) -> None:
    out = recording().chart("q").save(tmp_path / f"out{suffix}")
    head = out.read_bytes()[:400]
    assert out.stat().st_size > 5000
    assert {".png": b"PNG", ".svg": b"<?xml", ".pdf": b"%PDF", ".html": b"<!doctype html>"}[suffix] in head


def test_what_cannot_be_drawn_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = recording()
    with pytest.raises(CommandRejected, match="no numbers"):
        run.plot("text")
    with pytest.raises(CommandRejected, match="must be one of t, q"):
        run.plot("velocity")
    with pytest.raises(CommandRejected, match=r"\.png, \.svg, \.pdf, \.html, got '\.gif'"):
        run.chart("q").save(tmp_path / "out.gif")
    with pytest.raises(CommandRejected, match="nothing to draw"):
        plot.chart_of(Recording(Path("x"), {"robot": "?"}, {"t": np.zeros(0)}, (), (), True))
    monkeypatch.setitem(__import__("sys").modules, "matplotlib.figure", None)
    with pytest.raises(MissingExtra, match="matplotlib"):
        run.plot("q")


def test_names_of_sixty_notes_do_not_overlap() -> None:
    notes = tuple(RecordedEvent(0.03 * i, "note", "note", f"sample {i}") for i in range(60))
    stop = RecordedEvent(1.0, "event", "SafetyChanged", "stop")
    axes = replace(recording(), events=(*notes, stop), motions=()).plot("q").axes[0]
    names = [text for text in axes.texts if text.get_rotation() == 90]
    places = sorted(text.get_position()[0] for text in names)
    assert 10 < len(names) < 60 and "SafetyChanged" in [text.get_text() for text in names]
    low, high = axes.get_xlim()
    inches = np.diff(places) * axes.figure.get_size_inches()[0] * 0.85 / (high - low)
    assert inches.min() > float(names[0].get_fontsize()) / 72  # wider apart than the type is high
    assert len(axes.lines) == 7 + 61  # each event keeps its line


def test_names_of_many_motions_do_not_overlap() -> None:
    motions = tuple(RecordedMotion(i, f"Spline number {i}", 0.05 * i, 0.05 * i + 0.04) for i in range(40))
    figure = replace(recording(), events=(), motions=motions).plot("q")
    figure.draw_without_rendering()
    boxes = [text.get_window_extent() for text in figure.axes[0].texts]
    assert 2 < len(boxes) < 40
    assert all(left.x1 <= right.x0 for left, right in pairwise(boxes))


@pytest.mark.parametrize(("name", "least"), [("xyz", 2.0), ("q", 1.0), ("wrench", 5.0)])
def test_noise_does_not_fill_an_axis(name: str, least: float) -> None:
    run = recording()
    still = 1e-7 * np.sin(40 * T)[:, None] + np.full_like(run[name], 0.4)
    low, high = replace(run, signals={**run.signals, name: still}, events=()).plot(name).axes[0].get_ylim()
    assert high - low >= least


def test_a_path_has_equal_scales() -> None:
    axes = recording().plot("path").axes[0]
    box = np.array([np.ptp(getattr(axes, f"get_{name}lim")()) for name in "xyz"])
    shape = np.asarray(getattr(axes, "_box_aspect"))  # noqa: B009
    np.testing.assert_allclose(shape / shape.max(), box / box.max())
    assert box.min() > 0.15 * box.max()


def test_a_spectrum_has_its_peak_where_the_signal_swings() -> None:
    run = recording()
    tau = run["tau"] + 3.0 * np.sin(2 * np.pi * 40.0 * T)[:, None]
    (row,) = replace(run, signals={**run.signals, "tau": tau}).chart("tau", kind="spectrum").rows
    assert row.is_log and row.unit == "Nm/√Hz" and len(row.lines) == 7
    line = row.lines[0]
    step = line.x[1] - line.x[0]
    assert line.x[np.nanargmax(line.y)] == pytest.approx(40.0, abs=step)
    # Parseval: the density integrates to the mean square of the swing
    assert np.nansum(line.y**2) * step == pytest.approx(3.0**2 / 2, rel=0.02)


def test_a_histogram_counts_all_samples() -> None:
    (row,) = recording().chart("wrench", kind="histogram").rows
    steps = row.lines[2]
    assert steps.y[1:-1:2].sum() == pytest.approx(100.0)
    assert steps.x[-1] == 77.0 and steps.y[-2] == pytest.approx(100.0 / len(T))


def test_a_comparison_begins_with_an_event() -> None:
    first, second = recording("a.mcap"), recording("b.mcap")
    late = tuple(replace(event, t=event.t + 0.3) for event in second.events)
    pair = [first, replace(second, events=late)]
    for at, zeros in (("third try", (0.5, 0.8)), ("SafetyChanged", (1.0, 1.3))):
        (row,) = plot.compare(pair, signals=("q",), at=at).rows
        assert [row.lines[0].x[0], row.lines[7].x[0]] == pytest.approx([-zero for zero in zeros])
    with pytest.raises(
        CommandRejected, match=r"a\.mcap has no event 'Stop'; it has 'third try', 'SafetyChanged'"
    ):
        plot.compare(pair, at="Stop")
    with pytest.raises(CommandRejected, match="recordings must be 2 to 4, got 1"):
        plot.compare([first])


def test_a_page_is_interactive_and_needs_no_network() -> None:
    text = page(recording().chart())
    # plotly.js is in it, and nothing is loaded
    assert "Plotly.newPlot" in text and len(text) > 3_000_000
    assert "<script src" not in text and "<link" not in text and 'src="http' not in text
    settings = text[text.rindex("Plotly.newPlot") :]
    assert '"hoversubplots":"axis"' in settings and '"spikemode":"across"' in settings
    assert settings.count('"showlegend":true') == 7 + 6 + 1  # joints once, wrench, events
    assert '"third try"' in settings and '"SafetyChanged"' in settings and '"scatter3d"' in settings


def test_a_figure_for_paper_fits_a_column(tmp_path: Path) -> None:
    run = recording()
    figure = run.plot("q", "tau", style="paper")
    assert figure.get_size_inches()[0] == 3.5 and figure.get_suptitle() == ""
    assert [axes.get_legend() is not None for axes in figure.axes] == [True, False]  # A1 to A7 once
    out = run.chart("q").save(tmp_path / "column.pdf", style="paper")
    assert b"/Type3" not in out.read_bytes()  # journals refuse fonts of that type
    with pytest.raises(CommandRejected, match=r"\.png, \.svg, \.pdf, got '\.html'"):
        run.chart("q").save(tmp_path / "page.html", style="paper")
    with pytest.raises(CommandRejected, match="spectrum must be of signals, got 'path'"):
        run.plot("path", kind="spectrum")
