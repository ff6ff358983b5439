"""The FollowJointTrajectory action."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from control_msgs.action import FollowJointTrajectory
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.task import Future

from heptarm.bridge import messages
from heptarm.bridge.goal import Code, End, GoalRefused, Outcome
from heptarm.bridge.runner import Feedback

if TYPE_CHECKING:
    from heptarm_ros2.node import HeptarmNode

#: How long the server may take to note a cancellation that has been carried out [s].
_NOTED = 5.0


class TrajectoryAction:
    """Gives goals to the driver, and their feedback and ends back to their clients."""

    def __init__(self, node: HeptarmNode, names: Sequence[str], group: Any) -> None:
        self._node = node
        self._lock = threading.Lock()
        self._numbers: dict[int, int] = {}  # of a goal message on its way to its handle
        self._ends: dict[int, Future[End]] = {}
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
            )
            for name in names
        ]

    def destroy(self) -> None:
        """End it."""
        for server in self._servers:
            server.destroy()

    def _on_goal(self, message: FollowJointTrajectory.Goal) -> GoalResponse:
        driver = self._node.driver
        try:
            if driver is None:
                raise GoalRefused("the node is not configured")
            goal = messages.action_goal(self._node.ros, message, now=driver.now)
            with self._lock:
                number = driver.accept(goal)
                self._numbers[id(message)] = number
                self._ends[number] = Future(executor=self._node.executor)
        except GoalRefused as error:
            self._node.get_logger().warning(f"goal rejected ({error.reason.name}): {error}")
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def _on_accepted(self, handle: Any) -> None:
        with self._lock:
            number = self._numbers.pop(id(handle.request))
            self._handles[number] = handle
        handle.execute()

    def _on_cancel(self, handle: Any) -> CancelResponse:
        number = self._number(handle)
        if number and self._node.driver is not None:
            self._node.driver.cancel(number)
        return CancelResponse.ACCEPT

    def _number(self, handle: Any) -> int:
        with self._lock:
            known = (number for number, one in self._handles.items() if one is handle)
            # a client that knows of its goal may ask for something before the server has given its handle
            return next(known, self._numbers.get(id(handle.request), 0))

    async def _execute(self, handle: Any) -> FollowJointTrajectory.Result:
        number = self._number(handle)
        end: End = await self._ends[number]
        with self._lock:
            del self._ends[number], self._handles[number]
        if end.outcome is Outcome.SUCCEEDED:
            handle.succeed()
        elif end.outcome is Outcome.CANCELED:
            patience = time.monotonic() + _NOTED
            while not handle.is_cancel_requested and time.monotonic() < patience:
                time.sleep(0.001)
            handle.canceled()
        else:
            handle.abort()
        return FollowJointTrajectory.Result(error_code=int(end.code), error_string=end.text)

    # -------------------------------------------------------------------------- from the driver

    def on_feedback(self, value: Feedback) -> None:
        """A goal went on."""
        handle = self._handles.get(value.number)
        if handle is not None and handle.is_active:
            joints = self._node.configuration.joints
            handle.publish_feedback(messages.feedback(self._node.ros, value, joints))

    def on_end(self, end: End) -> None:
        """A goal ended."""
        log = self._node.get_logger()
        if end.code is Code.SUCCESSFUL:
            log.info(f"goal {end.number} {end.outcome.value}: {end.text}")
        else:
            log.warning(f"goal {end.number} {end.outcome.value} ({end.code.name}): {end.text}")
        with self._lock:
            future = self._ends.get(end.number)
        if future is not None:
            future.set_result(end)
