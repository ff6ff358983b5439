"""Motions as actions, with feedback and a way to cancel them; `heptarm.bridge.moves` has their table."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rclpy.action import ActionServer, CancelResponse

from heptarm.bridge import moves
from heptarm.bridge.goal import Outcome
from heptarm.bridge.messages import class_of
from heptarm.bridge.moves import MOVES, Move
from heptarm.errors import HeptarmError, NotReady

if TYPE_CHECKING:
    from heptarm_ros2.node import HeptarmNode


class MoveActions:
    """Gives goals to the driver, and their progress and ends back to their clients.

    A goal that makes no sense is accepted and aborted at once: a rejection could not say why.
    """

    def __init__(self, node: HeptarmNode, group: Any) -> None:
        self._node = node
        self._servers = [self._server(row, group) for row in MOVES]

    def destroy(self) -> None:
        """End them."""
        for server in self._servers:
            server.destroy()

    def _server(self, row: Move, group: Any) -> ActionServer:
        kind = class_of(row.type, "action")
        return ActionServer(
            self._node,
            kind,
            row.name,
            self._executor(row, kind),
            callback_group=group,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )

    def _executor(self, row: Move, kind: Any) -> Callable[[Any], Any]:
        def execute(handle: Any) -> Any:
            driver = self._node.driver
            try:
                if driver is None:
                    raise NotReady("the node is not configured")
                motion = moves.start(driver, row, handle.request)
            except HeptarmError as error:
                self._node.get_logger().warning(f"motion refused: {error}")
                handle.abort()
                return kind.Result(success=False, message=str(error))
            moved = moves.follow(
                motion,
                on_progress=lambda share: handle.publish_feedback(kind.Feedback(progress=share)),
                is_cancelled=lambda: bool(handle.is_cancel_requested),
            )
            if moved.outcome is Outcome.SUCCEEDED:
                handle.succeed()
            elif handle.is_cancel_requested:
                handle.canceled()
            else:
                handle.abort()
            return moved.fill(kind.Result())

        return execute
