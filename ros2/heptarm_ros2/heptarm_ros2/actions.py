"""Action servers for the table of `heptarm.ros.interface.actions`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rclpy.action import ActionServer, CancelResponse
from rclpy.node import Node

from heptarm.errors import HeptarmError
from heptarm.ros.interface.action import ActionDispatcher, ActionResult, RosAction, fill
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.messages import class_of
from heptarm.ros.interface.offered import offered_actions
from heptarm.ros.trajectory.goal import GoalOutcome


class ActionServers:
    """Passes goals to their handlers, and feedback and results to their clients.

    An invalid goal is accepted and aborted immediately: a rejection cannot carry the reason. Each active goal takes a
    thread of the executor; a coroutine that waits would be polled by all of them.
    """

    def __init__(self, node: Node, context: NodeContext, group: Any) -> None:
        self._node = node
        self._dispatcher = ActionDispatcher(context)
        values = context.driver.configuration.values
        rows = offered_actions(values["names"], with_moveit=values["moveit"])
        self._servers = [self._server(row, group) for row in rows]

    def destroy(self) -> None:
        """Destroy the servers."""
        for server in self._servers:
            server.destroy()

    def _server(self, row: RosAction, group: Any) -> ActionServer:
        kind = class_of(row.type, "action")

        def execute(handle: Any) -> Any:
            return self._execute(row, kind, handle)

        return ActionServer(
            self._node,
            kind,
            row.name,
            execute,
            callback_group=group,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )

    def _execute(self, row: RosAction, kind: Any, handle: Any) -> Any:
        try:
            work = self._dispatcher.begin(row, handle.request)
        except HeptarmError as error:
            self._node.get_logger().warning(f"{row.name} refused: {error}")
            handle.abort()
            return ActionResult(GoalOutcome.ABORTED, str(error)).fill(kind.Result())
        result = work(_Client(handle, kind))
        if result.outcome is GoalOutcome.SUCCEEDED:
            handle.succeed()
        elif handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        return result.fill(kind.Result())


class _Client:
    """The client of a goal."""

    def __init__(self, handle: Any, kind: Any) -> None:
        self._handle, self._kind = handle, kind

    def publish_feedback(self, fields: Mapping[str, Any]) -> None:
        """Publish feedback, of the fields that its type has."""
        if self._handle.is_active:
            feedback = self._kind.Feedback()
            fill(feedback, fields)
            self._handle.publish_feedback(feedback)

    def is_cancel_requested(self) -> bool:
        """Whether the client has requested to cancel the goal."""
        return bool(self._handle.is_cancel_requested)
