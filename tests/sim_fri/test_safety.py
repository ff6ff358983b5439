"""The safety controller of the simulated arm in an FRI session: a stop ends the overlay, and the next one works."""

from __future__ import annotations

import numpy as np

from heptarm.fri.protocol import messages as m
from heptarm.planning.seam import OperationMode
from heptarm.sim.controller.safety import StopRequest
from heptarm.values.mode.mode import Position
from tests.sim_fri.rig import State, mirror
from tests.sim_fri.test_plant import World, swing


def test_an_emergency_stop_ends_the_overlay_and_the_next_one_works() -> None:
    world = World()
    world.active(m.CommandMode.POSITION, Position())
    world.client.law = swing(world, 0.1)
    world.run(400)
    assert world.controller.state is State.COMMANDING_ACTIVE and not world.ends
    world.plant.safety.request_stop(StopRequest.EMERGENCY_STOP)
    world.run(1)
    assert world.arm.reading().safety is m.Safety.STOP_1
    world.run(600)
    (end,) = world.ends
    assert end.cause == "safety" and "safety stop 1 on path" in end.text
    assert np.abs(world.q[-1] - world.q[-50]).max() < 1e-6  # at rest
    world.plant.safety.withdraw(StopRequest.EMERGENCY_STOP)
    world.plant.resume()
    world.client.law = mirror
    world.run(50)
    assert world.arm.reading().safety is m.Safety.NORMAL_OPERATION
    world.active(m.CommandMode.POSITION, Position())
    assert world.controller.state is State.COMMANDING_ACTIVE


def test_operation_mode_and_drives_are_reported() -> None:
    world = World()
    assert world.arm.reading().operation_mode is m.OperationMode.AUT
    world.plant.safety.choose(OperationMode.T1)
    reading = world.arm.reading()
    assert reading.operation_mode is m.OperationMode.T1 and reading.safety is m.Safety.STOP_1
    world.plant.safety.enable()
    assert world.arm.reading().safety is m.Safety.NORMAL_OPERATION
    world.plant.safety.request_stop(StopRequest.DRIVE_ERROR)
    assert world.arm.reading().drives is m.DriveState.OFF
