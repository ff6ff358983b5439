"""Action servers for the table of `heptarm.ros.interface.actions`."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import Any

import rospy
from actionlib import ActionServer
from actionlib_msgs.msg import GoalStatus

from heptarm.errors import HeptarmError, NotReady
from heptarm.ros.interface.action import ActionDispatcher, ActionResult, GoalWork, RosAction, fill
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.messages import class_of
from heptarm.ros.interface.offered import offered_actions
from heptarm.ros.trajectory.goal import GoalOutcome
from heptarm_ros1 import convert


class ActionServers:
    """Passes goals to their handlers, and feedback and results to their clients.

    Args:
        names: the parameter of that name.
        with_moveit: the parameter `moveit`.
    """

    def __init__(self, names: str, *, with_moveit: bool) -> None:
        self._dispatcher: ActionDispatcher | None = None
        self._servers = [self._server(row) for row in offered_actions(names, with_moveit=with_moveit)]
        for server in self._servers:
            server.start()

    def serve(self, context: NodeContext | None) -> None:
        """Use this context from now on; None: reject goals."""
        self._dispatcher = None if context is None else ActionDispatcher(context)

    def _server(self, row: RosAction) -> ActionServer:
        action = class_of(f"{row.type}Action", "msg")
        return ActionServer(convert.name(row.name), action, self._on_goal(row), auto_start=False)

    def _on_goal(self, row: RosAction) -> Callable[[Any], None]:
        result = class_of(f"{row.type}Result", "msg")

        def callback(handle: Any) -> None:
            try:
                if self._dispatcher is None:
                    raise NotReady("the node is not configured", hint="call ~configure")
                work = self._dispatcher.begin(row, handle.get_goal())
            except HeptarmError as error:
                rospy.logwarn(f"{row.name} rejected: {error}")
                refused = ActionResult(GoalOutcome.ABORTED, str(error)).fill(result())
                handle.set_rejected(refused, str(error))
                return
            handle.set_accepted()
            client = _Client(handle, class_of(f"{row.type}Feedback", "msg"))
            threading.Thread(
                target=_carry_out, args=(work, client, handle, result), name="heptarm-goal"
            ).start()

        return callback


class _Client:
    """The client of a goal."""

    def __init__(self, handle: Any, feedback: Any) -> None:
        self._handle, self._feedback = handle, feedback

    def publish_feedback(self, fields: Mapping[str, Any]) -> None:
        """Publish feedback, of the fields that its type has."""
        feedback = self._feedback()
        fill(feedback, fields)
        try:
            self._handle.publish_feedback(feedback)
        except rospy.ROSException as error:  # ROS has shut down
            rospy.logdebug(f"publishing feedback: {error}")

    def is_cancel_requested(self) -> bool:
        """Whether the client has requested to cancel the goal."""
        return bool(self._handle.get_goal_status().status == GoalStatus.PREEMPTING)


def _carry_out(work: GoalWork, client: _Client, handle: Any, kind: Any) -> None:
    result = work(client)
    message = result.fill(kind())
    try:
        if result.outcome is GoalOutcome.SUCCEEDED:
            handle.set_succeeded(message, result.text)
        elif result.outcome is GoalOutcome.ABORTED:
            handle.set_aborted(message, result.text)
        else:
            handle.set_canceled(message, result.text)
    except rospy.ROSException as error:  # ROS has shut down
        rospy.logdebug(f"publishing a result: {error}")
