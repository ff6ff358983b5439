"""Figures of recordings: what is drawn, where limits, motions and events are, two recordings on each other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from heptarm import Recording
from heptarm.errors import CommandRejected, MissingExtra
from heptarm.record import plot
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
    figure = plot.compare(recording("a.mcap"), recording("b.mcap", zero=0.5), ("q", "path"))
    axes, path = figure.axes
    first, second = axes.lines[0], axes.lines[7]
    assert (first.get_linestyle(), second.get_linestyle()) == ("-", "--")
    assert np.asarray(first.get_xdata())[0] == pytest.approx(-0.2)
    assert np.asarray(second.get_xdata())[0] == pytest.approx(-0.7)
    assert len(path.lines) == 2


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf", ".html"])
def test_a_figure_is_saved(tmp_path: Path, suffix: str) -> None:
    out = plot.save(recording().plot("q"), tmp_path / f"out{suffix}")
    head = out.read_bytes()[:400]
    assert out.stat().st_size > 5000
    assert {".png": b"PNG", ".svg": b"<?xml", ".pdf": b"%PDF", ".html": b"data:image/svg+xml"}[suffix] in head


def test_what_cannot_be_drawn_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = recording()
    with pytest.raises(CommandRejected, match="no numbers"):
        run.plot("text")
    with pytest.raises(CommandRejected, match="must be one of t, q"):
        run.plot("velocity")
    with pytest.raises(CommandRejected, match=r"\.png, \.svg, \.pdf, \.html, got '\.gif'"):
        plot.save(run.plot("q"), tmp_path / "out.gif")
    with pytest.raises(CommandRejected, match="nothing to draw"):
        plot.figure_of(Recording(Path("x"), {"robot": "?"}, {"t": np.zeros(0)}, (), (), True))
    monkeypatch.setitem(__import__("sys").modules, "matplotlib.figure", None)
    with pytest.raises(MissingExtra, match="matplotlib"):
        run.plot("q")
