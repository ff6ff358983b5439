"""Single motions as actions, with feedback and a way to cancel them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from heptarm_msgs.action import MoveJoints, MovePose
from rclpy.action import ActionServer, CancelResponse

from heptarm.bridge import moves
from heptarm.bridge.driver import Driver
from heptarm.bridge.goal import Outcome
from heptarm.errors import HeptarmError, NotReady
from heptarm.values.motion import Motion
from heptarm_ros2 import convert

if TYPE_CHECKING:
    from heptarm_ros2.node import HeptarmNode

#: Actions and their names.
ACTIONS = ((MoveJoints, "~/move_joints"), (MovePose, "~/move_pose"))


def _motion(driver: Driver, goal: Any) -> Motion:
    if hasattr(goal, "joint_names"):
        return moves.to_joints(driver, goal.joint_names, goal.position)
    base = driver.configuration.frame("base")
    pose = convert.pose_value(goal.pose, base)
    via = convert.pose_value(goal.via, base) if goal.path == moves.CIRC else pose
    return moves.to_pose(goal.path, pose, via)


class MoveActions:
    """Gives goals to the driver, and their progress and ends back to their clients.

    A goal that makes no sense is accepted and aborted at once: a rejection could not say why.
    """

    def __init__(self, node: HeptarmNode, group: Any) -> None:
        self._node = node
        self._servers = [
            ActionServer(
                node,
                kind,
                name,
                self._executor(kind),
                callback_group=group,
                cancel_callback=lambda _: CancelResponse.ACCEPT,
            )
            for kind, name in ACTIONS
        ]

    def destroy(self) -> None:
        """End them."""
        for server in self._servers:
            server.destroy()

    def _executor(self, kind: Any) -> Callable[[Any], Any]:
        def execute(handle: Any) -> Any:
            driver = self._node.driver
            try:
                if driver is None:
                    raise NotReady("the node is not configured")
                motion = moves.start(driver, _motion(driver, handle.request), handle.request.speed)
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
            success = moved.outcome is Outcome.SUCCEEDED
            return kind.Result(success=success, message=moved.text, residual=moved.residual)

        return execute
