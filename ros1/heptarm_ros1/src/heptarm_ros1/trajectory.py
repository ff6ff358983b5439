"""The FollowJointTrajectory action."""

from __future__ import annotations

import queue
import threading
import traceback
from collections.abc import Sequence
from typing import Any

import rospy
from actionlib import ActionServer
from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryResult

from heptarm.ros.interface import messages
from heptarm.ros.node.driver import Driver
from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, GoalRefused, GoalResult
from heptarm.ros.trajectory.runner import GoalFeedback
from heptarm_ros1.convert import ROS


class TrajectoryAction:
    """Passes goals to the driver, and feedback and results to their clients.

    A full action server: the simple one cannot reject a goal with a code, and executes queued goals one by one.

    Args:
        names: of the action; a server each.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._driver: Driver | None = None
        self._joints: Sequence[str] = ()
        self._lock = threading.Lock()
        self._handles: dict[int, Any] = {}
        # the driver's threads must not wait for the lock of the server, so a thread of our own publishes
        self._outbox: queue.SimpleQueue[GoalFeedback | GoalResult | None] = queue.SimpleQueue()
        self._publisher = threading.Thread(target=self._publish, name="heptarm-goals")
        self._publisher.start()
        self._servers = [
            ActionServer(name, FollowJointTrajectoryAction, self._on_goal, self._on_cancel, auto_start=False)
            for name in names
        ]
        for server in self._servers:
            server.start()

    def serve(self, driver: Driver | None) -> None:
        """Pass goals to this driver from now on; None: reject them."""
        if driver is not None:
            self._joints = driver.configuration.joints
        self._driver = driver

    def close(self) -> None:
        """Publish what is left."""
        self._outbox.put(None)
        self._publisher.join()

    def _on_goal(self, handle: Any) -> None:
        driver = self._driver
        try:
            if driver is None:
                raise GoalRefused("the node is not configured", hint="call ~configure")
            goal = messages.action_goal(ROS, handle.get_goal(), now=lambda: driver.now)
            with self._lock:
                self._handles[driver.accept(goal)] = handle
                handle.set_accepted()
        except GoalRefused as error:
            rospy.logwarn(f"goal rejected ({error.reason.name}): {error}")
            handle.set_rejected(_result(error.reason, str(error)), str(error))
        except Exception as error:  # actionlib would only log it, and the client wait for ever
            text = f"internal error of the node: {error!r}"
            rospy.logerr(f"goal rejected: {text}\n{traceback.format_exc()}")
            handle.set_rejected(_result(ErrorCode.INVALID_GOAL, text), text)

    def _on_cancel(self, handle: Any) -> None:
        with self._lock:
            number = next((number for number, one in self._handles.items() if one == handle), 0)
        driver = self._driver
        if number and driver is not None:
            driver.cancel(number)

    # -------------------------------------------------------------------------- from the driver

    def on_feedback(self, value: GoalFeedback) -> None:
        """Queue feedback."""
        self._outbox.put(value)

    def on_result(self, result: GoalResult) -> None:
        """Queue a result."""
        self._outbox.put(result)

    def _publish(self) -> None:
        while (one := self._outbox.get()) is not None:
            try:
                if isinstance(one, GoalResult):
                    self._end(one)
                else:
                    self._feedback(one)
            except rospy.ROSException as error:  # ROS has shut down
                rospy.logdebug(f"publishing about a goal: {error}")

    def _feedback(self, value: GoalFeedback) -> None:
        with self._lock:
            handle = self._handles.get(value.number)
        driver = self._driver
        if handle is not None and driver is not None:
            handle.publish_feedback(messages.feedback(ROS, value, self._joints, now=driver.now))

    def _end(self, result: GoalResult) -> None:
        with self._lock:
            handle = self._handles.pop(result.number, None)
        text = f"goal {result.number} {result.outcome.value}: {result.text}"
        if result.code is ErrorCode.SUCCESSFUL:
            rospy.loginfo(text)
        elif handle is None and result.outcome is GoalOutcome.PREEMPTED:
            rospy.logdebug(text)  # replaced by a topic, as its clients intend
        else:
            rospy.logwarn(text)
        if handle is None:  # the trajectory came by topic
            return
        message = _result(result.code, result.text)
        if result.outcome is GoalOutcome.SUCCEEDED:
            handle.set_succeeded(message, result.text)
        elif result.outcome is GoalOutcome.ABORTED:
            handle.set_aborted(message, result.text)
        else:  # actionlib reports a goal that was cancelled while active as preempted
            handle.set_canceled(message, result.text)


def _result(code: ErrorCode, text: str) -> FollowJointTrajectoryResult:
    return FollowJointTrajectoryResult(error_code=int(code), error_string=text)
