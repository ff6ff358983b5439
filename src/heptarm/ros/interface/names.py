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

from heptarm.ros.node.parameters import SPELLINGS


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
    OWN_STATE = auto()
    OWN_COMMAND = auto()
    ACTION = auto()
    ARRIVED = auto()
    KEY = auto()
    CONTROLLER_STATE = auto()


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
    NameRole.ARRIVED: "std_msgs/Time",
    NameRole.KEY: "std_msgs/String",
    NameRole.CONTROLLER_STATE: "control_msgs/JointTrajectoryControllerState",
}
#: Roles that the node publishes with each state.
_PUBLISHED = (
    NameRole.JOINT_STATES,
    NameRole.POSE,
    NameRole.WRENCH,
    NameRole.STAMPED_WRENCH,
    NameRole.LBR_STATE,
    NameRole.OWN_STATE,
)
#: Roles that the node publishes when something happens; it subscribes to the others or serves them.
_EVENTS = (NameRole.ARRIVED, NameRole.KEY)


@dataclass(frozen=True, slots=True)
class PresetName:
    """A topic, a service or an action of another driver.

    Attributes:
        name: relative to the node's namespace.
        role: what it is for.
        native: heptarm's own name for it, "~/" for the node's.
        external: its torques are external ones, not measured ones.
        own_type: its type where the role alone does not give it, as "package/Type".
        needs: a package of the other driver without which it is of no use, though its type is in another one.
    """

    name: str
    role: NameRole
    native: str
    external: bool = False
    own_type: str = ""
    needs: str = ""

    @property
    def type(self) -> str:
        """Its type, as "package/Type"."""
        return self.own_type or _TYPES[self.role]

    @property
    def last(self) -> str:
        """The last part of its name."""
        return self.name.rpartition("/")[2]

    @property
    def package(self) -> str:
        """The package that has to be installed for it."""
        return self.needs or self.type.partition("/")[0]

    @property
    def is_available(self) -> bool:
        """Whether the package of its type is installed."""
        return importlib.util.find_spec(self.package) is not None

    @property
    def is_published(self) -> bool:
        """Whether the node publishes it with each state."""
        return self.role in _PUBLISHED

    @property
    def is_event(self) -> bool:
        """Whether the node publishes it when something happens."""
        return self.role in _EVENTS


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

    def events(self) -> tuple[PresetName, ...]:
        """Its topics that the node publishes when something happens, of those whose types are installed."""
        return tuple(entry for entry in self.entries if entry.is_event and entry.is_available)

    def controller_states(self) -> tuple[str, ...]:
        """Names of its topics of the trajectory controller's state."""
        return tuple(entry.name for entry in self.entries if entry.role is NameRole.CONTROLLER_STATE)

    def missing(self) -> tuple[str, ...]:
        """Packages of types that are not installed."""
        return tuple(sorted({entry.package for entry in self.entries if not entry.is_available}))


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
        PresetName(f"iiwa/{name}", NameRole.SERVICE, native, own_type=f"libiiwa_msgs/{kind}")
        for name in names
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
    PresetName("iiwa/reset_conditions", NameRole.SERVICE, "~/set_guard", own_type="std_srvs/Empty"),
)
_CONTROLLER = "iiwa/PositionJointInterface_trajectory_controller"


def _iiwa_stack(
    role: NameRole, native: str, kind: str, *names: str, external: bool = False
) -> tuple[PresetName, ...]:
    """Topics, services or actions of iiwa_stack of one type."""
    given = kind if "/" in kind else f"iiwa_msgs/{kind}"
    return tuple(
        PresetName(f"iiwa/{name}", role, native, external=external, own_type=given, needs="iiwa_msgs")
        for name in names
    )


#: With its newest types; older releases, in which state/CartesianPose is a PoseStamped, have others.
_IIWA_STACK = (
    *_iiwa_stack(NameRole.OWN_STATE, "~/pose", "CartesianPose", "state/CartesianPose"),
    *_iiwa_stack(NameRole.OWN_STATE, "~/wrench", "CartesianWrench", "state/CartesianWrench"),
    *_iiwa_stack(NameRole.OWN_STATE, "joint_states", "JointPosition", "state/JointPosition"),
    *_iiwa_stack(NameRole.OWN_STATE, "joint_states", "JointPositionVelocity", "state/JointPositionVelocity"),
    *_iiwa_stack(NameRole.OWN_STATE, "joint_states", "JointVelocity", "state/JointVelocity"),
    *_iiwa_stack(NameRole.OWN_STATE, "joint_states", "JointTorque", "state/JointTorque"),
    *_iiwa_stack(
        NameRole.OWN_STATE, "~/external_torques", "JointTorque", "state/ExternalJointTorque", external=True
    ),
    *_iiwa_stack(NameRole.ARRIVED, "~/state", "std_msgs/Time", "state/DestinationReached"),
    *_iiwa_stack(NameRole.KEY, "~/keys", "std_msgs/String", "state/buttonEvent"),
    *_iiwa_stack(NameRole.OWN_COMMAND, "~/servo/joint", "JointPosition", "command/JointPosition"),
    *_iiwa_stack(
        NameRole.OWN_COMMAND, "~/servo/joint", "JointPositionVelocity", "command/JointPositionVelocity"
    ),
    *_iiwa_stack(NameRole.OWN_COMMAND, "~/servo/velocity", "JointVelocity", "command/JointVelocity"),
    *_iiwa_stack(NameRole.OWN_COMMAND, "~/servo/pose", "geometry_msgs/PoseStamped", "command/CartesianPose"),
    *_iiwa_stack(
        NameRole.OWN_COMMAND, "~/servo/lin", "geometry_msgs/PoseStamped", "command/CartesianPoseLin"
    ),
    *_iiwa_stack(
        NameRole.OWN_COMMAND, "~/servo/twist", "geometry_msgs/TwistStamped", "command/CartesianVelocity"
    ),
    *_iiwa_stack(NameRole.SERVICE, _CARTESIAN, "ConfigureControlMode", "configuration/ConfigureControlMode"),
    *_iiwa_stack(NameRole.SERVICE, "~/set_override", "SetSpeedOverride", "configuration/setSpeedOverride"),
    *_iiwa_stack(
        NameRole.SERVICE,
        "~/servo/joint",
        "SetSmartServoJointSpeedLimits",
        "configuration/setSmartServoLimits",
    ),
    *_iiwa_stack(
        NameRole.SERVICE,
        "~/servo/lin",
        "SetSmartServoLinSpeedLimits",
        "configuration/setSmartServoLinLimits",
    ),
    *_iiwa_stack(NameRole.SERVICE, "~/servo/joint", "SetPathParameters", "configuration/pathParameters"),
    *_iiwa_stack(NameRole.SERVICE, "~/servo/lin", "SetPathParametersLin", "configuration/pathParametersLin"),
    *_iiwa_stack(
        NameRole.SERVICE, "~/move_joints", "SetPTPJointSpeedLimits", "configuration/setPTPJointLimits"
    ),
    *_iiwa_stack(
        NameRole.SERVICE, "~/move_pose", "SetPTPCartesianSpeedLimits", "configuration/setPTPCartesianLimits"
    ),
    *_iiwa_stack(NameRole.SERVICE, "~/move_pose", "SetEndpointFrame", "configuration/setEndpointFrame"),
    *_iiwa_stack(NameRole.SERVICE, "~/attach_workpiece", "SetWorkpiece", "configuration/setWorkpiece"),
    *_iiwa_stack(NameRole.SERVICE, "~/state", "TimeToDestination", "state/timeToDestination"),
    *_iiwa_stack(NameRole.ACTION, "~/move_joints", "MoveToJointPosition", "action/move_to_joint_position"),
    *_iiwa_stack(
        NameRole.ACTION,
        "~/move_pose",
        "MoveToCartesianPose",
        "action/move_to_cartesian_pose",
        "action/move_to_cartesian_pose_lin",
    ),
    *_iiwa_stack(NameRole.ACTION, "~/move_spline", "MoveAlongSpline", "action/move_along_spline"),
)

#: Services by which graphical tools find controllers, and their types.
_CONTROLLER_MANAGER = tuple(
    PresetName(
        f"lbr/controller_manager/{name}",
        NameRole.SERVICE,
        "~/capabilities",
        own_type=f"controller_manager_msgs/{kind}",
    )
    for name, kind in (
        ("list_controllers", "ListControllers"),
        ("list_controller_types", "ListControllerTypes"),
        ("load_controller", "LoadController"),
        ("unload_controller", "UnloadController"),
        ("switch_controller", "SwitchController"),
        ("reload_controller_libraries", "ReloadControllerLibraries"),
    )
)

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
                    "joint_names": list(SPELLINGS["lbr_stack"][0]),
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
                PresetName(
                    "lbr/joint_trajectory_controller/controller_state",
                    NameRole.CONTROLLER_STATE,
                    "~/controller_state",
                ),
                *_CONTROLLER_MANAGER,
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
                *_IIWA_STACK,
            ),
        ),
    }
)
