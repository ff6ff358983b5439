"""The live view in a real browser: the arm is there, and it moves."""

from __future__ import annotations

import io
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from tests.cli.running import refused, sim

pytest.importorskip("viser")


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--meshes", "."), "--meshes needs --view or --panel"),
        (("--view", "--meshes", "/nowhere"), "meshes must be a folder with link_0.stl to link_7.stl"),
        (("--fri", "2.5", "--meshes", "."), "--meshes cannot be used with heptarm sim fri"),
        (("--app", ".", "--meshes", "."), "--meshes needs --view"),
    ],
)
def test_meshes_that_nobody_could_see_are_refused(words: tuple[str, ...], text: str) -> None:
    done = refused("sim", *words)
    assert done.returncode != 0 and text in done.stderr


def _picture(browser: Any) -> np.ndarray:
    """The middle of the page, where the arm is: without the readouts and the browser's notes."""
    from matplotlib.image import imread

    picture = imread(io.BytesIO(browser.get_screenshot_as_png()), format="png")[..., :3]
    return picture[160:, 370:-350]


def _fraction(picture: np.ndarray, low: tuple[float, ...], high: tuple[float, ...]) -> float:
    return float(((picture >= low) & (picture <= high)).all(axis=-1).mean())


def _silver(picture: np.ndarray) -> float:
    return _fraction(picture, (0.55, 0.55, 0.55), (0.9, 0.9, 0.9))


def _settled(browser: object, patience: float = 60.0) -> np.ndarray:
    """The picture, once the arm is drawn and no longer changes."""
    deadline = time.monotonic() + patience
    before = _picture(browser)
    while time.monotonic() < deadline:
        time.sleep(1.0)
        now = _picture(browser)
        if _silver(now) > 0.005 and np.abs(now - before).mean() < 1e-3:
            return now
        before = now
    raise AssertionError(f"the arm never appeared: {_silver(before):.4f} of the picture is silver")


@pytest.mark.browser
@pytest.mark.long
def test_the_view_shows_the_arm_and_follows_it(browser: Any, tmp_path: Path) -> None:
    own = Path(ha.__file__).parent / "sim" / "models" / "meshes"
    for part in [*(own / "lbr").iterdir(), *(own / "iiwa14").iterdir()]:
        (tmp_path / part.name).write_bytes(part.read_bytes())
    with sim("--view", "--view-port", "0", "--meshes", str(tmp_path)) as ready:
        browser.set_window_size(1280, 900)
        browser.get(ready["view"])
        browser.switch_to.frame("view")
        first = _settled(browser)
        browser.save_screenshot(str(tmp_path / "view.png"))
        with ha.connect(ready["target"], watchdog=5.0, timeout=30.0) as arm:
            arm.move(ha.ptp(ha.deg(60, 50, 0, -60, 0, 60, 0)))
        second = _settled(browser)
        assert np.abs(second - first).mean() > 5e-3, "the picture did not change after a motion"
        deadline = time.monotonic() + 60.0
        while "60.0" not in (text := browser.find_element("tag name", "body").text):
            assert time.monotonic() < deadline, text
            time.sleep(0.2)
