"""Plans and worlds from a program to an open panel of the same user: through a folder that nobody else may enter."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm import shapes
from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.io import panel_box
from heptarm.io.panel_box import PanelBox, PlanOutline, WorldFiles, hand_over
from heptarm.values.mesh import Mesh

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "run"))
    (tmp_path / "run").mkdir(mode=0o700)
    return panel_box.folder()


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def outline(count: int = 50, robot: str = "iiwa14") -> PlanOutline:
    t = np.linspace(0.0, 2.0, count)
    q = HOME + t[:, None] * np.linspace(0.0, 0.1, 7)
    return PlanOutline(robot, t, q, np.column_stack([0.5 + 0 * t, 0.1 * t, 0.4 + 0 * t]), np.array([1.5]))


def test_an_open_panel_gets_the_newest_plan_once(folder: Path) -> None:
    assert not hand_over(outline()), "no panel is open"
    box = PanelBox(["iiwa7", "iiwa14"])
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
    box = PanelBox(["iiwa14"])
    assert not hand_over(outline()), "its card comes with the first page"
    box.take()
    card = folder / str(os.getpid()) / "panel.json"
    os.utime(card, (time.time() - 60.0,) * 2)
    assert not hand_over(outline()) and card.exists()
    os.utime(card, (time.time() - 1e6,) * 2)
    assert not hand_over(outline()) and not card.parent.exists()
    assert box.take() is None, "without its folder it stays empty"


def test_what_is_no_plan_is_dropped(folder: Path) -> None:
    box = PanelBox(["iiwa14"])
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
    PanelBox(["iiwa14"]).take()
    place = folder / str(os.getpid())
    assert place.stat().st_mode & 0o077 == 0
    place.chmod(0o757)
    assert not hand_over(outline())
    box = PanelBox(["iiwa14"])
    assert box.take() is None and not hand_over(outline())


def full_world() -> ha.CollisionModel:
    """A world with a body of each kind, one of them held, and a second arm."""
    world = ha.CollisionModel("iiwa14", scene="table", boxes=["0.3,-0.6,0.1,0.2,0.2,0.2"])
    turned = ha.Pose.at(0.7, 0.1, 0.3)
    corners = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
    wedge = Mesh(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    world.add("part", [shapes.box(0.1, 0.2, 0.05), wedge], at=turned, color=(0.9, 0.2, 0.1))
    world.add("bottle", shapes.cylinder(0.03, 0.2), at=turned)
    world.add_points([[0.6, 0.5, 0.2], [0.6, 0.6, 0.2]], color=(0.1, 0.4, 0.9, 0.5))
    world.hold("bottle", ha.Pose.at(0.0, 0.0, 0.1))
    world.place("block", ha.Pose.at(0.5, 0.2, 0.4))
    return world.with_arm("right", at=ha.Pose.at(1.4, 0.0, 0.0), robot="iiwa7", q=HOME)


def test_a_world_arrives_as_it_is_and_makes_the_same_checks(folder: Path) -> None:
    box, files = PanelBox(["iiwa14"]), WorldFiles("iiwa14")
    world = full_world()
    outline = world.outline()
    assert not files.put(outline) and box.world() is None, "its card comes with the first page"
    box.take()
    assert files.put(outline)
    shown = box.world()
    assert shown == outline and box.world() is shown, "the same object while nothing changes"
    copy = ha.CollisionModel.of(shown)
    assert copy.outline() == outline
    q = HOME + np.linspace(-1.0, 1.0, 30)[:, None]
    assert copy.distances(q) == pytest.approx(world.distances(q), abs=1e-9)
    files.put(ha.CollisionModel("iiwa14").outline())
    files.remove()
    assert box.world() is None and not list(folder.glob("*/*.world.json"))


def test_changes_are_shown_until_they_are_hidden_or_the_program_is_gone(folder: Path) -> None:
    box, world = PanelBox(["iiwa14"]), ha.CollisionModel("iiwa14")
    assert not world.show(), "no panel is open"
    box.take()  # a panel that is opened later

    def seen() -> dict[str, tuple[float, ...]]:
        outline = box.world()
        return {} if outline is None else {body.name: body.color for body in outline.bodies}

    until(lambda: box.world() is not None)
    assert world.show() and seen() == {}
    world.add("ball", shapes.sphere(0.05), at=ha.Pose.at(0.6, 0.0, 0.5), color=(1.0, 0.0, 0.0))
    until(lambda: seen() == {"ball": (1.0, 0.0, 0.0, 1.0)})
    world.set_color("ball", (0.0, 1.0, 0.0, 0.5))
    until(lambda: seen() == {"ball": (0.0, 1.0, 0.0, 0.5)})
    assert world.color("ball") == (0.0, 1.0, 0.0, 0.5)
    later = ha.CollisionModel("iiwa14")
    assert later.show(), "the one shown last is drawn"
    until(lambda: seen() == {})
    del later
    until(lambda: seen() == {"ball": (0.0, 1.0, 0.0, 0.5)})
    world.hide()
    assert box.world() is None

    files = WorldFiles("iiwa14")
    files.put(world.outline())
    left = next(folder.glob("*/*.world.json"))
    os.utime(left, (time.time() - 60.0,) * 2)
    assert box.world() is None and not left.exists(), "of a program that was killed"


@pytest.mark.parametrize("content", [b"", b"{}", b"[1", b'{"robot": "iiwa14", "bodies": [{"name": 1}]}'])
def test_what_is_no_world_is_not_shown(folder: Path, content: bytes) -> None:
    box = PanelBox(["iiwa14"])
    box.take()
    (folder / str(os.getpid()) / "1-1-1.world.json").write_bytes(content)
    assert box.world() is None


@pytest.mark.parametrize(
    "color", ["red", (1.0, 0.0), (1.0, 0.0, 0.0, 0.0, 0.0), (np.nan, 0.0, 0.0), (255, 0, 0), 1.0]
)
def test_what_is_no_colour_adds_nothing(color: Any) -> None:
    world = ha.CollisionModel("iiwa14")
    with pytest.raises((ShapeError, LimitError), match="color"):
        world.add("ball", shapes.sphere(0.05), at=ha.Pose.at(0.6, 0.0, 0.5), color=color)
    with pytest.raises((ShapeError, LimitError), match="color"):
        world.add_points([[0.6, 0.0, 0.5]], color=color)
    assert "ball" not in world.bodies and "points" not in world.bodies and world.revision == 0
    with pytest.raises(CommandRejected, match="a body that was added"):
        world.set_color("link_1", (1.0, 0.0, 0.0))
