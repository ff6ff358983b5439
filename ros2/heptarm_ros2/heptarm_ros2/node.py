"""The node: life cycle, parameters, and the connection of the driver to ROS."""

from __future__ import annotations

import importlib.metadata
import threading
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.lifecycle import State as LifecycleState
from rclpy.parameter import Parameter as RosParameter

from heptarm.errors import HeptarmError
from heptarm.fri import State as FriState
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.names import PRESETS, NameRole
from heptarm.ros.node import parameters
from heptarm.ros.node.driver import Driver
from heptarm.ros.node.parameters import NodeConfiguration, Parameter
from heptarm.ros.trajectory.goal import GoalResult
from heptarm.ros.trajectory.runner import GoalFeedback
from heptarm.values.condition.collision import Collision
from heptarm.values.result import MotionEvent
from heptarm.values.state import State
from heptarm_ros2 import convert
from heptarm_ros2.actions import ActionServers
from heptarm_ros2.commands import Commands
from heptarm_ros2.events import EventPublisher
from heptarm_ros2.presets import PresetPublisher
from heptarm_ros2.publishers import StatePublisher, TransformPublisher
from heptarm_ros2.trajectory import TrajectoryAction

#: Pause between two attempts of the autostart [s].
_RETRY = 2.0
#: Names, or their beginnings, of parameters that are not ours.
_OTHERS = ("use_sim_time", "qos_overrides", "start_type_description_service")


class HeptarmNode(LifecycleNode):
    """An LBR iiwa. The transition configure connects and publishes states, activate accepts goals and commands."""

    def __init__(self, name: str = "heptarm", **options: Any) -> None:
        super().__init__(name, **options)
        self.ros = convert.ros(self)
        self.driver: Driver | None = None
        self._states: StatePublisher | None = None
        self._presets: PresetPublisher | None = None
        self._transforms: TransformPublisher | None = None
        self._events: EventPublisher | None = None
        self._commands: Commands | None = None
        self._trajectories: TrajectoryAction | None = None
        self._actions: ActionServers | None = None
        self._ending = threading.Event()
        self._starts = False  # by itself, which it does again
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)  # a simulated clock may stand still, or jump
        for one in sorted(parameters.PARAMETERS, key=lambda one: one.name != "names"):
            self._declare(one)  # `names` first: it selects the defaults of the others
        joints = self.get_parameter("joint_names").value or []
        parameters.check_joint_names(joints)
        for one in parameters.joint_parameters(joints):
            self._declare(one)
        self.configuration = NodeConfiguration.of(self._values())  # what it refuses no retry mends
        self._warn_of_unknown()
        if hasattr(self, "add_pre_set_parameters_callback"):  # Humble refuses an integer for a number
            self.add_pre_set_parameters_callback(self._before_set)
        self.add_on_set_parameters_callback(self._on_set)
        self._start_timer = None
        if self.get_parameter("autostart").value:
            group = MutuallyExclusiveCallbackGroup()
            self._start_timer = self.create_timer(0.05, self._start, callback_group=group, clock=self._steady)

    # ------------------------------------------------------------------------------- parameters

    def _declare(self, one: Parameter) -> None:
        if self.has_parameter("names"):
            preset = PRESETS.get(str(self.get_parameter("names").value), PRESETS["heptarm"])
            one = replace(one, default=preset.defaults.get(one.name, one.default))
        descriptor = ParameterDescriptor(description=one.text)
        if isinstance(one.default, float):
            descriptor.floating_point_range = [FloatingPointRange(from_value=one.low, to_value=one.high)]
        if one.choices:
            descriptor.additional_constraints = f"one of {', '.join(one.choices)}"
        # with a type from the first, rclpy would end the process at `state_rate: 200` in a file
        given = self.declare_parameter(one.name, one.default, ParameterDescriptor(dynamic_typing=True)).value
        self.undeclare_parameter(one.name)
        self.declare_parameter(one.name, one.check(given), descriptor, ignore_override=True)

    def _warn_of_unknown(self) -> None:
        """Name given parameters that the node does not have: rclpy ignores them without a word."""
        known = self._values()
        given = [name for name in self._parameter_overrides if not self.has_parameter(name)]
        unknown = sorted(name for name in given if not name.startswith(_OTHERS))
        if unknown:
            self.get_logger().warning(parameters.unknown_text(unknown, known))

    def _values(self) -> dict[str, object]:
        names = [one.name for one in parameters.PARAMETERS]
        names += [
            one.name for one in parameters.joint_parameters(self.get_parameter("joint_names").value or [])
        ]
        return {name: self.get_parameter(name).value for name in names}

    def _before_set(self, changes: list[RosParameter]) -> list[RosParameter]:
        """Make numbers of the integers that are given for numbers."""
        numbers = {name for name, value in self._values().items() if isinstance(value, float)}
        return [
            RosParameter(one.name, value=float(one.value))
            if one.name in numbers and one.type_ is RosParameter.Type.INTEGER
            else one
            for one in changes
        ]

    def _on_set(self, changes: Sequence[RosParameter]) -> SetParametersResult:
        """Check parameters before they are set, and apply them."""
        known = self._values()
        ours = {change.name: change.value for change in changes if change.name in known}
        if not ours:
            return SetParametersResult(successful=True)
        try:
            configuration = NodeConfiguration.of({**known, **ours})
        except HeptarmError as error:
            return SetParametersResult(successful=False, reason=str(error))
        if self.driver is not None:
            fixed = {one.name for one in parameters.PARAMETERS if one.fixed}
            held = sorted(name for name in ours if name in fixed and ours[name] != known[name])
            if held:
                reason = f"{', '.join(held)} cannot change while the node is configured: clean it up first"
                return SetParametersResult(successful=False, reason=reason)
            self.configuration = configuration
            self.driver.configure(configuration)
        return SetParametersResult(successful=True)

    # ------------------------------------------------------------------------------- life cycle

    def _start(self) -> None:
        """Configure and activate, with retries until it works; after that the user controls the life cycle."""
        assert self._start_timer is not None
        self._start_timer.cancel()
        if self._ending.is_set():
            return
        self._starts = True
        configured = self.driver is not None or self.trigger_configure() is TransitionCallbackReturn.SUCCESS
        self._starts = False
        if not configured:
            self._start_timer.timer_period_ns = round(_RETRY * 1e9)
            self._start_timer.reset()
            return
        self.trigger_activate()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Connect."""
        log = self.get_logger()
        try:
            self.configuration = NodeConfiguration.of(self._values())
            shared = (self, self.ros, self.configuration)
            self._states = StatePublisher(*shared)
            self._presets = PresetPublisher(*shared, fri=self._fri_state)
            self._events = EventPublisher(*shared)
            self.driver = Driver(self.configuration, self, clock=lambda: 1e-9 * self.ros.now())
        except HeptarmError as error:
            waits = f"; wait, the next attempt is in {_RETRY:g} s" if self._starts else ""
            log.error(f"not configured: {error}{waits}")
            self._destroy()
            return TransitionCallbackReturn.FAILURE
        values, arm = self.configuration.values, self.driver.arm
        if values["publish_tf"]:
            self._transforms = TransformPublisher(*shared, arm.robot)
        context = NodeContext(self.driver, self.ros)
        others = PRESETS[values["names"]].actions()
        group = ReentrantCallbackGroup()
        self._trajectories = TrajectoryAction(
            self, self.ros, self.driver, ("~/follow_joint_trajectory", *others), group
        )
        self._actions = ActionServers(self, context, group)
        self._commands = Commands(self, context)
        self._report_timer = self.create_timer(
            1.0 / values["diagnostics_rate"],
            self._report,
            callback_group=MutuallyExclusiveCallbackGroup(),
            clock=self._steady,
        )
        log.info(
            f"heptarm {_version()}, {arm.robot.title}, cabinet {arm.cabinet!r} with software {arm.software}"
        )
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Accept goals and commands."""
        assert self.driver is not None
        self.driver.activate()
        self._report()
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Accept nothing more, and bring the arm to rest."""
        assert self.driver is not None
        self.driver.deactivate()
        self._report()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Disconnect."""
        self._destroy()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Disconnect."""
        self._destroy()
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Disconnect; the node can be configured again."""
        self._destroy()
        return TransitionCallbackReturn.SUCCESS

    def close(self) -> None:
        """Leave the arm at rest, without logging: ROS may be shut down already."""
        self._ending.set()
        if self._commands is not None:
            self._commands.end()
        if self.driver is not None:
            self.driver.close()
            self.driver = None

    def _destroy(self) -> None:
        driver, self.driver = self.driver, None
        if driver is not None:
            driver.close()
            self.destroy_timer(self._report_timer)
        for one in (self._trajectories, self._actions, self._commands, *self._state_publishers, self._events):
            if one is not None:
                one.destroy()
        self._trajectories = self._actions = self._commands = None
        self._states = self._presets = self._transforms = self._events = None

    @property
    def _state_publishers(self) -> tuple[StatePublisher | PresetPublisher | TransformPublisher | None, ...]:
        return self._states, self._presets, self._transforms

    def _fri_state(self) -> FriState | None:
        return None if self.driver is None else self.driver.fri.newest

    # -------------------------------------------------------------------------- from the driver

    def on_state(self, state: State) -> None:
        """Publish a state."""
        try:
            self._publish_state(state)
        except Exception:
            if self._can_publish:  # asked only now: it takes half as long as to make a message
                raise

    def _publish_state(self, state: State) -> None:
        for publisher in (*self._state_publishers, self._events):
            if publisher is not None:
                publisher.state(state)
        driver, states = self.driver, self._states
        if driver is not None and states is not None:
            states.controller_state(state, driver)

    def on_feedback(self, feedback: GoalFeedback) -> None:
        """Publish feedback of a goal."""
        if self._trajectories is not None and self._can_publish:
            self._trajectories.on_feedback(feedback)

    def on_result(self, result: GoalResult) -> None:
        """Report the result of a goal."""
        if self._trajectories is not None:
            self._trajectories.on_result(result)

    def on_link(self, error: str) -> None:
        """Log that the arm was connected or the connection was lost."""
        if error and not self._ending.is_set():
            self.get_logger().error(error)
        elif not self._ending.is_set():
            self.get_logger().info("connected")

    def on_key(self, slot: int, down: bool) -> None:
        """Publish that a user key of the smartPAD was pressed or released."""
        if self._events is not None and self._can_publish:
            self._events.key(slot, down)
        if self._presets is not None and self._can_publish:
            self._presets.event(NameRole.KEY, f"key{slot}_{'pressed' if down else 'released'}")

    def on_event(self, number: int, event: MotionEvent) -> None:
        """Publish an event of a program."""
        if self._events is not None and self._can_publish:
            self._events.motion(number, event)

    def on_collision(self, found: Collision) -> None:
        """Publish a collision."""
        if self._events is not None and self._can_publish:
            self._events.collision(found)

    def on_arrival(self) -> None:
        """Publish that the arm is at its destination."""
        if self._presets is not None and self._can_publish:
            self._presets.event(NameRole.ARRIVED)

    # ---------------------------------------------------------------------------------- reporting

    @property
    def _can_publish(self) -> bool:
        """Whether publishing is possible: ROS may shut down before the node."""
        return not self._ending.is_set() and bool(self.context.ok())

    def _report(self) -> None:
        """Publish diagnostics, and the status and the FRI session if they have changed."""
        driver, states, events = self.driver, self._states, self._events
        if driver is None or states is None or self._ending.is_set():
            return
        diagnosis = driver.diagnosis()
        states.status(diagnosis, driver.state, connected=not driver.link_error, active=driver.active)
        states.diagnostics(diagnosis, driver.arm.cabinet)
        if events is not None:
            events.fri(driver.fri.status())


def _version() -> str:
    try:
        return importlib.metadata.version("heptarm")
    except importlib.metadata.PackageNotFoundError:
        return "(not installed)"
