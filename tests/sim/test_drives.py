"""Drives trip by their own supervision; the arm stands where the brakes stop it and goes on when acknowledged."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.controller.safety import StopRequest
from heptarm.sim.plant.drive_monitor import BEYOND, LAG, SPEED, TORQUE, TORQUE_TICKS, DriveMonitor
from heptarm.sim.plant.plant import Plant
from heptarm.values.mode.impedance import JointImpedance
from heptarm.values.mode.mode import Mode
from heptarm.values.pose import deg
from heptarm.values.robot import ROBOTS, RobotModel
from tests.sim import motions
from tests.sim.driving import Ear

NOTHING = np.zeros(7)
#: Every joint is stiff but A6, which floats.
FLOATS = JointImpedance([1000.0] * 5 + [0.0, 1000.0])
#: Compliant, but too stiff to be guided by hand: guiding bounds the velocity, and a push then trips the torque sensor.
COMPLIANT = JointImpedance(20.0)


def at(robot: RobotModel, axis: int, value: float) -> np.ndarray:
    found = np.zeros(7)
    found[axis - 1] = value
    return found


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=lambda robot: robot.name)
def test_each_range_is_supervised(robot: RobotModel) -> None:
    for axis in (1, 4, 7):
        monitor, k = DriveMonitor(robot), axis - 1
        just, beyond = 0.99, 1.01
        speed, reach = SPEED * robot.dq_max[k], robot.q_max[k] + BEYOND
        torque = TORQUE * robot.tau_max[k]
        for part in (-just, just):
            assert not monitor.check(at(robot, axis, part * speed), NOTHING, NOTHING, None)
            assert not monitor.check(NOTHING, at(robot, axis, part * reach), NOTHING, None)
            assert not monitor.check(NOTHING, NOTHING, NOTHING, at(robot, axis, part * LAG))
            for _ in range(2 * TORQUE_TICKS):
                assert not monitor.check(NOTHING, NOTHING, at(robot, axis, part * torque), None)
        named = f"drive error in A{axis}: "
        assert monitor.check(at(robot, axis, -beyond * speed), NOTHING, NOTHING, None).startswith(
            f"{named}velocity -"
        )
        assert monitor.check(NOTHING, at(robot, axis, beyond * reach), NOTHING, None).startswith(
            f"{named}position "
        )
        assert "behind its set-point" in monitor.check(
            NOTHING, NOTHING, NOTHING, at(robot, axis, beyond * LAG)
        )
        for _ in range(TORQUE_TICKS - 1):
            assert not monitor.check(NOTHING, NOTHING, at(robot, axis, beyond * torque), None)
        assert "range of the sensor" in monitor.check(
            NOTHING, NOTHING, at(robot, axis, beyond * torque), None
        )


def test_an_axis_that_is_outside_may_stay_there_but_go_no_further() -> None:
    robot = ROBOTS["iiwa7"]
    monitor, outside = DriveMonitor(robot), at(robot, 4, robot.q_max[3] + 3 * BEYOND)
    assert monitor.check(NOTHING, outside, NOTHING, None)
    monitor.acknowledge(outside)
    assert not monitor.check(NOTHING, outside, NOTHING, None)
    assert monitor.check(NOTHING, outside + 1.1 * BEYOND, NOTHING, None)
    assert not monitor.check(NOTHING, NOTHING, NOTHING, None)  # back inside
    assert monitor.check(NOTHING, outside, NOTHING, None)


def push_speed(plant: Plant, tick: int) -> None:
    plant.apply_wrench((400.0, 0.0, 0.0))


def push_beyond(plant: Plant, tick: int) -> None:
    plant.apply_wrench((0.0, 0.0, 0.0), (0.0, 40.0, 0.0))  # slow beside a free tool frame: no momentum helps


def push_slowly(plant: Plant, tick: int) -> None:
    plant.apply_wrench((0.0, 0.0, -0.5 * tick))


@pytest.mark.parametrize(
    ("mode", "a6", "push", "text"),
    [
        (COMPLIANT, 60.0, push_speed, "drive error in A6: velocity"),
        (FLOATS, 119.5, push_beyond, "drive error in A6: position 120."),
        (None, 60.0, push_slowly, "deg behind its set-point"),
    ],
    ids=["speed", "position", "lag"],
)
def test_a_drive_trips_and_recovers(
    mode: Mode | None, a6: float, push: Callable[[Plant, int], None], text: str
) -> None:
    plant, ear = Plant("iiwa14", q=tuple(deg(0, 30, 0, -90, 0, a6, 0).tolist())), Ear()
    plant.submit(
        MotionCommand(1, motions.hold(), listener=ear)
        if mode is None
        else MotionCommand(1, motions.hold(), mode=mode, listener=ear)
    )
    for tick in range(3000):
        push(plant, tick)
        plant.tick()
        if plant.safety.stop_requests:
            break
    assert plant.safety.stop_requests == {StopRequest.DRIVE_ERROR}
    plant.apply_wrench((0.0, 0.0, 0.0))
    here = plant.snapshot.q
    plant.step(600)
    assert ear.causes == ["started", "error"] and text in ear.heard[1][1]
    assert np.abs(plant.snapshot.dq).max() < 1e-3 and np.abs(plant.snapshot.q - here).max() < 0.2
    stood = plant.snapshot.q
    plant.acknowledge()
    plant.resume()
    plant.step(300)
    assert not plant.safety.stop_requests and np.abs(plant.snapshot.q - stood).max() < 0.01
    again, home = Ear(), deg(0, 20, 0, -80, 0, 50, 0)
    plant.submit(MotionCommand(2, motions.ptp(tuple(home.tolist())), listener=again))
    plant.step(3000)
    assert again.causes == ["started", "done"] and plant.snapshot.q == pytest.approx(home, abs=1e-3)


def test_drives_trip_unless_that_is_switched_off() -> None:
    plant = Plant("iiwa14", monitored=False)
    plant.submit(MotionCommand(1, motions.hold(), mode=JointImpedance(0.0)))
    plant.step(5)
    plant.apply_wrench((400.0, 0.0, 0.0))
    plant.step(100)
    assert not plant.safety.stop_requests
    assert (np.abs(plant.snapshot.dq) > SPEED * plant.robot.dq_max).any()
