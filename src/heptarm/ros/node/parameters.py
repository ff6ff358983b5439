"""The nodes' parameters: one table for both, so that a YAML file for ROS 2 reads the same in ROS 1."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from heptarm.bridge.check import Rules
from heptarm.bridge.fri_execution import FriOptions
from heptarm.bridge.runner import Settings
from heptarm.bridge.servo_execution import ServoOptions
from heptarm.bridge.tolerance import Bounds, Tolerances
from heptarm.errors import CommandRejected, ShapeError
from heptarm.values.arrays import frozen, within

Plain = str | bool | int | float | list[str]


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a node.

    Attributes:
        name: with dots; ROS 1 has slashes instead.
        default: its type is the parameter's.
        text: what it means.
        low: smallest number.
        high: largest number.
        choices: legal texts; empty: any.
        fixed: it counts from the next configuration on; the others count at once.
    """

    name: str
    default: Plain
    text: str
    low: float = 0.0
    high: float = 0.0
    choices: tuple[str, ...] = ()
    fixed: bool = True

    def check(self, value: Any) -> Plain:
        """The value, if it is one of this parameter; an integer may stand for a number.

        Raises:
            CommandRejected: it is not; the text says what is allowed.
        """
        if isinstance(self.default, float):
            return within(value, self.name, self.low, self.high)
        if isinstance(self.default, list):
            if isinstance(value, (list, tuple)) and all(isinstance(entry, str) for entry in value):
                return list(value)
            raise ShapeError(f"{self.name} is {value!r}; a list of texts is wanted", parameter=self.name)
        if type(value) is not type(self.default):
            wanted = type(self.default).__name__
            raise ShapeError(f"{self.name} is {value!r}; a {wanted} is wanted", parameter=self.name)
        if self.choices and value not in self.choices:
            raise CommandRejected(
                f"{self.name} is {value!r}; allowed are {', '.join(map(repr, self.choices))}",
                parameter=self.name,
                value=value,
            )
        checked: Plain = value
        return checked


def _live(name: str, default: Plain, text: str, low: float = 0.0, high: float = 0.0) -> Parameter:
    return Parameter(name, default, text, low, high, fixed=False)


#: All parameters but those of single joints.
PARAMETERS = (
    Parameter("target", "", 'what to connect to, as in heptarm.connect; "": the variable HEPTARM_TARGET'),
    Parameter("key", "", "pre-shared key of the cabinet, if it has one"),
    Parameter("watchdog", 1.0, "the cabinet stops the arm if this node is silent for so long [s]", 0.1, 10.0),
    Parameter("autostart", True, "configure and activate by itself, again and again until it works"),
    Parameter("prefix", "", "before the names of joints and frames, for several arms in one scene"),
    Parameter(
        "joint_names", [f"A{i}" for i in range(1, 8)], "names of the joints from the base on, without prefix"
    ),
    Parameter("base_frame", "link_0", "name of the base's frame, without prefix"),
    Parameter("flange_frame", "flange", "name of the flange's frame, without prefix"),
    Parameter(
        "names", "heptarm", "names of topics and services", choices=("heptarm", "libiiwa", "iiwa_stack")
    ),
    Parameter("state_rate", 100.0, "states published per second [Hz]", 1.0, 500.0),
    Parameter("publish_signals", False, "have the cabinet send its signals, and publish them"),
    Parameter("publish_tf", False, "publish flange and tool on /tf; leave that to robot_state_publisher if it runs"),
    Parameter("tool_frame", "tool", "name of the frame that motions move, for /tf, without prefix"),
    Parameter("diagnostics_rate", 1.0, "diagnostics published per second [Hz]", 0.1, 10.0),
    Parameter("action_monitor_rate", 20.0, "feedback of a trajectory per second [Hz]", 1.0, 500.0),
    Parameter("execution", "servo", "how trajectories are executed", choices=("servo", "spline", "fri")),
    Parameter("servo.rate", 100.0, "targets per second [Hz]", 1.0, 500.0),
    Parameter("servo.watchdog", 0.2, "the cabinet brakes if no target comes for so long [s]", 0.005, 2.0),
    Parameter(
        "servo.engine",
        "direct",
        "who smooths a trajectory: direct follows it closely, smart limits its jerk and lags where it bends",
        choices=("direct", "smart"),
    ),
    Parameter("servo.horizon", 0.1, "so far ahead on the tangent lies a target of direct [s]", 0.02, 1.0),
    Parameter("servo.speed", 1.0, "ceiling of the speed, a fraction of each axis' maximum", 0.01, 1.0),
    Parameter("servo.acceleration", 1.0, "ceiling of the acceleration, likewise", 0.01, 1.0),
    Parameter("servo.line_speed", 0.25, "largest speed of servo/lin along each axis of the base [m/s]", 0.001, 10.0),
    Parameter("servo.linger", 0.5, "how long the servo motion stays open after a goal [s]", 0.0, 60.0),
    Parameter("servo.lookahead", 0.004, "how long a target takes to become motion [s]", 0.0, 0.5),
    Parameter("fri.period", 5.0, "time between two messages of FRI, whole milliseconds [ms]", 1.0, 10.0),
    Parameter(
        "fri.host", "", 'address at which the cabinet reaches this machine; "": as the connection does'
    ),
    Parameter("fri.linger", 2.0, "how long the FRI session stays open after a goal [s]", 0.0, 60.0),
    Parameter(
        "fri.lookahead", 0.0, "how long a command takes to become motion, beyond a period [s]", 0.0, 0.5
    ),
    Parameter(
        "command_timeout",
        0.2,
        "the arm brakes if no message comes on a servo topic for so long [s]",
        0.02,
        2.0,
    ),
    Parameter(
        "speed", 0.2, "ceiling of the speed of commanded motions, a fraction of each axis' maximum", 0.01, 1.0
    ),
    _live("allow_partial_joints_goal", False, "a goal may leave joints out; they hold"),
    _live("allow_nonzero_velocity_at_trajectory_end", False, "a goal's last point may have a velocity"),
    _live(
        "start_tolerance",
        0.05,
        "how far from the arm a trajectory may begin that begins at once [rad]",
        0.0,
        3.0,
    ),
    _live(
        "constraints.goal_time",
        2.0,
        "how long after its end a goal may take to arrive [s]; 0: for ever",
        0.0,
        1e6,
    ),
    _live(
        "constraints.stopped_velocity_tolerance",
        0.02,
        "speed that counts as arrived [rad/s]; 0: any",
        0.0,
        10.0,
    ),
    _live("max_deceleration_on_cancel", 2.0, "how hard a cancelled goal brakes [rad/s²]", 0.1, 10.0),
)


def of_joints(joints: Sequence[str]) -> Iterator[Parameter]:
    """The parameters of single joints, by their names without prefix."""
    for joint in joints:
        yield _live(f"constraints.{joint}.trajectory", 0.0, "farthest off the path [rad]; 0: any", 0.0, 10.0)
        yield _live(f"constraints.{joint}.goal", 0.01, "farthest off the goal [rad]; 0: any", 0.0, 10.0)


@dataclass(frozen=True, slots=True)
class Configuration:
    """What the parameters say, checked.

    Attributes:
        values: all of them by name.
        joints: names of the joints with prefix, seven.
    """

    values: Mapping[str, Any]
    joints: tuple[str, ...]

    @staticmethod
    def of(values: Mapping[str, object]) -> Configuration:
        """From values by name; what is missing has its default.

        Raises:
            CommandRejected: a value is not legal, or its name is unknown.
        """
        table = {parameter.name: parameter for parameter in PARAMETERS}
        names = table["joint_names"].check(values.get("joint_names", table["joint_names"].default))
        assert isinstance(names, list)
        if len(names) != 7 or len(set(names)) != 7:
            raise ShapeError(
                f"joint_names has {len(set(names))} different names; seven are wanted",
                parameter="joint_names",
            )
        table.update({parameter.name: parameter for parameter in of_joints(names)})
        for name in values:
            if name not in table:
                raise CommandRejected(f"there is no parameter {name!r}", parameter=name)
        known = {name: one.check(values.get(name, one.default)) for name, one in table.items()}
        return Configuration(known, tuple(f"{known['prefix']}{name}" for name in names))

    def frame(self, which: str) -> str:
        """A frame's name with prefix: "base", "flange" or "tool"."""
        return f"{self.values['prefix']}{self.values[f'{which}_frame']}"

    @property
    def settings(self) -> Settings:
        """How goals are run."""
        v = self.values
        joints = v["joint_names"]
        path = frozen(np.array([v[f"constraints.{joint}.trajectory"] for joint in joints]))
        goal = frozen(np.array([v[f"constraints.{joint}.goal"] for joint in joints]))
        still = frozen(np.full(7, v["constraints.stopped_velocity_tolerance"]))
        return Settings(
            rules=Rules(
                partial=v["allow_partial_joints_goal"],
                moving_end=v["allow_nonzero_velocity_at_trajectory_end"],
                jump=v["start_tolerance"],
                speed=v["servo.speed"],
            ),
            tolerances=Tolerances(
                Bounds(position=path), Bounds(position=goal, velocity=still), v["constraints.goal_time"]
            ),
            deceleration=frozen(np.full(7, v["max_deceleration_on_cancel"])),
            lookahead=v["fri.lookahead" if v["execution"] == "fri" else "servo.lookahead"],
        )

    @property
    def servo(self) -> ServoOptions:
        """How trajectories are streamed."""
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
        """How trajectories are commanded over FRI."""
        v = self.values
        return FriOptions(period=round(v["fri.period"]), host=v["fri.host"], linger=v["fri.linger"])
