"""Actions but for trajectories, with feedback and a way to cancel them; `heptarm.bridge.actions` has their table."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import Any

import rospy
from actionlib import ActionServer
from actionlib_msgs.msg import GoalStatus

from heptarm.bridge.action import Action, Work, fill
from heptarm.bridge.actions import ACTIONS, Actions
from heptarm.bridge.driver import Driver
from heptarm.bridge.goal import Outcome
from heptarm.bridge.messages import class_of
from heptarm.errors import HeptarmError, NotReady
from heptarm_ros1 import convert


class ActionServers:
    """Gives goals to the driver, and their feedback and ends back to their clients."""

    def __init__(self) -> None:
        self._actions: Actions | None = None
        self._servers = [self._server(row) for row in ACTIONS]
        for server in self._servers:
            server.start()

    def serve(self, driver: Driver | None) -> None:
        """Give goals to this driver from now on; None: reject them."""
        self._actions = None if driver is None else Actions(driver, convert.ROS)

    def _server(self, row: Action) -> ActionServer:
        action = class_of(f"{row.type}Action", "msg")
        return ActionServer(convert.name(row.name), action, self._taker(row), auto_start=False)

    def _taker(self, row: Action) -> Callable[[Any], None]:
        result = class_of(f"{row.type}Result", "msg")

        def take(handle: Any) -> None:
            try:
                if self._actions is None:
                    raise NotReady("the node is not configured")
                work = self._actions.begin(row, handle.get_goal())
            except HeptarmError as error:
                rospy.logwarn(f"{row.name} rejected: {error}")
                handle.set_rejected(result(success=False, message=str(error)), str(error))
                return
            handle.set_accepted()
            client = _Client(handle, class_of(f"{row.type}Feedback", "msg"))
            threading.Thread(
                target=_carry_out, args=(work, client, handle, result), name="heptarm-goal"
            ).start()

        return take


class _Client:
    """The client of a goal."""

    def __init__(self, handle: Any, feedback: Any) -> None:
        self._handle, self._feedback = handle, feedback

    def tell(self, fields: Mapping[str, Any]) -> None:
        """Feedback, of the fields that its type has."""
        feedback = self._feedback()
        fill(feedback, fields)
        try:
            self._handle.publish_feedback(feedback)
        except rospy.ROSException as error:  # ROS has gone
            rospy.logdebug(f"telling of a goal: {error}")

    def has_cancelled(self) -> bool:
        """Whether it does not want the goal any more."""
        return bool(self._handle.get_goal_status().status == GoalStatus.PREEMPTING)


def _carry_out(work: Work, client: _Client, handle: Any, result: Any) -> None:
    ended = work(client)
    answer = ended.fill(result())
    try:
        if ended.outcome is Outcome.SUCCEEDED:
            handle.set_succeeded(answer, ended.text)
        elif ended.outcome is Outcome.ABORTED:
            handle.set_aborted(answer, ended.text)
        else:
            handle.set_canceled(answer, ended.text)
    except rospy.ROSException as error:  # ROS has gone
        rospy.logdebug(f"telling of a goal: {error}")
