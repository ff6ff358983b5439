"""Whether the cabinet's flange is where the robot model has it: an unnamed media flange moves it by centimetres.

No interface of the cabinet reports the media flange, but the pose of the motion frame contains its height.
"""

from __future__ import annotations

import numpy as np

from heptarm.model.kinematics import forward
from heptarm.values.pose import Pose
from heptarm.values.robot import FLANGES, RobotModel
from heptarm.values.state import Cartesian, Joints

#: A model agrees with the cabinet as far as this [m].
TOLERANCE = 1e-3
#: Farther from an axis no point of the arm is [m]: bounds how fast the motion frame moves.
_REACH = 1.5


def flange_warning(robot: RobotModel, joints: Joints, reported: Cartesian, expected: Pose) -> str | None:
    """What is wrong with the flange of a robot model, and the flange that is likely mounted; None: nothing.

    Args:
        robot: as it was connected.
        joints: measured.
        reported: pose of the motion frame that the cabinet reports.
        expected: pose of the motion frame that follows from the joints and the robot model.
    """
    # the two are samples of different moments; the arm may move
    apart = 1e-9 * abs(joints.stamp - reported.stamp) * _REACH * float(np.abs(np.nan_to_num(joints.dq)).sum())
    allowed = TOLERANCE + apart
    turn = forward(robot, joints.q)[:3, :3]
    off = turn.T @ (reported.pose.xyz - expected.xyz)  # in the axes of the flange
    if float(np.linalg.norm(off)) <= allowed:
        return None
    text = (
        f"the cabinet's flange is {1e3 * float(np.linalg.norm(off)):.1f} mm from where the model of the {robot.title} "
        f'with the flange "{robot.flange.name}" has it'
    )
    height = robot.flange.height + float(off[2])
    if float(np.linalg.norm(off[:2])) > allowed or height < -allowed:
        return (
            f"{text}, and no media flange explains that: check the robot's type, its mastering and the tool"
        )
    for flange in FLANGES.values():
        if abs(flange.height - height) <= allowed:
            return (
                f'{text}: it likely is "{flange.name}" ({flange.title}); connect with flange="{flange.name}"'
            )
    return f"{text}: its flange likely is {1e3 * height:.1f} mm high; connect with flange={height:.4f}"
