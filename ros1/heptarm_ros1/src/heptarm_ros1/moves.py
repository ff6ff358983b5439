"""Single motions as actions, with feedback and a way to cancel them."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import rospy
from actionlib import ActionServer
from actionlib_msgs.msg import GoalStatus
from heptarm_msgs.msg import (
    MoveJointsAction,
    MoveJointsFeedback,
    MoveJointsResult,
    MovePoseAction,
    MovePoseFeedback,
    MovePoseResult,
)

from heptarm.arm.handle import MotionHandle
from heptarm.bridge import moves
from heptarm.bridge.driver import Driver
from heptarm.bridge.goal import Outcome
from heptarm.errors import HeptarmError, NotReady
from heptarm.values.motion import Motion
from heptarm_ros1 import convert

if TYPE_CHECKING:
    from heptarm_ros1.node import HeptarmNode

#: Action, its name, its feedback and its result.
ACTIONS = (
    (MoveJointsAction, "~move_joints", MoveJointsFeedback, MoveJointsResult),
    (MovePoseAction, "~move_pose", MovePoseFeedback, MovePoseResult),
)


def _motion(driver: Driver, goal: Any) -> Motion:
    if hasattr(goal, "joint_names"):
        return moves.to_joints(driver, goal.joint_names, goal.position)
    base = driver.configuration.frame("base")
    pose = convert.pose_value(goal.pose, base)
    return moves.to_pose(
        goal.path, pose, convert.pose_value(goal.via, base) if goal.path == moves.CIRC else pose
    )


class MoveActions:
    """Gives goals to the driver, and their progress and ends back to their clients."""

    def __init__(self, node: HeptarmNode) -> None:
        self._node = node
        self._servers = [
            ActionServer(name, kind, self._taker(feedback, result), auto_start=False)
            for kind, name, feedback, result in ACTIONS
        ]
        for server in self._servers:
            server.start()

    def _taker(self, feedback: Any, result: Any) -> Any:
        def take(handle: Any) -> None:
            driver, goal = self._node.driver, handle.get_goal()
            try:
                if driver is None:
                    raise NotReady("the node is not configured")
                motion = moves.start(driver, _motion(driver, goal), goal.speed)
            except HeptarmError as error:
                rospy.logwarn(f"motion rejected: {error}")
                handle.set_rejected(result(success=False, message=str(error)), str(error))
                return
            handle.set_accepted()
            threading.Thread(
                target=_follow, args=(handle, motion, feedback, result), name="heptarm-motion"
            ).start()

        return take


def _follow(handle: Any, motion: MotionHandle, feedback: Any, result: Any) -> None:
    def is_cancelled() -> bool:
        return bool(handle.get_goal_status().status == GoalStatus.PREEMPTING)

    try:
        moved = moves.follow(
            motion,
            on_progress=lambda share: handle.publish_feedback(feedback(progress=share)),
            is_cancelled=is_cancelled,
        )
        success = moved.outcome is Outcome.SUCCEEDED
        answer = result(success=success, message=moved.text, residual=moved.residual)
        if success:
            handle.set_succeeded(answer, moved.text)
        elif moved.outcome is Outcome.ABORTED:
            handle.set_aborted(answer, moved.text)
        else:
            handle.set_canceled(answer, moved.text)
    except rospy.ROSException as error:  # ROS has gone
        rospy.logdebug(f"telling of a motion: {error}")
