"""Scripts of a plant: what happens to it tick by tick, and the record of all its states."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from heptarm.planning.seam import SLOTS, OperationMode
from heptarm.sim.controller.safety import StopRequest
from heptarm.sim.plant.plant import HOME, Plant
from heptarm.sim.plant.sensor_errors import sensor_errors
from heptarm.sim.plant.world import Box
from heptarm.values.checks import Array
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.robot import Body, robot
from tests.sim import motions
from tests.sim.driving import READY
from tests.sim.ideal import KINDS

Event = Callable[[Plant], object]

_COMPLIANT = JointImpedance([300.0] * 7)


@dataclass(frozen=True)
class PlantScript:
    """A plant, and what happens to it.

    Attributes:
        events: by tick.
        ticks: how many pass.
        q: joint positions at the start [rad].
        box: a box in the world.
        noisy: whether the sensors have errors.
    """

    events: Mapping[int, Event] = field(default_factory=dict)
    ticks: int = 1200
    q: tuple[float, ...] = READY
    box: Box | None = None
    noisy: bool = False

    def record(self) -> Array:
        """All states as floats, shape (ticks, StateWords.SIZE)."""
        plant = Plant(
            "iiwa14",
            q=self.q,
            boxes=() if self.box is None else (self.box,),
            errors=sensor_errors(robot("iiwa14"), "noisy:3") if self.noisy else None,
        )
        states = []
        for tick in range(self.ticks):
            if tick in self.events:
                self.events[tick](plant)
            plant.tick()
            states.append(plant.shared.floats[plant.tick_count % SLOTS].copy())
        return np.array(states)


def submit(kind: str, **changes: object) -> Event:
    """The event that a motion is ordered."""
    return lambda plant: plant.submit(replace(KINDS[kind], **changes))  # type: ignore[arg-type]


def _override(value: float) -> Event:
    return lambda plant: setattr(plant, "override", value)


def _stop(plant: Plant) -> None:
    plant.safety.request_stop(StopRequest.EMERGENCY_STOP)


def _go_on(plant: Plant) -> None:
    plant.safety.withdraw()
    plant.resume()


def _t1(plant: Plant) -> None:
    plant.safety.choose(OperationMode.T1)
    plant.safety.enable()
    plant.resume()


def _target(q: tuple[float, ...]) -> Event:
    return lambda plant: plant.shared.post(1, np.array(q))


_BODY = Body(3.0, np.array((0.0, 0.02, 0.1)))
_LATER = (0.3, 0.4, 0.2, -1.1, 0.2, 0.7, 0.1)

PLANT_SCRIPTS = {
    **{kind: PlantScript({3: submit(kind)}) for kind in ("ptp", "lin", "circ", "batch", "spline")},
    "from the straight arm": PlantScript({3: submit("ptp")}, q=(0.0,) * 7),
    "from home, twice": PlantScript(
        {3: submit("ptp"), 5: submit("ptp", id=2, motion=motions.ptp(HOME)), 7: submit("lin", id=3)},
        ticks=3000,
        q=HOME,
    ),
    "overrides": PlantScript(
        {3: submit("ptp"), 200: _override(0.3), 500: _override(0.9), 700: _override(1.0), 900: _override(0.0)}
    ),
    "pause": PlantScript({3: submit("lin"), 300: Plant.pause, 700: Plant.resume}),
    "stop on the path": PlantScript({3: submit("circ"), 400: Plant.stop}),
    "pause of a joint motion": PlantScript({3: submit("ptp"), 300: Plant.pause, 700: Plant.resume}),
    "stop of a joint motion": PlantScript({3: submit("ptp"), 400: Plant.stop}),
    "fast stop, and another motion": PlantScript(
        {3: submit("ptp"), 400: Plant.stop_fast, 700: submit("ptp", id=2, motion=motions.ptp(READY))}
    ),
    "emergency stop and release": PlantScript({3: submit("ptp"), 400: _stop, 900: _go_on}, ticks=1600),
    "T1": PlantScript({3: _t1, 5: submit("ptp")}),
    "servo": PlantScript({3: submit("servo"), 20: _target(_LATER), 400: _target(READY)}),
    "direct": PlantScript({3: submit("direct"), 20: _target(_LATER), 200: _target(READY)}),
    "joint impedance": PlantScript(
        {3: submit("ptp", mode=_COMPLIANT), 1100: submit("ptp", id=2, motion=motions.ptp(READY))}
    ),
    "cartesian impedance": PlantScript(
        {
            3: submit(
                "hold",
                mode=CartesianImpedance((800.0, 900.0, 700.0, 60.0, 70.0, 50.0)),
                motion=motions.hold(0.6),
            ),
            100: lambda plant: plant.apply_wrench((10.0, -5.0, 8.0), duration=0.2),
        }
    ),
    "a push": PlantScript(
        {
            3: submit("ptp"),
            200: lambda plant: plant.apply_wrench((20.0, 5.0, -8.0), (1.0, 0.5, 0.2), duration=0.3),
        }
    ),
    "load data": PlantScript({3: lambda plant: plant.set_load_data(_BODY), 5: submit("lin")}),
    "an unknown payload": PlantScript({3: lambda plant: plant.set_payload(_BODY), 5: submit("ptp")}),
    "a trip of a drive": PlantScript(
        {
            3: submit("ptp"),
            300: lambda plant: plant.apply_wrench((1500.0, 900.0, 0.0), duration=0.05),
            900: lambda plant: (plant.acknowledge(), plant.resume()),
            950: submit("ptp", id=2, motion=motions.ptp(READY)),
        },
        ticks=1500,
    ),
    "noisy sensors": PlantScript({3: submit("ptp")}, noisy=True),
    "contact": PlantScript(
        {3: submit("lin", motion=motions.lin_rel((0.0, 0.0, -0.25, 0.0, 0.0, 0.0, 1.0), velocity=0.12))},
        box=Box((0.6, 0.0, 0.25), (0.6, 0.8, 0.3)),
    ),
}
