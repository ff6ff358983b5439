"""A program for libiiwa, as its users write them: joints, a line, a stream of targets. Nothing here is heptarm's.

python libiiwa_moves.py &                               # waits in LibIiwa(); needs libiiwa, and NumPy before 2.0
heptarm bridge libiiwa --target sim://iiwa14
"""

from __future__ import annotations

import time

import numpy as np
from libiiwa import ControlInterface, LibIiwa, MotionType

HOME = np.radians([0, 30, 0, -90, 0, 60, 0])
NEAR = HOME + np.array([0.1, 0.05, 0.1, 0.1, 0.1, -0.1, 0.2])

iiwa = LibIiwa()


def rest() -> np.ndarray:
    """Wait for the end of the motion; joint positions [rad]."""
    time.sleep(0.1)
    while iiwa.get_state(refresh=True)["has_active_motion"]:
        time.sleep(0.02)
    return np.array(iiwa.get_state(refresh=True)["joint_position"])


iiwa.set_desired_joint_velocity_rel(0.5)
assert iiwa.command_joint_position(NEAR)
print(f"joints: {1e3 * np.abs(rest() - NEAR).max():.3f} mrad off")

place = np.array(iiwa.get_state(refresh=True)["cartesian_position"])
iiwa.set_motion_type(MotionType.MOTION_TYPE_LIN)
assert iiwa.command_cartesian_pose(place - [0, 0, 0.05])
rest()
reached = np.array(iiwa.get_state(refresh=True)["cartesian_position"])
print(f"line: {1e3 * np.linalg.norm(reached - place + [0, 0, 0.05]):.3f} mm off")

iiwa.set_motion_type(MotionType.MOTION_TYPE_PTP)
iiwa.set_control_interface(ControlInterface.CONTROL_INTERFACE_SERVO)
start = np.array(iiwa.get_state(refresh=True)["joint_position"])
for step in range(1, 31):
    assert iiwa.command_joint_position(start + (HOME - start) * step / 30)
    time.sleep(0.03)
time.sleep(1.5)
off = np.abs(np.array(iiwa.get_state(refresh=True)["joint_position"]) - HOME).max()
print(f"stream: {1e3 * off:.3f} mrad off")
iiwa.command_stop()
iiwa.shutdown()
