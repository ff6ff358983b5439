"""`heptarm record`, `plot` and `convert`: beside a program that moves the arm, and on what is no recording."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from tests.cli.running import HEPTARM, objects, refused, run
from tests.conftest import RunningCabinet
from tests.drawing import cannot_draw
from tests.interrupts import ctrl_c_interrupts

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory, cabinet: RunningCabinet) -> Path:
    """Recorded by a process that observes, until Ctrl-C, while this one moves the arm."""
    path = tmp_path_factory.mktemp("record") / "run.mcap"
    command = [
        *HEPTARM,
        "record",
        str(path),
        "--rate",
        "200",
        "--note",
        "third try",
        "--target",
        cabinet.target,
    ]
    with ctrl_c_interrupts():
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env={**os.environ})
    with process, ha.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:
        assert process.stdout is not None and "Ctrl-C ends it" in process.stdout.readline()
        arm.move([ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), ha.lin_rel(z=-0.05, frame="base")])
        process.send_signal(signal.SIGINT)
        assert " lost, " in process.stdout.read() and process.wait(60) == 0
    return path


def test_an_observer_records_the_motions_of_another_client(recorded: Path) -> None:
    run = ha.load(recorded)
    assert run.complete and len(run) > 50 and [note.text for note in run.notes] == ["third try"]
    assert run.motions and run.motions[0].id in set(run["motion"].tolist())
    assert any(
        event.kind == "signals" and "control mode" in event.text for event in run.events
    )  # all groups are recorded


def test_plotted_and_converted(recorded: Path, tmp_path: Path) -> None:
    (found,) = objects("plot", str(recorded), "--signals", "q,path", "-o", str(tmp_path / "a.html"))
    assert found["states"] == len(ha.load(recorded)) and "svg" in (tmp_path / "a.html").read_text()
    done = run("plot", str(recorded), "--compare", str(recorded), "--signals", "q")
    assert done.returncode == 0 and recorded.with_suffix(".png").exists(), done.stderr
    objects("convert", str(recorded), str(tmp_path / "a.npz"))
    with np.load(tmp_path / "a.npz") as arrays:
        assert arrays["q"].shape == (found["states"], 7)


def test_for_some_seconds_with_pictures(cabinet: RunningCabinet, tmp_path: Path) -> None:
    if why := cannot_draw():
        pytest.skip(why)
    path = tmp_path / "a.mcap"
    (done,) = objects(
        "record", str(path), "--for", "3", "--camera-size", "160x120", "--target", cabinet.target
    )
    assert done["states"] > 10 and done["bytes"] > 1000
    pictures = ha.load(path).pictures
    assert len(pictures) == done["pictures"] and done["pictures"] + done["pictures_dropped"] > 0
    out = run("convert", str(path), str(tmp_path / "a.npz"))
    assert f"{len(pictures)} pictures were left out" in out.stdout or not len(pictures)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("plot", "nothing.mcap"), "nothing.mcap cannot be read"),
        (("convert", __file__, "a.npz"), "must be a recording of heptarm"),
        (("plot", "{recorded}", "--signals", "speed", "-o", "{folder}/a.png"), "name must be one of t, "),
        (("convert", "{recorded}", "a.xls"), "suffix must be one of .parquet, .csv, .npz"),
        (("record", "a.mcap", "--camera-size", "640", "--target", "sim://127.0.0.1:1"), "such as 640x480"),
        (("record", "a.mcap", "--listen", "--camera"), "--listen records FRI messages alone"),
        (("record", "a.mcap", "--for", "-1", "--target", "sim://127.0.0.1:1"), "for must be in (0, 1e+07] s"),
    ],
)
def test_a_mistake_is_one_sentence(
    recorded: Path, tmp_path: Path, arguments: tuple[str, ...], words: str
) -> None:
    done = refused(*(argument.format(recorded=recorded, folder=tmp_path) for argument in arguments))
    assert done.returncode == 1 and words in done.stderr and "Traceback" not in done.stderr
