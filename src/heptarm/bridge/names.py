"""Topics and actions under the names of other drivers, for programs written for those: the nodes' parameter `names`.

Only what has standard types, and beside heptarm's own names, not in their place. A node looks a preset up, lays its
defaults under the parameters, and serves each entry by its meaning::

    preset = PRESETS[values["names"]]
    values = preset.defaults | values
    for entry in preset.entries:
        ...                                       # a publisher, subscriber or action server by entry.meaning
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from types import MappingProxyType

import numpy as np

from heptarm.bridge.driver import Driver
from heptarm.bridge.order import positions
from heptarm.errors import ShapeError
from heptarm.values.arrays import Array
from heptarm.values.pose import Pose


class Meaning(Enum):
    """What a topic or an action is."""

    JOINT_STATES = auto()
    POSE = auto()
    WRENCH = auto()
    STOP = auto()
    JOINT = auto()
    CARTESIAN = auto()
    TRAJECTORY = auto()
    FOLLOW = auto()


_TYPES = {
    Meaning.JOINT_STATES: "sensor_msgs/JointState",
    Meaning.POSE: "geometry_msgs/Pose",
    Meaning.WRENCH: "geometry_msgs/Wrench",
    Meaning.STOP: "std_msgs/Empty",
    Meaning.JOINT: "sensor_msgs/JointState",
    Meaning.CARTESIAN: "geometry_msgs/Pose",
    Meaning.TRAJECTORY: "trajectory_msgs/JointTrajectory",
    Meaning.FOLLOW: "control_msgs/FollowJointTrajectory",
}
#: What goes out; the rest comes in.
_OUT = (Meaning.JOINT_STATES, Meaning.POSE, Meaning.WRENCH)


@dataclass(frozen=True, slots=True)
class Entry:
    """One of another driver's topics or actions.

    Attributes:
        name: relative to the node's namespace.
        meaning: what it is.
        ours: heptarm's own name for it, "~" for the node's.
        external: the efforts of its joint states are external torques, not measured ones.
    """

    name: str
    meaning: Meaning
    ours: str
    external: bool = False

    @property
    def type(self) -> str:
        """Its type, as "package/Type"."""
        return _TYPES[self.meaning]

    @property
    def is_published(self) -> bool:
        """Whether the node publishes it; otherwise it listens."""
        return self.meaning in _OUT


@dataclass(frozen=True, slots=True)
class Preset:
    """Another driver's names.

    Attributes:
        defaults: of parameters, laid under those that are set.
        entries: its topics and actions.
    """

    defaults: Mapping[str, object] = field(default_factory=lambda: MappingProxyType({}))
    entries: tuple[Entry, ...] = ()


def _iiwa(flange: str) -> Mapping[str, object]:
    return MappingProxyType(
        {
            "joint_names": [f"iiwa_joint_{i}" for i in range(1, 8)],
            "base_frame": "iiwa_link_0",
            "flange_frame": flange,
        }
    )


_CONTROLLER = "iiwa/PositionJointInterface_trajectory_controller"

#: By the parameter `names`.
PRESETS: Mapping[str, Preset] = MappingProxyType(
    {
        "heptarm": Preset(),
        "libiiwa": Preset(
            _iiwa("iiwa_link_ee"),
            (
                Entry("iiwa/state/joint_states", Meaning.JOINT_STATES, "joint_states", external=True),
                Entry("iiwa/state/end_effector_pose", Meaning.POSE, "~/pose"),
                Entry("iiwa/state/end_effector_wrench", Meaning.WRENCH, "~/wrench"),
                Entry("iiwa/command/stop", Meaning.STOP, "~/stop"),
                Entry("iiwa/command/joint", Meaning.JOINT, "~/command/joint"),
                Entry("iiwa/command/cartesian", Meaning.CARTESIAN, "~/command/pose"),
                Entry("iiwa_controller/follow_joint_trajectory", Meaning.FOLLOW, "~/follow_joint_trajectory"),
            ),
        ),
        "iiwa_stack": Preset(
            _iiwa("iiwa_link_ee"),
            (
                Entry("iiwa/joint_states", Meaning.JOINT_STATES, "joint_states"),
                Entry(f"{_CONTROLLER}/command", Meaning.TRAJECTORY, "~/joint_trajectory"),
                Entry(f"{_CONTROLLER}/follow_joint_trajectory", Meaning.FOLLOW, "~/follow_joint_trajectory"),
            ),
        ),
    }
)


def joint_target(driver: Driver, names: Sequence[str], values: Sequence[float]) -> Array:
    """Joint positions as libiiwa takes them, shape (7,) [rad]: NaN keeps a joint where it is.

    Args:
        driver: whose arm it is.
        names: of the joints, in any order; empty: all, from the base on.
        values: positions [rad].

    Raises:
        ShapeError: an unknown name, a name twice, or not as many numbers as names.
    """
    wanted = positions(driver, names, values)
    return np.where(np.isnan(wanted), driver.arm.state.q_cmd, wanted)


def pose_target(driver: Driver, xyz: Sequence[float], quat: Sequence[float]) -> Pose:
    """A pose as libiiwa takes it: NaN keeps a coordinate, a quaternion of NaN or of nothing but 0 the orientation.

    Args:
        driver: whose arm it is.
        xyz: position of the flange in the base, shape (3,) [m].
        quat: orientation x, y, z, w.

    Raises:
        ShapeError: some numbers of the quaternion are NaN and others are not, or it is none.
    """
    here = driver.arm.state.pose_cmd
    place = np.where(np.isnan(xyz), here.xyz, xyz)
    turn = np.asarray(quat, dtype=np.float64)
    if np.isnan(turn).all() or not turn.any():
        return Pose.of(place, here.quat)
    if np.isnan(turn).any():
        raise ShapeError(
            f"the orientation is {turn.tolist()}; four numbers are wanted",
            hint="all NaN keeps the orientation",
        )
    return Pose.of(place, turn)
