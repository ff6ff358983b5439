"""Plans that a program hands to an open panel of the same user: files in a folder that nobody else may enter.

A panel that somebody looks at has a folder of its own below `folder()`, and refreshes a card in it. A program writes a
plan there as numbers (`numpy.savez`), complete under its final name, and the panel takes it: numbers, no code. A card
that is no longer fresh is that of a panel that has ended, or that nobody looks at.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import shutil
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from heptarm.io.folders import is_private, private_folder, runtime_folder
from heptarm.values.checks import Array, Value

_CARD, _SUFFIX = "panel.json", ".npz"
#: Most samples of a plan that are handed over, and the largest file that is read [bytes].
_MOST, _LARGEST = 2000, 4_000_000
#: Age up to which a card is fresh, and the one after which its folder is removed [s].
_FRESH, _OLD = 10.0, 86_400.0


@dataclass(frozen=True, slots=True, eq=False)
class PlanOutline(Value):
    """What a panel shows of a plan. n samples over time.

    Attributes:
        robot: name of the robot, such as "iiwa14".
        t: times from its beginning [s], shape (n,).
        q: joint positions, shape (n, 7) [rad].
        path: positions of the tool frame in the base, shape (n, 3) [m].
        touches: times at which bodies would touch [s], shape (m,).
    """

    robot: str
    t: Array
    q: Array
    path: Array
    touches: Array


def folder() -> Path:
    """Folder of this user's open panels: heptarm/panels in XDG_RUNTIME_DIR, otherwise in the temporary folder."""
    return runtime_folder() / "panels"


class PlanBox:
    """The folder of an open panel; where none can be made that is this user's alone, it stays empty.

    Args:
        robots: names of the robots that the panel shows.
    """

    def __init__(self, robots: Sequence[str]) -> None:
        self._folder: Path | None = None
        self._robots = json.dumps(list(robots)).encode()
        with contextlib.suppress(OSError):
            self._folder = private_folder(folder() / str(os.getpid()))

    def take(self) -> PlanOutline | None:
        """The newest plan that has arrived since the last call, None: there is none; to be called every second."""
        if self._folder is None:
            return None
        newest: PlanOutline | None = None
        with contextlib.suppress(OSError):
            _put(self._folder / _CARD, self._robots)
            for file in sorted(self._folder.glob(f"*{_SUFFIX}"), key=lambda path: path.stat().st_mtime_ns):
                newest = _read(file) or newest
                file.unlink()
        return newest

    def close(self) -> None:
        """Remove the folder."""
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)


def hand_over(plan: PlanOutline) -> bool:
    """Give a plan to the open panel that shows its robot, the newest one of several; returns whether there is one."""
    keep = np.unique(np.linspace(0, len(plan.t) - 1, min(len(plan.t), _MOST)).astype(int))
    content = io.BytesIO()
    np.savez(
        content,
        robot=np.array(plan.robot),
        t=plan.t[keep],
        q=plan.q[keep],
        path=plan.path[keep],
        touches=plan.touches,
    )
    for place in _open_panels(plan.robot):
        with contextlib.suppress(OSError):
            _put(place / f"{time.time_ns()}{_SUFFIX}", content.getvalue())
            return True
    return False


def _open_panels(robot: str) -> list[Path]:
    """Folders of the open panels that show a robot, the newest first."""
    found, now = [], time.time()
    with contextlib.suppress(OSError):
        for place in folder().iterdir():
            if not place.name.isdigit() or not is_private(place):
                continue
            with contextlib.suppress(OSError, ValueError):
                card = place / _CARD
                age = now - (card if card.exists() else place).stat().st_mtime
                if age > _OLD:
                    shutil.rmtree(place, ignore_errors=True)
                elif age < _FRESH and robot in json.loads(card.read_text(encoding="utf-8")):
                    found.append((place.stat().st_ctime_ns, place))
    return [place for _, place in sorted(found, reverse=True)]


def _put(file: Path, content: bytes) -> None:
    """Write a file that is complete as soon as it has its name."""
    handle, name = tempfile.mkstemp(dir=file.parent)
    with open(handle, "wb") as stream:
        stream.write(content)
    os.replace(name, file)


def _read(file: Path) -> PlanOutline | None:
    """A plan of a file; None: it is none."""
    if file.stat().st_size > _LARGEST:
        return None
    try:
        with np.load(io.BytesIO(file.read_bytes()), allow_pickle=False) as found:
            plan = PlanOutline(
                str(found["robot"]),
                *(np.asarray(found[name], float) for name in ("t", "q", "path", "touches")),
            )
    except Exception:  # of any bytes in place of a plan
        return None
    if plan.t.ndim != 1:
        return None
    count = len(plan.t)
    shapes = plan.t.shape == (count,) and plan.q.shape == (count, 7) and plan.path.shape == (count, 3)
    finite = all(np.isfinite(array).all() for array in (plan.t, plan.q, plan.path, plan.touches))
    return plan if count and shapes and finite else None
