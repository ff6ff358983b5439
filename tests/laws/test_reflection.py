"""Force reflection: however late and stiff the follower's wall is, the leader gives back no more than was put in."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest

from heptarm import laws
from tests.laws.plant import DT, Plant
from tests.long import few

#: Stiffness of the wall that the leader feels [N/m], of the hand [N/m], and its damping [N s/m].
WALL, HAND, HAND_DAMPING = 4000.0, 400.0, 4.0


class Hand:
    """A person who holds the leader and moves it down into the wall, and who counts the energy that the hand gives."""

    def __init__(self, plant: Plant) -> None:
        self.plant, self.start = plant, plant.place
        self.last, self.force, self.energy = plant.place, np.zeros(3), 0.0

    def __call__(self, t: float) -> np.ndarray:
        here = self.plant.place
        self.energy += float(self.force @ (here - self.last))
        goal = self.start - [0.0, 0.0, 0.1 * min(2.0 * t, 1.0)]
        self.last = here
        self.force = HAND * (goal - here) - HAND_DAMPING * self.plant.velocity[:3]
        return self.force


def press(*, passive: bool, delay: float, seconds: float = 1.2) -> tuple[np.ndarray, np.ndarray]:
    """Kinetic energy of the leader less what the hand gave [J], and the height of the flange [m], each millisecond."""
    plant = Plant(laws.reflected_force(passive=passive, force_max=80.0, damping=[0.5] * 7))
    hand = Hand(plant)
    plant.push = hand
    wall = plant.place[2] - 0.05
    late = deque([plant.place[2]] * round(delay / DT), maxlen=round(delay / DT))
    surplus, heights = [], []
    for _ in range(round(seconds / DT)):
        depth = max(0.0, wall - late[0])  # of the follower, whose movement and force both come late
        plant.trial.params.wrench = [0.0, 0.0, min(WALL * depth, 150.0), 0.0, 0.0, 0.0]
        plant.torque_step()
        late.append(plant.place[2])
        surplus.append(plant.energy() - hand.energy)
        heights.append(plant.place[2])
    return np.array(surplus), np.array(heights) - wall


@pytest.mark.parametrize("delay", few([0.06, 0.02]))
def test_the_energy_never_exceeds_what_the_hand_has_put_in_and_the_wall_is_felt(delay: float) -> None:
    surplus, heights = press(passive=True, delay=delay)
    assert surplus.max() < 1e-4, "kinetic energy is at most what the hand gave"
    assert np.ptp(heights[-300:]) < 0.025, "it rests at the wall"
    assert heights.min() > -0.035, "where the hand alone would be 50 mm inside"


def test_without_the_observer_the_same_wall_throws_the_hand_back() -> None:
    surplus, heights = press(passive=False, delay=0.06)
    assert surplus.max() > 1.0 and np.ptp(heights[-300:]) > 0.05
