"""Teleoperate: a joystick moves the arm and grasps a cube. Here a list plays the person at the joystick."""

import os
from collections.abc import Iterator

import numpy as np

import heptarm as ha

TABLE = "sim://iiwa14?scene=table"
GRIPPER = ha.Tool("two-finger", mass=1.0, com=(0, 0, 0.05), tcp=ha.Pose.at(0, 0, 0.16))
FULL = 0.08  # speed at full deflection [m/s]
#: Deflection of three axes, for how long [s], and whether the button is pressed: over the cube, down, grasp, up, aside
PERSON = [
    ((-1.0, 0.0, 0.0), 0.625, False),
    ((0.0, 0.0, -1.0), 1.0, False),
    ((0.0, 0.0, 0.0), 1.2, True),
    ((0.0, 0.0, 1.0), 1.0, True),
    ((0.0, 1.0, 0.0), 1.0, True),
]


def joystick(period: float) -> Iterator[tuple[np.ndarray, bool]]:
    """What a driver reads each period: deflections of the axes, -1 to 1, and the button."""
    for axes, duration, button in PERSON:
        for _ in range(round(duration / period)):
            yield np.array(axes), button


with ha.connect(os.environ.get("HEPTARM_TARGET_WITH_SCENE", TABLE), watchdog=2.0) as arm, arm.tool(GRIPPER):
    gripper = ha.TwoSignalGripper(
        arm,
        open="OutputX3Pin1",
        close="OutputX3Pin2",
        is_open="InputX3Pin3",
        is_closed="InputX3Pin4",
    )
    gripper.open()
    arm.move(ha.ptp(ha.deg(0, 25, 0, -90, 0, 65, 0)), speed=0.5)
    arm.move(ha.lin(ha.Pose.of((0.6, 0.0, 0.305), arm.pose().quat), speed_mps=0.2))
    before = arm.operator.where("cube")
    with arm.servo("lin", rate=50, speed_mps=0.15, acceleration_mps2=1.0, watchdog=1.0) as sv:
        place, closed = sv.start.pose.xyz, False
        for axes, button in joystick(sv.period):
            if sv.tick() is None:
                break
            place = place + FULL * sv.period * axes
            sv.set(ha.Pose.of(place, sv.start.pose.quat))
            if button != closed:  # the signals only: the stream must not pause
                arm.io.set({"OutputX3Pin1": not button, "OutputX3Pin2": button})
                closed = button
    print(f"{sv.stats.sent} targets, {sv.stats.late_ticks} late")
    after = arm.operator.where("cube")
    print(f"the cube: from {before.xyz.round(3)} to {after.xyz.round(3)}")
    assert gripper.holds_something and after.xyz[2] > before.xyz[2] + 0.06
    gripper.open()
