"""Drives a plant tick by tick, without a clock and without Java."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant.plant import Plant
from heptarm.values.checks import Array
from heptarm.values.pose import Pose

READY = (0.0, 0.5, 0.0, -1.3, 0.0, 0.9, 0.0)


@dataclass
class Ear:
    """Records the events of an order."""

    heard: list[tuple[str, str]] = field(default_factory=list)

    def started(self) -> None:
        self.heard.append(("started", ""))

    def finished(self, cause: str, text: str) -> None:
        self.heard.append((cause, text))

    @property
    def causes(self) -> list[str]:
        return [cause for cause, _ in self.heard]


@dataclass
class Track:
    """Measured and commanded joints of every tick, shape (n, 7)."""

    q: Array
    q_cmd: Array
    dq: Array

    @property
    def acceleration(self) -> Array:
        return np.diff(self.q_cmd, 2, axis=0) * 1e6


def ready(model: str = "iiwa14") -> Plant:
    return Plant(model, q=READY)


def run(plant: Plant, *orders: MotionCommand, most: int = 30_000) -> Track:
    """Submit orders and tick until the plant is idle."""
    for order in orders:
        plant.submit(order)
    seen = []
    while not plant.idle:
        plant.tick()
        state = plant.snapshot
        seen.append((state.q, state.q_cmd, state.dq))
        assert len(seen) < most, "the plant never became idle"
    return Track(*(np.array(column) for column in zip(*seen, strict=True)))


def numbers(pose: Pose) -> tuple[float, ...]:
    return tuple(pose.array.tolist())
