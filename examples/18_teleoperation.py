"""Teleoperate: a device moves the arm and grasps a cube; a function plays the person who holds the stick."""

import os

import heptarm as ha
from heptarm import devices, skills

TABLE = "sim://iiwa14?scene=table"
GRIPPER = ha.Tool("two-finger", mass=1.0, com=(0, 0, 0.05), tcp=ha.Pose.at(0, 0, 0.16))


def person(seconds: float) -> devices.DeviceInput:
    """Looks where the tip is, and pushes the stick: over the cube, down, grasp, up and aside."""
    tip = arm.state.pose.xyz
    if gripper.holds_something:
        return devices.DeviceInput.of([0, 1.0, 1.0 * (tip[2] < 0.31), 0, 0, 0])
    if tip[0] > 0.553:
        return devices.DeviceInput.of([-0.7, 0, 0, 0, 0, 0])
    down = tip[2] > 0.230
    return devices.DeviceInput.of([0, 0, -0.7 * down, 0, 0, 0], [] if down else ["grip"])


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
    arm.workspace = ha.Workspace(((0.4, -0.3, 0.2), (0.7, 0.3, 0.6)))  # no safety function
    device = devices.synthetic(person, roles=devices.Roles(gripper="grip"))  # a real one: devices.gamepad()
    stats = skills.teleoperate(
        arm,
        device,
        gripper=gripper,
        scale=0.08,
        watchdog=1.0,
        duration=60.0,
        while_true=lambda _: arm.state.pose.y < 0.1,
    )
    print(stats)
    after = arm.operator.where("cube")
    print(f"the cube: from {before.xyz.round(3)} to {after.xyz.round(3)}")
    assert gripper.holds_something and after.xyz[2] > before.xyz[2] + 0.06 and after.xyz[1] > 0.07
    gripper.open()
