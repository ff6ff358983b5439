"""Actions but for trajectories, with feedback and a way to cancel them; `heptarm.bridge.actions` has their table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rclpy.action import ActionServer, CancelResponse

from heptarm.bridge.action import Action, fill
from heptarm.bridge.actions import ACTIONS, Actions
from heptarm.bridge.goal import Outcome
from heptarm.bridge.messages import class_of
from heptarm.errors import HeptarmError

if TYPE_CHECKING:
    from heptarm.bridge.driver import Driver
    from heptarm_ros2.node import HeptarmNode


class ActionServers:
    """Gives goals to the driver, and their feedback and ends back to their clients.

    A goal that makes no sense is accepted and aborted at once: a rejection could not say why. A goal under way takes a
    thread of the executor: what waits in a coroutine would keep all of them busy asking for it.
    """

    def __init__(self, node: HeptarmNode, driver: Driver, group: Any) -> None:
        self._node = node
        self._actions = Actions(driver, node.ros)
        self._servers = [self._server(row, group) for row in ACTIONS]

    def destroy(self) -> None:
        """End them."""
        for server in self._servers:
            server.destroy()

    def _server(self, row: Action, group: Any) -> ActionServer:
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

    def _execute(self, row: Action, kind: Any, handle: Any) -> Any:
        try:
            work = self._actions.begin(row, handle.request)
        except HeptarmError as error:
            self._node.get_logger().warning(f"{row.name} refused: {error}")
            handle.abort()
            return kind.Result(success=False, message=str(error))
        ended = work(_Client(handle, kind))
        if ended.outcome is Outcome.SUCCEEDED:
            handle.succeed()
        elif handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        return ended.fill(kind.Result())


class _Client:
    """The client of a goal."""

    def __init__(self, handle: Any, kind: Any) -> None:
        self._handle, self._kind = handle, kind

    def tell(self, fields: Mapping[str, Any]) -> None:
        """Feedback, of the fields that its type has."""
        if self._handle.is_active:
            feedback = self._kind.Feedback()
            fill(feedback, fields)
            self._handle.publish_feedback(feedback)

    def has_cancelled(self) -> bool:
        """Whether it does not want the goal any more."""
        return bool(self._handle.is_cancel_requested)
