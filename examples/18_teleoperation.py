"""Teleoperate: a joystick moves the arm and grasps a cube. A list plays the person who watches and holds the stick."""

import os
from collections.abc import Callable

import numpy as np

import heptarm as ha

TABLE = "sim://iiwa14?scene=table"
GRIPPER = ha.Tool("two-finger", mass=1.0, com=(0, 0, 0.05), tcp=ha.Pose.at(0, 0, 0.16))
FULL = 0.08  # speed at full deflection [m/s]
AHEAD = 0.03  # the target is at most so far ahead of the arm [m]
#: Deflection of three axes, whether the button is pressed, and what the person waits for: place of the tip, seconds.
PERSON: list[tuple[str, tuple[float, float, float], bool, Callable[[np.ndarray, float], bool]]] = [
    ("over the cube", (-0.5, 0.0, 0.0), False, lambda tip, seconds: tip[0] < 0.553),
    ("down", (0.0, 0.0, -0.4), False, lambda tip, seconds: tip[2] < 0.230),
    ("grasp", (0.0, 0.0, 0.0), True, lambda tip, seconds: seconds > 0.8),
    ("up", (0.0, 0.0, 1.0), True, lambda tip, seconds: tip[2] > 0.31),
    ("aside", (0.0, 1.0, 0.0), True, lambda tip, seconds: tip[1] > 0.1),
]

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
        for what, axes, button, is_enough in PERSON:
            arm.io.set(
                {"OutputX3Pin1": not button, "OutputX3Pin2": button}
            )  # the signals only, without waiting
            began, state = arm.state.stamp, arm.state
            place = state.pose.xyz
            while sv.tick() is not None and not is_enough(state.pose.xyz, (state.stamp - began) * 1e-9):
                state = arm.state
                place = place + FULL * sv.period * np.array(axes)
                place = np.clip(place, state.pose.xyz - AHEAD, state.pose.xyz + AHEAD)
                sv.set(ha.Pose.of(place, sv.start.pose.quat))
            print(f"{what}: {arm.state.pose.xyz.round(3)}")
    print(f"{sv.stats.sent} targets, {sv.stats.late_ticks} late")
    after = arm.operator.where("cube")
    print(f"the cube: from {before.xyz.round(3)} to {after.xyz.round(3)}")
    assert gripper.holds_something and after.xyz[2] > before.xyz[2] + 0.06 and after.xyz[1] > 0.07
    gripper.open()
