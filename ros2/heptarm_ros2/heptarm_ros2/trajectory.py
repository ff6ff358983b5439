"""The FollowJointTrajectory action."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from typing import Any

from control_msgs.action import FollowJointTrajectory
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.task import Future

from heptarm.ros.interface import messages
from heptarm.ros.interface.messages import RosAdapter
from heptarm.ros.node.driver import Driver
from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, GoalRefused, GoalResult
from heptarm.ros.trajectory.runner import GoalFeedback

#: How long the server may take to mark a cancelled goal as canceling [s], and how often that is checked [s].
_CANCELING_TIMEOUT, _CANCELING_PERIOD = 5.0, 0.002

#: The default of services keeps ten requests; a burst of more goals would be lost without an answer.
_MANY = QoSProfile(depth=100)


class TrajectoryAction:
    """Passes goals to the driver, and feedback and results to their clients.

    Args:
        node: offers the action.
        ros: types and time.
        driver: executes the goals.
        names: of the action; a server each.
        group: callback group.
    """

    def __init__(self, node: Node, ros: RosAdapter, driver: Driver, names: Sequence[str], group: Any) -> None:
        self._node, self._ros, self._driver, self._group = node, ros, driver, group
        self._lock = threading.Lock()  # for the tables below
        self._numbers: dict[int, int] = {}  # by the goal message, until the server gives its handle
        self._results: dict[int, Future[GoalResult]] = {}
        self._handles: dict[int, Any] = {}
        self._servers = [
            ActionServer(
                node,
                FollowJointTrajectory,
                name,
                self._execute,
                callback_group=group,
                goal_callback=self._on_goal,
                handle_accepted_callback=self._on_accepted,
                cancel_callback=self._on_cancel,
                goal_service_qos_profile=_MANY,
                result_service_qos_profile=_MANY,
                cancel_service_qos_profile=_MANY,
            )
            for name in names
        ]

    def destroy(self) -> None:
        """Destroy the servers."""
        for server in self._servers:
            server.destroy()

    def _on_goal(self, message: FollowJointTrajectory.Goal) -> GoalResponse:
        try:
            goal = messages.action_goal(self._ros, message, now=lambda: self._driver.now)
            number = self._driver.accept(goal)
        except GoalRefused as error:
            self._node.get_logger().warning(f"goal rejected ({error.reason.name}): {error}")
            return GoalResponse.REJECT
        future: Future[GoalResult] = Future(executor=self._node.executor)
        with self._lock:
            self._numbers[id(message)], self._results[number] = number, future
        # a goal may end before its number is known here; the results of others must not wait for that
        result = self._driver.result(number, timeout=0.0)
        if result is not None:
            future.set_result(result)
        return GoalResponse.ACCEPT

    def _on_accepted(self, handle: Any) -> None:
        with self._lock:
            number = self._numbers.pop(id(handle.request))
            self._handles[number] = handle
        handle.execute()

    def _on_cancel(self, handle: Any) -> CancelResponse:
        number = self._number(handle)
        if number:
            self._driver.cancel(number)
        return CancelResponse.ACCEPT

    def _number(self, handle: Any) -> int:
        with self._lock:
            found = (number for number, one in self._handles.items() if one is handle)
            # a client may already cancel its goal before the server has given the handle
            return next(found, self._numbers.get(id(handle.request), 0))

    async def _execute(self, handle: Any) -> FollowJointTrajectory.Result:
        number = self._number(handle)
        with self._lock:
            future = self._results[number]
        result: GoalResult = await future
        with self._lock:
            del self._results[number], self._handles[number]
        if result.outcome is GoalOutcome.SUCCEEDED:
            handle.succeed()
        elif result.outcome is GoalOutcome.CANCELED:
            await self._canceling(handle)
            handle.canceled()
        else:
            handle.abort()
        return FollowJointTrajectory.Result(error_code=int(result.code), error_string=result.text)

    async def _canceling(self, handle: Any) -> None:
        """Wait until the server has marked a goal as canceling, which it does after the cancel callback."""
        marked: Future[None] = Future(executor=self._node.executor)
        deadline = time.monotonic() + _CANCELING_TIMEOUT

        def check() -> None:
            if (handle.is_cancel_requested or time.monotonic() > deadline) and not marked.done():
                marked.set_result(None)

        check()
        if marked.done():
            return
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        timer = self._node.create_timer(_CANCELING_PERIOD, check, callback_group=self._group, clock=clock)
        await marked
        self._node.destroy_timer(timer)

    # -------------------------------------------------------------------------- from the driver

    def on_feedback(self, value: GoalFeedback) -> None:
        """Publish feedback."""
        with self._lock:
            handle = self._handles.get(value.number)
        if handle is not None and handle.is_active:
            driver = self._driver
            message = messages.feedback(self._ros, value, driver.configuration.joints, now=driver.now)
            handle.publish_feedback(message)

    def on_result(self, result: GoalResult) -> None:
        """Log a result and pass it to its client."""
        with self._lock:
            future = self._results.get(result.number)
        log = self._node.get_logger()
        if result.code is ErrorCode.SUCCESSFUL:
            log.info(f"goal {result.number} {result.outcome.value}: {result.text}")
        elif future is None and result.outcome is GoalOutcome.PREEMPTED:
            log.debug(
                f"trajectory {result.number} of the topic: {result.text}"
            )  # as clients of a topic intend
        else:
            log.warning(f"goal {result.number} {result.outcome.value} ({result.code.name}): {result.text}")
        if future is not None:
            future.set_result(result)
