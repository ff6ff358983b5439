"""Parameters of the nodes: one table for both, so that YAML files have the same names in ROS 1 and ROS 2."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from types import MappingProxyType
from typing import Any

import numpy as np

from heptarm.arm.link.target import parse_target
from heptarm.arm.watchdog import ROS_NODE, TARGETS
from heptarm.errors import CommandRejected, ShapeError
from heptarm.ros.trajectory.check import GoalRules
from heptarm.ros.trajectory.fri_execution import FriOptions
from heptarm.ros.trajectory.runner import ExecutionSettings
from heptarm.ros.trajectory.servo_execution import ServoOptions
from heptarm.ros.trajectory.tolerances import StateTolerances, TrajectoryTolerances
from heptarm.skills.gripper import PATIENCE, SETTLE
from heptarm.values.checks import Array, frozen, within
from heptarm.values.sealed import meant

#: Names of the joints, from the base to the flange, in versions of the drivers that the parameter `names` selects:
#: messages may have any of them. lbr_stack's have the name of the robot before them, or not.
SPELLINGS: Mapping[str, tuple[tuple[str, ...], ...]] = MappingProxyType(
    {"lbr_stack": tuple(tuple(f"{robot}A{i}" for i in range(1, 8)) for robot in ("lbr_", ""))}
)

Plain = str | bool | int | float | list[str]


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a node.

    Attributes:
        name: with dots; ROS 1 uses slashes instead.
        default: also sets the type.
        text: description.
        low: least number.
        high: greatest number.
        choices: allowed texts; empty: any.
        fixed: a change needs a new configuration of the node; otherwise it applies at once.
    """

    name: str
    default: Plain
    text: str
    low: float = 0.0
    high: float = 0.0
    choices: tuple[str, ...] = ()
    fixed: bool = True

    def check(self, value: Any) -> Plain:
        """Check a value; an integer is accepted for a number.

        Raises:
            CommandRejected: wrong type, or out of range.
        """
        if isinstance(self.default, float):
            return within(value, self.name, self.low, self.high)
        if isinstance(self.default, list):
            if isinstance(value, (list, tuple)) and all(isinstance(entry, str) for entry in value):
                return list(value)
            raise ShapeError(f"{self.name} must be a list of strings, got {value!r}", parameter=self.name)
        if type(value) is not type(self.default):
            kind = type(self.default).__name__
            raise ShapeError(f"{self.name} must be a {kind}, got {value!r}", parameter=self.name)
        if self.choices and value not in self.choices:
            raise CommandRejected(
                f"{self.name} must be one of {', '.join(map(repr, self.choices))}, got {value!r}",
                parameter=self.name,
                value=value,
            )
        checked: Plain = value
        return checked


def _live(name: str, default: Plain, text: str, low: float = 0.0, high: float = 0.0) -> Parameter:
    return Parameter(name, default, text, low, high, fixed=False)


#: All parameters except those of single joints.
PARAMETERS = (
    Parameter(
        "target",
        "",
        'target of the connection, as in heptarm.connect; "": the environment variable HEPTARM_TARGET',
    ),
    Parameter(
        "flange",
        "",
        'media flange of the robot: "plain", "touch", or its height above a plain one [m]; "": that of the target, or '
        "plain",
    ),
    Parameter(
        "key_file",
        "",
        'file with the pre-shared key of the cabinet; "": HEPTARM_KEY, or the key stored for the target',
    ),
    Parameter(
        "watchdog",
        ROS_NODE.default,
        "the cabinet stops the arm after this time without a message of the node [s]",
        ROS_NODE.low,
        ROS_NODE.high,
    ),
    Parameter(
        "datagrams",
        False,
        "send servo targets and receive states by UDP beside the TCP connection, for networks that lose packets; what "
        "does not get through goes over TCP",
    ),
    Parameter("autostart", True, "configure and activate automatically, retrying until it works"),
    Parameter("prefix", "", "prefix of the names of joints and frames, for several arms in one scene"),
    Parameter(
        "joint_names",
        [f"A{i}" for i in range(1, 8)],
        "names of the joints, from the base to the flange, without prefix",
    ),
    Parameter("base_frame", "link_0", "name of the base frame, without prefix"),
    Parameter("flange_frame", "flange", "name of the flange frame, without prefix"),
    Parameter(
        "names",
        "heptarm",
        "whose names of topics, services and actions to offer besides heptarm's own",
        choices=("heptarm", "libiiwa", "iiwa_stack", "lbr_stack"),
    ),
    Parameter(
        "forward_controllers",
        True,
        "follow forward_position_controller/commands and forward_velocity_controller/commands; false: ros2_control "
        "has controllers of these names",
    ),
    Parameter("state_rate", 100.0, "rate of published states [Hz]", 1.0, 500.0),
    Parameter("publish_signals", False, "publish the signals of the cabinet"),
    Parameter("publish_tf", False, "publish flange and tool on /tf; not needed with robot_state_publisher"),
    Parameter("tf_frames", False, "accept poses in every frame that /tf connects with the base"),
    Parameter("tool_frame", "tool", "name of the motion frame (the TCP of the tool) on /tf, without prefix"),
    Parameter("diagnostics_rate", 1.0, "rate of diagnostics [Hz]", 0.1, 10.0),
    Parameter("action_monitor_rate", 20.0, "rate of trajectory feedback [Hz]", 1.0, 500.0),
    Parameter("execution", "servo", "how trajectories are executed", choices=("servo", "spline", "fri")),
    Parameter("servo.rate", 100.0, "rate of targets [Hz]", 1.0, 500.0),
    Parameter(
        "servo.watchdog",
        ServoOptions().watchdog,
        "the cabinet brakes the arm after this time without a target [s]",
        TARGETS.low,
        TARGETS.high,
    ),
    Parameter(
        "servo.engine",
        "direct",
        "servo engine: direct follows a trajectory closely, smart limits the jerk and lags where the trajectory bends",
        choices=("direct", "smart"),
    ),
    Parameter(
        "servo.horizon",
        0.1,
        "time constant of the engine direct, and how far ahead on the tangent its targets are [s]",
        0.02,
        1.0,
    ),
    Parameter("servo.speed", 1.0, "speed limit of trajectories, a fraction of each axis' maximum", 0.01, 1.0),
    Parameter(
        "servo.acceleration",
        1.0,
        "acceleration limit of trajectories, a fraction of each axis' maximum",
        0.01,
        1.0,
    ),
    Parameter(
        "servo.min_trajectory_time",
        0.13,
        "shortest trajectory to a target without a velocity on servo/joint and servo/pose: shorter gaps between "
        "messages do not show in the speed, and the arm lags by about two thirds of it [s]",
        0.001,
        1.0,
    ),
    Parameter(
        "servo.line_speed",
        0.25,
        "speed limit of servo/lin along each axis of the base, and of servo/twist [m/s]",
        0.001,
        10.0,
    ),
    Parameter("servo.turn_speed", 0.5, "angular speed limit of servo/twist [rad/s]", 0.001, 20.0),
    Parameter(
        "servo.elbow",
        "keep",
        "what the elbow does in servo/twist and servo/pose: keep its angle, or keep the joints away from their limits",
        choices=("keep", "center"),
    ),
    Parameter(
        "servo.posture",
        "",
        "joint positions that the elbow follows in servo/twist and servo/pose instead of servo.elbow, seven numbers "
        'with blanks between them [rad]; "": none',
    ),
    Parameter("servo.linger", 0.5, "how long the servo motion stays open after a goal [s]", 0.0, 60.0),
    Parameter(
        "servo.lookahead", 0.004, "delay from a target to its motion, which is compensated [s]", 0.0, 0.5
    ),
    Parameter("fri.period", 5.0, "send period of FRI, whole milliseconds [ms]", 1.0, 10.0),
    Parameter(
        "fri.host", "", 'address of this machine as the cabinet reaches it; "": that of the connection'
    ),
    Parameter("fri.linger", 2.0, "how long the FRI session stays open after a goal [s]", 0.0, 60.0),
    Parameter(
        "fri.lookahead",
        0.0,
        "delay from a command to its motion in excess of one period, which is compensated [s]",
        0.0,
        0.5,
    ),
    Parameter(
        "command_timeout",
        0.2,
        "the arm brakes after this time without a message on a servo topic [s]",
        0.02,
        2.0,
    ),
    Parameter("speed", 0.2, "speed limit of commanded motions, a fraction of each axis' maximum", 0.01, 1.0),
    Parameter("gripper.open", "", 'output that opens the gripper of ~/gripper_cmd; "": there is no gripper'),
    Parameter("gripper.close", "", "output that closes it"),
    Parameter("gripper.is_open", "", "input of the switch at its open end"),
    Parameter("gripper.is_closed", "", "input of the switch at its closed end: nothing between the fingers"),
    Parameter("gripper.holds", "", 'input that is on while it holds something; "": there is none'),
    Parameter("gripper.width", 0.1, "position of the open gripper in goals and results [m]", 0.001, 1.0),
    Parameter("gripper.timeout", PATIENCE, "longest time for opening or closing it [s]", 0.1, 600.0),
    Parameter(
        "gripper.settle",
        SETTLE,
        "time with neither switch on before it counts as closed on something [s]",
        0.0,
        600.0,
    ),
    Parameter(
        "planning.scene",
        "",
        'bodies around which paths are planned, besides those of messages: a ready scene, or a file (MJCF); "": none',
    ),
    Parameter("planning.margin", 0.005, "bodies nearer than this count as touching [m]", 0.0, 0.1),
    Parameter(
        "moveit",
        False,
        "offer the services and actions of MoveIt's move_group, for programs that are written for it; not beside one",
    ),
    _live("allow_partial_joints_goal", False, "accept goals that lack joints; these hold their positions"),
    _live("allow_nonzero_velocity_at_trajectory_end", False, "accept goals whose last point has a velocity"),
    _live(
        "allow_integration_in_goal_trajectories",
        False,
        "accept points without positions, which are integrated from velocities or accelerations",
    ),
    _live(
        "cmd_timeout",
        0.0,
        "how long after its end any trajectory may take to reach the goal [s]; it counts if longer than "
        "constraints.goal_time; 0: no limit",
        0.0,
        1e6,
    ),
    _live(
        "start_tolerance",
        0.05,
        "largest distance from the arm to a first point at time 0 [rad]",
        0.0,
        3.0,
    ),
    _live(
        "constraints.goal_time",
        2.0,
        "how long after its end a trajectory may take to reach the goal [s]; 0: no limit",
        0.0,
        1e6,
    ),
    _live(
        "constraints.stopped_velocity_tolerance",
        0.02,
        "goal tolerance of the velocity [rad/s]; 0: not enforced",
        0.0,
        10.0,
    ),
    _live("max_deceleration_on_cancel", 2.0, "deceleration of a cancelled goal [rad/s²]", 0.1, 10.0),
)


def check_joint_names(names: Sequence[str]) -> None:
    """Check the parameter `joint_names`.

    Raises:
        ShapeError: not seven different names.
    """
    if len(names) != 7 or len(set(names)) != 7:
        raise ShapeError(
            f"joint_names must have seven different names, got {', '.join(names) or 'none'}",
            parameter="joint_names",
        )


def joint_parameters(joints: Sequence[str]) -> Iterator[Parameter]:
    """Make the parameters of single joints, by their names without prefix."""
    for joint in joints:
        yield _live(
            f"constraints.{joint}.trajectory", 0.0, "path tolerance [rad]; 0: not enforced", 0.0, 10.0
        )
        yield _live(f"constraints.{joint}.goal", 0.01, "goal tolerance [rad]; 0: not enforced", 0.0, 10.0)


def unknown_text(unknown: Sequence[str], known: Iterable[str]) -> str:
    """A warning that names parameters which no node has, with what they may have been meant to be."""
    names = list(known)
    return "unknown parameters: " + "; ".join(
        f"{name}: {question}" if (question := meant(name, names)) else name for name in unknown
    )


@dataclass(frozen=True, slots=True)
class NodeConfiguration:
    """Checked values of all parameters.

    Attributes:
        values: by name of the parameter.
        joints: names of the seven joints with prefix.
    """

    values: Mapping[str, Any]
    joints: tuple[str, ...]

    @staticmethod
    def of(values: Mapping[str, object]) -> NodeConfiguration:
        """Check values by name; missing ones get their defaults.

        Raises:
            CommandRejected: a value is not allowed, or its name is unknown.
            ConnectFailed: the target has none of the forms of `heptarm.connect`.
        """
        table = {parameter.name: parameter for parameter in PARAMETERS}
        names = table["joint_names"].check(values.get("joint_names", table["joint_names"].default))
        assert isinstance(names, list)
        check_joint_names(names)
        table.update({parameter.name: parameter for parameter in joint_parameters(names)})
        for name in values:
            if name not in table:
                raise CommandRejected(f"unknown parameter {name!r}", parameter=name, hint=meant(name, table))
        known = {
            name: parameter.check(values.get(name, parameter.default)) for name, parameter in table.items()
        }
        made = NodeConfiguration(known, tuple(f"{known['prefix']}{name}" for name in names))
        _ = made.posture  # refused here, not with the first target
        if known["target"]:
            parse_target(str(known["target"]))  # what no attempt to connect mends
        return made

    def own(self, names: Iterable[str]) -> tuple[str, ...]:
        """Replace names of joints in other versions of the driver that `names` selects by the node's own.

        Args:
            names: of joints in a message; unknown ones stay as they are.
        """
        others = {
            name: own
            for spelling in SPELLINGS.get(self.values["names"], ())
            for name, own in zip(spelling, self.joints)
            if name not in self.joints
        }
        return tuple(others.get(name, name) for name in names)

    @property
    def posture(self) -> Array | None:
        """What the elbow follows in servo topics, shape (7,) [rad]; None: `servo.elbow` decides.

        Raises:
            ShapeError: not seven numbers.
        """
        text: str = self.values["servo.posture"]
        try:
            numbers = [float(word) for word in text.split()]
        except ValueError:
            numbers = [nan]
        if numbers and (len(numbers) != 7 or not all(map(isfinite, numbers))):
            raise ShapeError(
                f'servo.posture must be "" or seven numbers with blanks between them [rad], got {text!r}',
                parameter="servo.posture",
                value=text,
            )
        return frozen(np.array(numbers)) if numbers else None

    def frame(self, which: str) -> str:
        """Look up the name of a frame with prefix: "base", "flange" or "tool"."""
        return f"{self.values['prefix']}{self.values[f'{which}_frame']}"

    @property
    def links(self) -> tuple[str, str]:
        """Names of the links with prefix to which poses of MoveIt refer: of the flange and of the tool."""
        return self.frame("flange"), self.frame("tool")

    @property
    def settings(self) -> ExecutionSettings:
        """How goals are executed."""
        v = self.values
        joints = v["joint_names"]
        path = frozen(np.array([v[f"constraints.{joint}.trajectory"] for joint in joints]))
        goal = frozen(np.array([v[f"constraints.{joint}.goal"] for joint in joints]))
        still = frozen(np.full(7, v["constraints.stopped_velocity_tolerance"]))
        return ExecutionSettings(
            rules=GoalRules(
                partial=v["allow_partial_joints_goal"],
                moving_end=v["allow_nonzero_velocity_at_trajectory_end"],
                integrate=v["allow_integration_in_goal_trajectories"],
                jump=v["start_tolerance"],
                speed=v["servo.speed"],
            ),
            tolerances=TrajectoryTolerances(
                StateTolerances(position=path),
                StateTolerances(position=goal, velocity=still),
                v["constraints.goal_time"],
                v["cmd_timeout"] if v["cmd_timeout"] > v["constraints.goal_time"] else 0.0,
            ),
            deceleration=frozen(np.full(7, v["max_deceleration_on_cancel"])),
            lookahead=v["fri.lookahead" if v["execution"] == "fri" else "servo.lookahead"],
        )

    @property
    def servo(self) -> ServoOptions:
        """Options of the execution `servo`."""
        v = self.values
        return ServoOptions(
            rate=v["servo.rate"],
            watchdog=v["servo.watchdog"],
            engine=v["servo.engine"],
            horizon=v["servo.horizon"],
            speed=v["servo.speed"],
            acceleration=v["servo.acceleration"],
            linger=v["servo.linger"],
        )

    @property
    def fri(self) -> FriOptions:
        """Options of the execution `fri`."""
        v = self.values
        return FriOptions(period=round(v["fri.period"]), host=v["fri.host"], linger=v["fri.linger"])
