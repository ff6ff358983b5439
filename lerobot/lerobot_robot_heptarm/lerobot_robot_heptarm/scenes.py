"""Tasks in the scenes of a virtual arm: where their bodies begin, the way to do them, and when they are done.

Teleoperators show them, environments judge them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

import heptarm as ha
from heptarm import model

#: Where an episode begins and ends, and the tip of the scenes' gripper in the flange frame.
HOME = ha.deg(0, 25, 0, -90, 0, 65, 0)
_TIP = ha.Pose.at(0, 0, 0.16)
#: The scenes' gripper: without its load the joints sag, and far enough a drive error stops the arm.
GRIPPER = ha.Tool("two-finger", mass=1.0, com=(0, 0, 0.05), tcp=_TIP)
#: Places along a way in a second [1/s].
FINE = 100


class Leg(NamedTuple):
    """A part of a way: to a place of the tip, fingers downwards, in a time; the gripper meanwhile."""

    place: tuple[float, float, float]
    duration: float
    opens: bool


@dataclass(frozen=True)
class SceneTask:
    """A task.

    Attributes:
        words: what is to be done.
        scene: of the virtual arm.
        body: that is moved.
        prepare: puts the body to a place drawn at random, and returns the way to do the task.
        goal: where the body is in the end, x y z [m].
        tolerance: along x, y and z [m].
        duration: of the way, and of an episode [s].
    """

    words: str
    scene: str
    body: str
    prepare: Callable[[ha.Arm, np.random.Generator], list[Leg]]
    goal: tuple[float, float, float]
    tolerance: tuple[float, float, float]
    duration: float

    def is_done(self, arm: ha.Arm) -> bool:
        """Whether the body is where it belongs."""
        away = np.abs(arm.operator.where(self.body).xyz - np.array(self.goal))
        return bool((away < np.array(self.tolerance)).all())


def _bins(arm: ha.Arm, random: np.random.Generator) -> list[Leg]:
    x, y = random.uniform((0.515, 0.18), (0.545, 0.22))
    start = arm.operator.where("part_1")
    arm.operator.place("part_1", ha.Pose.of((x, y, start.xyz[2]), start.quat))
    grasp, above = 0.232, 0.34
    return [
        Leg((x, y, above), 2.0, opens=True),
        Leg((x, y, grasp), 1.2, opens=True),
        Leg((x, y, grasp), 0.8, opens=False),
        Leg((x, y, above), 1.0, opens=False),
        Leg((0.53, -0.20, above), 2.0, opens=False),
        Leg((0.53, -0.20, grasp + 0.003), 1.2, opens=False),
        Leg((0.53, -0.20, grasp + 0.003), 0.6, opens=True),
        Leg((0.53, -0.20, above), 0.8, opens=True),
    ]


def _peg(arm: ha.Arm, random: np.random.Generator) -> list[Leg]:
    x, y, head, top = 0.6, -0.1, 0.265, 0.24
    high = head + random.uniform(0.1, 0.12)  # the peg stands in its holder; the way differs
    return [
        Leg((x, y, high), 2.0, opens=True),
        Leg((x, y, head), 1.5, opens=True),
        Leg((x, y, head), 0.8, opens=False),
        Leg((x, y, high), 1.5, opens=False),
        Leg((0.6, 0.1, top + 0.075), 2.0, opens=False),
        Leg((0.6, 0.1, top + 0.035), 2.0, opens=False),
        Leg((0.6, 0.1, top + 0.035), 0.6, opens=True),
        Leg((0.6, 0.1, high), 1.2, opens=True),
    ]


#: Tasks by name.
TASKS = {
    "pick-place": SceneTask(
        words="put the cube into the other bin",
        scene="bins",
        body="part_1",
        prepare=_bins,
        goal=(0.57, -0.20, 0.226),
        tolerance=(0.09, 0.10, 0.01),
        duration=13.0,
    ),
    "peg": SceneTask(
        words="insert the peg",
        scene="peg-in-hole",
        body="peg",
        prepare=_peg,
        goal=(0.6, 0.1, 0.2),
        tolerance=(0.001, 0.001, 0.012),
        duration=15.0,
    ),
}


def way(arm: ha.Arm, legs: list[Leg]) -> Iterator[tuple[np.ndarray, bool]]:
    """Joint positions and the gripper along a way, `FINE` in a second.

    They lead from where the arm is to the first place, from there along straight lines, and back to `HOME`.
    """
    down = ha.Pose.from_matrix(model.forward(arm.robot, HOME)) @ _TIP

    def solved(place: np.ndarray, near: np.ndarray) -> np.ndarray:
        return model.solve(arm.robot, ha.Pose.of(place, down.quat) @ _TIP.inverse(), near=near)

    here = np.array(legs[0].place)
    q = solved(here, HOME)
    yield from _between(arm.state.q, q, legs[0])
    for leg in legs[1:]:
        for place, opens in _between(here, np.array(leg.place), leg):
            q = solved(place, q)
            yield q, opens
        here = np.array(leg.place)
    yield from _between(q, HOME, Leg((0.0, 0.0, 0.0), 2.0, legs[-1].opens))


def _between(start: np.ndarray, end: np.ndarray, leg: Leg) -> Iterator[tuple[np.ndarray, bool]]:
    """Values from one to another one that begin and end at rest."""
    steps = max(round(leg.duration * FINE), 1)
    for part in np.arange(1, steps + 1) / steps:
        yield start + part * part * (3.0 - 2.0 * part) * (end - start), leg.opens
