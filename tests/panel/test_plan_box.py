"""Plans from a program to an open panel of the same user: through a folder that nobody else may enter."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm.io import plan_box
from heptarm.io.plan_box import PlanBox, PlanOutline, hand_over

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "run"))
    (tmp_path / "run").mkdir(mode=0o700)
    return plan_box.folder()


def outline(count: int = 50, robot: str = "iiwa14") -> PlanOutline:
    t = np.linspace(0.0, 2.0, count)
    q = HOME + t[:, None] * np.linspace(0.0, 0.1, 7)
    return PlanOutline(robot, t, q, np.column_stack([0.5 + 0 * t, 0.1 * t, 0.4 + 0 * t]), np.array([1.5]))


def test_an_open_panel_gets_the_newest_plan_once(folder: Path) -> None:
    assert not hand_over(outline()), "no panel is open"
    box = PlanBox(["iiwa7", "iiwa14"])
    assert box.take() is None
    assert hand_over(outline(20)) and hand_over(outline())
    assert box.take() == outline() and box.take() is None
    assert not hand_over(outline(robot="med7"))
    assert hand_over(outline(50_000))
    long = box.take()
    assert long is not None and len(long.t) == 2000 and long.t[-1] == 2.0
    box.close()
    assert not hand_over(outline()) and not list(folder.iterdir())


def test_a_panel_that_has_ended_or_that_nobody_looks_at_gets_none(folder: Path) -> None:
    box = PlanBox(["iiwa14"])
    assert not hand_over(outline()), "its card comes with the first page"
    box.take()
    card = folder / str(os.getpid()) / "panel.json"
    os.utime(card, (time.time() - 60.0,) * 2)
    assert not hand_over(outline()) and card.exists()
    os.utime(card, (time.time() - 1e6,) * 2)
    assert not hand_over(outline()) and not card.parent.exists()
    assert box.take() is None, "without its folder it stays empty"


def test_what_is_no_plan_is_dropped(folder: Path) -> None:
    box = PlanBox(["iiwa14"])
    box.take()
    place = folder / str(os.getpid())
    wrong = outline()
    for number, content in enumerate((b"", b"PK\3\4 no", os.urandom(1000))):
        (place / f"{number}.npz").write_bytes(content)
    np.savez(place / "3.npz", robot="iiwa14", t=wrong.t, q=wrong.q[:, :6], path=wrong.path, touches=[])
    np.savez(place / "4.npz", robot="iiwa14", t=wrong.t, q=np.nan * wrong.q, path=wrong.path, touches=[])
    np.savez(place / "5.npz", robot=np.array([object()]), t=wrong.t, q=wrong.q, path=wrong.path, touches=[])
    np.savez(place / "6.npz", t=wrong.t)
    assert box.take() is None and not list(place.glob("*.npz"))
    assert hand_over(wrong) and box.take() == wrong


@pytest.mark.skipif(sys.platform == "win32", reason="modes of POSIX")
def test_a_folder_that_others_may_enter_is_not_used(folder: Path) -> None:
    PlanBox(["iiwa14"]).take()
    place = folder / str(os.getpid())
    assert place.stat().st_mode & 0o077 == 0
    place.chmod(0o757)
    assert not hand_over(outline())
    box = PlanBox(["iiwa14"])
    assert box.take() is None and not hand_over(outline())
