"""The FollowJointTrajectory action."""

from __future__ import annotations

import queue
import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import rospy
from actionlib import ActionServer
from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryResult

from heptarm.bridge import messages
from heptarm.bridge.goal import Code, End, GoalRefused, Outcome
from heptarm.bridge.runner import Feedback
from heptarm_ros1.convert import ROS

if TYPE_CHECKING:
    from heptarm_ros1.node import HeptarmNode


class TrajectoryAction:
    """Gives goals to the driver, and their feedback and ends back to their clients.

    A full action server, not the simple one: that can reject no goal with a code, and takes one goal after the other.

    Args:
        node: whose driver runs the goals.
        names: of the action; a server each.
    """

    def __init__(self, node: HeptarmNode, names: Sequence[str]) -> None:
        self._node = node
        self._lock = threading.Lock()
        self._handles: dict[int, Any] = {}
        # The driver's threads must not wait for the server's lock, so they leave their news here.
        self._news: queue.SimpleQueue[Feedback | End | None] = queue.SimpleQueue()
        self._teller = threading.Thread(target=self._tell, name="heptarm-goals")
        self._teller.start()
        self._servers = [
            ActionServer(name, FollowJointTrajectoryAction, self._on_goal, self._on_cancel, auto_start=False)
            for name in names
        ]
        for server in self._servers:
            server.start()

    def close(self) -> None:
        """Tell the last news."""
        self._news.put(None)
        self._teller.join()

    def _on_goal(self, handle: Any) -> None:
        driver = self._node.driver
        try:
            if driver is None:
                raise GoalRefused("the node is not configured")
            goal = messages.action_goal(ROS, handle.get_goal(), now=driver.now)
            with self._lock:
                self._handles[driver.accept(goal)] = handle
                handle.set_accepted()
        except GoalRefused as error:
            rospy.logwarn(f"goal rejected ({error.reason.name}): {error}")
            handle.set_rejected(_result(error.reason, str(error)), str(error))

    def _on_cancel(self, handle: Any) -> None:
        with self._lock:
            number = next((number for number, one in self._handles.items() if one == handle), 0)
        if number and self._node.driver is not None:
            self._node.driver.cancel(number)

    # -------------------------------------------------------------------------- from the driver

    def on_feedback(self, value: Feedback) -> None:
        """A goal went on."""
        self._news.put(value)

    def on_end(self, end: End) -> None:
        """A goal ended."""
        self._news.put(end)

    def _tell(self) -> None:
        while (news := self._news.get()) is not None:
            try:
                if isinstance(news, End):
                    self._end(news)
                else:
                    self._feedback(news)
            except rospy.ROSException as error:  # ROS has gone
                rospy.logdebug(f"telling of a goal: {error}")

    def _feedback(self, value: Feedback) -> None:
        with self._lock:
            handle = self._handles.get(value.number)
        if handle is not None:
            handle.publish_feedback(messages.feedback(ROS, value, self._node.configuration.joints))

    def _end(self, end: End) -> None:
        with self._lock:
            handle = self._handles.pop(end.number, None)
        text = f"goal {end.number} {end.outcome.value}: {end.text}"
        if end.code is Code.SUCCESSFUL:
            rospy.loginfo(text)
        else:
            rospy.logwarn(text)
        if handle is None:  # it came by a topic
            return
        result = _result(end.code, end.text)
        if end.outcome is Outcome.SUCCEEDED:
            handle.set_succeeded(result, end.text)
        elif end.outcome is Outcome.ABORTED:
            handle.set_aborted(result, end.text)
        else:  # in ROS 1 a goal that ran and was cancelled is a preempted one, too
            handle.set_canceled(result, end.text)


def _result(code: Code, text: str) -> FollowJointTrajectoryResult:
    return FollowJointTrajectoryResult(error_code=int(code), error_string=text)
