"""Names of other drivers' topics and actions, for programs written for those: the nodes' parameter `names`.

They are offered besides heptarm's own. The types of some are in packages of that driver, which may be missing: then
only the others are offered. The defaults of a preset apply where a parameter is not set, and a node offers each entry
by its role::

    preset = PRESETS[values["names"]]
    values = preset.defaults | values
    for entry in preset.entries:
        ...                                       # a publisher, subscriber or action server by entry.role
"""

from __future__ import annotations

import importlib.util
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
    SERVICE = auto()
    STAMPED_WRENCH = auto()
    LBR_STATE = auto()
    LBR_POSITION = auto()
    LBR_TORQUE = auto()
    LBR_WRENCH = auto()
    FORWARD = auto()


_TYPES = {
    NameRole.JOINT_STATES: "sensor_msgs/JointState",
    NameRole.POSE: "geometry_msgs/Pose",
    NameRole.WRENCH: "geometry_msgs/Wrench",
    NameRole.STOP: "std_msgs/Empty",
    NameRole.JOINT: "sensor_msgs/JointState",
    NameRole.CARTESIAN: "geometry_msgs/Pose",
    NameRole.TRAJECTORY: "trajectory_msgs/JointTrajectory",
    NameRole.FOLLOW: "control_msgs/FollowJointTrajectory",
    NameRole.STAMPED_WRENCH: "geometry_msgs/WrenchStamped",
    NameRole.LBR_STATE: "lbr_fri_idl/LBRState",
    NameRole.LBR_POSITION: "lbr_fri_idl/LBRJointPositionCommand",
    NameRole.LBR_TORQUE: "lbr_fri_idl/LBRTorqueCommand",
    NameRole.LBR_WRENCH: "lbr_fri_idl/LBRWrenchCommand",
    NameRole.FORWARD: "std_msgs/Float64MultiArray",
}
#: Roles that the node publishes; it subscribes to the others or serves them.
_PUBLISHED = (
    NameRole.JOINT_STATES,
    NameRole.POSE,
    NameRole.WRENCH,
    NameRole.STAMPED_WRENCH,
    NameRole.LBR_STATE,
)


@dataclass(frozen=True, slots=True)
class PresetName:
    """A topic, a service or an action of another driver.

    Attributes:
        name: relative to the node's namespace.
        role: what it is for.
        native: heptarm's own name for it, "~/" for the node's.
        external: the efforts of its joint states are external torques, not measured ones.
        service: type of a service, as "package/Type".
    """

    name: str
    role: NameRole
    native: str
    external: bool = False
    service: str = ""

    @property
    def type(self) -> str:
        """Its type, as "package/Type"."""
        return self.service or _TYPES[self.role]

    @property
    def is_available(self) -> bool:
        """Whether the package of its type is installed."""
        return importlib.util.find_spec(self.type.partition("/")[0]) is not None

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
        """Its topics that the node publishes, of those whose types are installed."""
        return tuple(entry for entry in self.entries if entry.is_published and entry.is_available)

    def missing(self) -> tuple[str, ...]:
        """Packages of types that are not installed."""
        return tuple(
            sorted({entry.type.partition("/")[0] for entry in self.entries if not entry.is_available})
        )


def _iiwa(flange: str) -> Mapping[str, object]:
    return MappingProxyType(
        {
            "joint_names": [f"iiwa_joint_{i}" for i in range(1, 8)],
            "base_frame": "iiwa_link_0",
            "flange_frame": flange,
        }
    )


def _libiiwa(kind: str, native: str, *names: str) -> tuple[PresetName, ...]:
    """Services of libiiwa of one type."""
    return tuple(
        PresetName(f"iiwa/{name}", NameRole.SERVICE, native, service=f"libiiwa_msgs/{kind}") for name in names
    )


_CARTESIAN = "~/mode/cartesian_impedance"
_LIBIIWA_SERVICES = (
    *_libiiwa("GetError", "~/status", "last_error"),
    *_libiiwa("GetBool", "~/status", "is_ready_to_move"),
    *_libiiwa("GetBool", "~/state", "has_fired_condition", "has_active_motion"),
    *_libiiwa("SetString", "~/servo/joint", "set_control_interface"),
    *_libiiwa("SetString", "~/command/lin", "set_motion_type"),
    *_libiiwa("SetString", "~/command/joint", "set_execution_type"),
    *_libiiwa("SetString", "joint_states", "set_communication_mode"),
    *_libiiwa("SetString", "~/mode/position", "set_control_mode"),
    *_libiiwa(
        "SetNumber",
        "~/run_program",
        "set_desired_joint_velocity_rel",
        "set_desired_joint_acceleration_rel",
        "set_desired_joint_jerk_rel",
        "set_desired_cartesian_velocity",
        "set_desired_cartesian_acceleration",
        "set_desired_cartesian_jerk",
    ),
    *_libiiwa("SetArray", "~/mode/joint_impedance", "set_joint_stiffness", "set_joint_damping"),
    *_libiiwa(
        "SetXYZABCParam",
        _CARTESIAN,
        "set_cartesian_stiffness",
        "set_cartesian_damping",
        "set_cartesian_max_control_force",
    ),
    *_libiiwa(
        "SetXYZABC",
        _CARTESIAN,
        "set_cartesian_additional_control_force",
        "set_cartesian_max_velocity",
        "set_cartesian_max_path_deviation",
    ),
    *_libiiwa("SetArray", "~/set_guard", "set_force_condition", "set_joint_torque_condition"),
    PresetName("iiwa/reset_conditions", NameRole.SERVICE, "~/set_guard", service="std_srvs/Empty"),
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
                *_LIBIIWA_SERVICES,
            ),
        ),
        "lbr_stack": Preset(
            MappingProxyType(
                {
                    "joint_names": [f"lbr_A{i}" for i in range(1, 8)],
                    "base_frame": "lbr_link_0",
                    "flange_frame": "lbr_link_ee",
                }
            ),
            (
                PresetName("lbr/joint_states", NameRole.JOINT_STATES, "joint_states"),
                PresetName("lbr/state", NameRole.LBR_STATE, "~/state"),
                PresetName("lbr/force_torque_broadcaster/wrench", NameRole.STAMPED_WRENCH, "~/wrench"),
                PresetName("lbr/command/joint_position", NameRole.LBR_POSITION, "~/joint_trajectory"),
                PresetName("lbr/command/torque", NameRole.LBR_TORQUE, "~/fri/joint"),
                PresetName("lbr/command/wrench", NameRole.LBR_WRENCH, "~/fri/wrench"),
                PresetName(
                    "lbr/forward_position_controller/commands",
                    NameRole.FORWARD,
                    "forward_position_controller/commands",
                ),
                PresetName(
                    "lbr/joint_trajectory_controller/joint_trajectory",
                    NameRole.TRAJECTORY,
                    "~/joint_trajectory",
                ),
                PresetName(
                    "lbr/joint_trajectory_controller/follow_joint_trajectory",
                    NameRole.FOLLOW,
                    "~/follow_joint_trajectory",
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
