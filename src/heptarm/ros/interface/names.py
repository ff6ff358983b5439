"""Names of other drivers' topics and actions, for programs written for those: the nodes' parameter `names`.

Only names with standard types; they are offered besides heptarm's own. The defaults of a preset apply where a
parameter is not set, and a node offers each entry by its role::

    preset = PRESETS[values["names"]]
    values = preset.defaults | values
    for entry in preset.entries:
        ...                                       # a publisher, subscriber or action server by entry.role
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from types import MappingProxyType


class NameRole(Enum):
    """What a topic or an action is for."""

    JOINT_STATES = auto()
    POSE = auto()
    WRENCH = auto()
    STOP = auto()
    JOINT = auto()
    CARTESIAN = auto()
    TRAJECTORY = auto()
    FOLLOW = auto()


_TYPES = {
    NameRole.JOINT_STATES: "sensor_msgs/JointState",
    NameRole.POSE: "geometry_msgs/Pose",
    NameRole.WRENCH: "geometry_msgs/Wrench",
    NameRole.STOP: "std_msgs/Empty",
    NameRole.JOINT: "sensor_msgs/JointState",
    NameRole.CARTESIAN: "geometry_msgs/Pose",
    NameRole.TRAJECTORY: "trajectory_msgs/JointTrajectory",
    NameRole.FOLLOW: "control_msgs/FollowJointTrajectory",
}
#: Roles that the node publishes; it subscribes to the others or serves them.
_PUBLISHED = (NameRole.JOINT_STATES, NameRole.POSE, NameRole.WRENCH)


@dataclass(frozen=True, slots=True)
class PresetName:
    """A topic or an action of another driver.

    Attributes:
        name: relative to the node's namespace.
        role: what it is for.
        native: heptarm's own name for it, "~/" for the node's.
        external: the efforts of its joint states are external torques, not measured ones.
    """

    name: str
    role: NameRole
    native: str
    external: bool = False

    @property
    def type(self) -> str:
        """Its type, as "package/Type"."""
        return _TYPES[self.role]

    @property
    def is_published(self) -> bool:
        """Whether the node publishes it."""
        return self.role in _PUBLISHED


@dataclass(frozen=True, slots=True)
class Preset:
    """Names of another driver.

    Attributes:
        defaults: of parameters that are not set.
        entries: its topics and actions.
    """

    defaults: Mapping[str, object] = field(default_factory=lambda: MappingProxyType({}))
    entries: tuple[PresetName, ...] = ()

    def actions(self) -> tuple[str, ...]:
        """Names of its trajectory actions."""
        return tuple(entry.name for entry in self.entries if entry.role is NameRole.FOLLOW)

    def published(self) -> tuple[PresetName, ...]:
        """Its topics that the node publishes."""
        return tuple(entry for entry in self.entries if entry.is_published)


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
                PresetName("iiwa/state/joint_states", NameRole.JOINT_STATES, "joint_states", external=True),
                PresetName("iiwa/state/end_effector_pose", NameRole.POSE, "~/pose"),
                PresetName("iiwa/state/end_effector_wrench", NameRole.WRENCH, "~/wrench"),
                PresetName("iiwa/command/stop", NameRole.STOP, "~/stop"),
                PresetName("iiwa/command/joint", NameRole.JOINT, "~/command/joint"),
                PresetName("iiwa/command/cartesian", NameRole.CARTESIAN, "~/command/pose"),
                PresetName(
                    "iiwa_controller/follow_joint_trajectory", NameRole.FOLLOW, "~/follow_joint_trajectory"
                ),
            ),
        ),
        "iiwa_stack": Preset(
            _iiwa("iiwa_link_ee"),
            (
                PresetName("iiwa/joint_states", NameRole.JOINT_STATES, "joint_states"),
                PresetName(f"{_CONTROLLER}/command", NameRole.TRAJECTORY, "~/joint_trajectory"),
                PresetName(
                    f"{_CONTROLLER}/follow_joint_trajectory", NameRole.FOLLOW, "~/follow_joint_trajectory"
                ),
            ),
        ),
    }
)
