"""Flange and tool as transforms, for those who run no robot_state_publisher; the parameter `publish_tf`."""

from __future__ import annotations

from typing import Any

from heptarm.bridge.messages import Ros
from heptarm.bridge.parameters import Configuration
from heptarm.model.kinematics import forward
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel
from heptarm.values.state import State


class Frames:
    """Makes messages of /tf.

    Args:
        ros: of which ROS.
        configuration: how the frames are called.
        robot: for the flange, whose pose no state has while a tool is attached.
        types: tf2_msgs/TFMessage and geometry_msgs/TransformStamped.
    """

    def __init__(
        self, ros: Ros, configuration: Configuration, robot: RobotModel, types: tuple[Any, Any]
    ) -> None:
        self._ros, self._robot = ros, robot
        self._array, self._transform = types
        self._base, self._flange, self._tool = (
            configuration.frame(which) for which in ("base", "flange", "tool")
        )

    def of(self, state: State) -> Any:
        """The flange and what motions move, as seen from the base."""
        stamp = self._ros.time(max(0, self._ros.now() - max(0, round(state.age * 1e9))))
        found = [(self._flange, Pose.from_matrix(forward(self._robot, state.q)))]
        if state.cartesian is not None:
            found.append((self._tool, state.pose))
        return self._array(transforms=[self._one(name, pose, stamp) for name, pose in found])

    def _one(self, name: str, pose: Pose, stamp: Any) -> Any:
        message = self._transform(child_frame_id=name)
        message.header.stamp, message.header.frame_id = stamp, self._base
        place, turn = message.transform.translation, message.transform.rotation
        place.x, place.y, place.z = pose.xyz.tolist()
        turn.x, turn.y, turn.z, turn.w = pose.quat.tolist()
        return message
