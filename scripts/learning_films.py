"""Make the films of the chapter on learning: docs/_static/learned-insertion.webp and demonstration.webp.

    MUJOCO_GL=egl .venv/bin/python scripts/learning_films.py [insertion|demonstration]

One is the included policy on the virtual arm, which knows its holes to 3 mm and 2 degrees only; the other an episode of
examples/learning/pick_place.py. It needs a display, or EGL or OSMesa for MUJOCO_GL.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "src"), str(ROOT)]

import heptarm as ha  # noqa: E402
from examples.learning import pick_place  # noqa: E402
from heptarm.rl.contact.peg_in_hole import PegInHole  # noqa: E402
from heptarm.rl.deploy_contact import ContactSettings, deploy_contact  # noqa: E402
from heptarm.rl.policy import shipped_contact  # noqa: E402
from heptarm.rl.station import held_peg  # noqa: E402
from scripts.film import View, chosen, drawn, modelled, recorded, written  # noqa: E402

FOLDER = ROOT / "docs" / "_static"
SIZE = (480, 320)  # width and height [pixels]
#: Insertions of the film, and the seed of what the policy does not know.
NUMBER, SEED = 3, 5


def insertion(arm: ha.Arm) -> None:
    """Insert a peg three times, each time with the hole elsewhere than presumed."""
    policy = shipped_contact(PegInHole)
    with held_peg(arm) as hole:
        errors = policy.task.targets(np.random.default_rng(SEED), NUMBER)
        origins = [policy.task.presumed(hole, error) for error in errors]
        report = deploy_contact(arm, policy, origins, errors, settings=ContactSettings(stale=2.0))
        print(report.summary())


def demonstration(arm: ha.Arm) -> None:
    """An episode of the script."""
    random = np.random.default_rng(SEED)
    pick_place.reset(arm, random)
    print("a success" if pick_place.demonstrate(arm, random) else "a failure")


#: Scene, performance, camera and length [s] of each film.
FILMS: dict[str, tuple[str, Callable[[ha.Arm], None], View, float]] = {
    "insertion": (
        "peg-in-hole",
        insertion,
        View(lookat=(0.6, 0.1, 0.29), distance=0.55, azimuth=150.0, elevation=-14.0, turn=8.0),
        10.0,
    ),
    "demonstration": ("bins", demonstration, View(lookat=(0.4, 0.0, 0.35), turn=8.0), 7.0),
}
FILES = {"insertion": "learned-insertion.webp", "demonstration": "demonstration.webp"}


def main() -> int:
    """Record, draw, write."""
    for name in sys.argv[1:] or FILMS:
        scene, perform, view, length = FILMS[name]
        model = modelled(scene)
        positions = chosen(recorded(model, scene, perform), length)
        written(drawn(model, positions, view, SIZE), FOLDER / FILES[name])
    return 0


if __name__ == "__main__":
    sys.exit(main())
