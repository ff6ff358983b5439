"""Motions as actions, with feedback and a way to cancel them; `heptarm.bridge.moves` has their table."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import rospy
from actionlib import ActionServer
from actionlib_msgs.msg import GoalStatus

from heptarm.arm.handle import MotionHandle
from heptarm.bridge import moves
from heptarm.bridge.goal import Outcome
from heptarm.bridge.messages import class_of
from heptarm.bridge.moves import MOVES, Move
from heptarm.errors import HeptarmError, NotReady
from heptarm_ros1 import convert

if TYPE_CHECKING:
    from heptarm_ros1.node import HeptarmNode


class MoveActions:
    """Gives goals to the driver, and their progress and ends back to their clients."""

    def __init__(self, node: HeptarmNode) -> None:
        self._node = node
        self._servers = [self._server(row) for row in MOVES]
        for server in self._servers:
            server.start()

    def _server(self, row: Move) -> ActionServer:
        action, feedback, result = (
            class_of(row.type + part, "msg") for part in ("Action", "Feedback", "Result")
        )
        take = self._taker(row, feedback, result)
        return ActionServer(convert.name(row.name), action, take, auto_start=False)

    def _taker(self, row: Move, feedback: Any, result: Any) -> Any:
        def take(handle: Any) -> None:
            driver, goal = self._node.driver, handle.get_goal()
            try:
                if driver is None:
                    raise NotReady("the node is not configured")
                motion = moves.start(driver, row, goal)
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
        answer = moved.fill(result())
        if moved.outcome is Outcome.SUCCEEDED:
            handle.set_succeeded(answer, moved.text)
        elif moved.outcome is Outcome.ABORTED:
            handle.set_aborted(answer, moved.text)
        else:
            handle.set_canceled(answer, moved.text)
    except rospy.ROSException as error:  # ROS has gone
        rospy.logdebug(f"telling of a motion: {error}")
