"""Runs the plant, or MuJoCo alone, in a realtime loop at 1 kHz; `bench.simulator.tick` starts this process.

Reads "plant COUNT" or "bare COUNT" line by line and answers each with the costs of so many ticks, a JSON list [us].
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable

import mujoco

from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant.plant import Plant
from heptarm.sim.plant.shared_state import SharedState
from heptarm.sim.runtime.realtime_loop import RealtimeLoop
from tests.sim import motions

HERE, THERE = (0.0, 0.5, 0.0, -1.3, 0.0, 0.9, 0.0), (0.6, 0.7, 0.2, -1.0, 0.3, 0.7, 0.4)


class Moving:
    """The plant, moving back and forth."""

    def __init__(self) -> None:
        self._plant, self._number = Plant("iiwa14", q=HERE), 0
        self.shared = self._plant.shared

    def prepare(self) -> None:
        """Order the next motion; a plan costs more than a tick and is not part of it."""
        if self._plant.idle:
            self._number += 1
            self._plant.submit(MotionCommand(self._number, motions.ptp(THERE if self._number % 2 else HERE)))

    def step(self) -> None:
        """One tick."""
        self._plant.tick()


class Bare:
    """The same model in MuJoCo, at rest without gravity."""

    def __init__(self) -> None:
        plant = Plant("iiwa14", q=HERE)
        self._model, self._data, self.shared = plant.model, plant.data, SharedState()
        self._model.opt.gravity[:] = 0.0

    def prepare(self) -> None:
        """Nothing."""

    def step(self) -> None:
        """One step."""
        mujoco.mj_step(self._model, self._data)


def paced(
    shared: SharedState, prepare: Callable[[], None], step: Callable[[], None], count: int
) -> list[float]:
    """Durations of steps of a realtime loop [us]."""
    costs: list[float] = []

    def tick() -> None:
        begin = time.perf_counter_ns()
        step()
        costs.append((time.perf_counter_ns() - begin) / 1e3)
        if len(costs) == count:
            loop.stop()
        prepare()

    loop = RealtimeLoop(shared, tick, real_time="on")
    loop.run()
    return costs


if __name__ == "__main__":
    sides: dict[str, Moving | Bare] = {"plant": Moving(), "bare": Bare()}
    for line in sys.stdin:
        name, count = line.split()
        side = sides[name]
        side.prepare()
        print(json.dumps(paced(side.shared, side.prepare, side.step, int(count))), flush=True)
