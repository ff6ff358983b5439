"""Measure what is on the flange: the tip of a tool from poses about a fixed point, and its load from a few rests."""

import os

import heptarm as ha
from heptarm import calibration, model

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
GRIPPER = ha.Tool("gripper", mass=2.0, com=(0.01, -0.02, 0.08))  # its tip is not known yet
PIN = ha.Pose.at(0.55, 0.0, 0.25)  # a pin that is fixed in the cell, where a person brings the tip
TIP = ha.Pose.at(0.012, -0.034, 0.187)  # only the simulated person knows it
TILTS = [ha.deg(*abc) for abc in ((0, 30, 0), (25, -30, 0), (-25, 0, 30), (0, 0, -30), (10, 20, 20))]


with ha.connect(os.environ.get("HEPTARM_TARGET", "sim://iiwa14")) as arm:
    arm.move(ha.ptp(HOME), speed=0.5)
    down = arm.pose("flange")
    tilts = iter(TILTS)

    def guide(text: str) -> bool:
        """What a person does who is asked for the next pose."""
        print(text)
        turned = down.rotated(*next(tilts))
        flange = ha.Pose.of(PIN.xyz - turned.rotation @ TIP.xyz, turned.quat)
        arm.move(ha.ptp(model.solve(arm.robot, flange, near=HOME)), speed=0.5)
        return True

    tip = calibration.tcp(calibration.record_poses(arm, count=len(TILTS), confirm=guide))
    print(tip)

    arm.move(ha.ptp(HOME), speed=0.5)
    with arm.tool(tip.to_tool(GRIPPER)):
        plan = calibration.load_plan(arm, speed=0.5, seconds=0.5)
        print(plan)  # what moves, before it moves
        print(calibration.load(arm, plan=plan))
        print(arm.verify_load())
