"""The node: life cycle, parameters, and what ties the driver to ROS."""

from __future__ import annotations

import importlib.metadata
import threading
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.lifecycle import State as LifecycleState
from rclpy.parameter import Parameter as RosParameter

from heptarm.bridge import parameters
from heptarm.bridge.driver import Driver
from heptarm.bridge.goal import End
from heptarm.bridge.names import PRESETS, Meaning
from heptarm.bridge.parameters import Configuration, Parameter
from heptarm.bridge.runner import Feedback
from heptarm.errors import HeptarmError
from heptarm.values.collision import Collision
from heptarm.values.event import MotionEvent
from heptarm.values.state import State
from heptarm_ros2 import convert, peers
from heptarm_ros2.actions import ActionServers
from heptarm_ros2.commands import Commands
from heptarm_ros2.events import Events
from heptarm_ros2.peers import Peers
from heptarm_ros2.publishers import Publishers
from heptarm_ros2.trajectory import TrajectoryAction

#: Pause between attempts of the autostart [s].
_RETRY = 2.0


class HeptarmNode(LifecycleNode):
    """An LBR iiwa. Configuring connects, activating takes goals and commands; states come from configuring on."""

    def __init__(self, name: str = "heptarm", **options: Any) -> None:
        super().__init__(name, **options)
        self.ros = convert.ros(self)
        self.driver: Driver | None = None
        self._outputs: Publishers | None = None
        self._inputs: Commands | None = None
        self._goals: TrajectoryAction | None = None
        self._actions: ActionServers | None = None
        self._peers: Peers | None = None
        self._events: Events | None = None
        self._ending = threading.Event()
        for one in sorted(parameters.PARAMETERS, key=lambda one: one.name != "names"):
            self._declare(one)  # the first says whose names the others have
        for one in parameters.of_joints(self.get_parameter("joint_names").value or []):
            self._declare(one)
        self.configuration = Configuration.of({})
        self.add_on_set_parameters_callback(self._on_set)
        self._start_timer = None
        if self.get_parameter("autostart").value:
            group = MutuallyExclusiveCallbackGroup()
            self._start_timer = self.create_timer(0.05, self._start, callback_group=group)

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
        self.declare_parameter(one.name, one.default, descriptor)

    def value(self, name: str) -> Any:
        """A parameter's value."""
        return self.configuration.values[name]

    def _values(self) -> dict[str, object]:
        names = [one.name for one in parameters.PARAMETERS]
        names += [one.name for one in parameters.of_joints(self.get_parameter("joint_names").value or [])]
        return {name: self.get_parameter(name).value for name in names}

    def _on_set(self, changes: Sequence[RosParameter]) -> SetParametersResult:
        """Parameters are about to be set."""
        known = self._values()
        ours = {change.name: change.value for change in changes if change.name in known}
        if not ours:
            return SetParametersResult(successful=True)
        try:
            configuration = Configuration.of({**known, **ours})
        except HeptarmError as error:
            return SetParametersResult(successful=False, reason=str(error))
        if self.driver is not None:
            fixed = {one.name for one in parameters.PARAMETERS if one.fixed}
            held = sorted(name for name in ours if name in fixed and ours[name] != known[name])
            if held:
                reason = f"{', '.join(held)} cannot change now: clean the node up first"
                return SetParametersResult(successful=False, reason=reason)
            self.configuration = configuration
            self.driver.configure(configuration)
        return SetParametersResult(successful=True)

    # ------------------------------------------------------------------------------- life cycle

    def _start(self) -> None:
        """Configure and activate, again and again until it works; later the life cycle is the user's."""
        assert self._start_timer is not None
        self._start_timer.cancel()
        if self._ending.is_set():
            return
        if self.driver is None and self.trigger_configure() is not TransitionCallbackReturn.SUCCESS:
            self._start_timer.timer_period_ns = round(_RETRY * 1e9)
            self._start_timer.reset()
            return
        self.trigger_activate()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Connect."""
        log = self.get_logger()
        try:
            self.configuration = Configuration.of(self._values())
            self._outputs = Publishers(self)
            self._peers, self._events = Peers(self), Events(self)
            self.driver = Driver(self.configuration, self)
        except HeptarmError as error:
            log.error(f"not configured: {error}")
            self._destroy()
            return TransitionCallbackReturn.FAILURE
        arm = self.driver.arm
        actions = [entry.name for entry in peers.entries(self, Meaning.FOLLOW)]
        group = ReentrantCallbackGroup()
        self._goals = TrajectoryAction(self, ("~/follow_joint_trajectory", *actions), group)
        self._actions = ActionServers(self, self.driver, group)
        self._inputs = Commands(self, self.driver)
        period = 1.0 / self.value("diagnostics_rate")
        self._report_timer = self.create_timer(
            period, self._tell, callback_group=MutuallyExclusiveCallbackGroup()
        )
        log.info(
            f"heptarm {_version()}, {arm.robot.title}, cabinet {arm.cabinet!r} with software {arm.software}"
        )
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Take goals and commands."""
        assert self.driver is not None
        self.driver.activate()
        self._tell()
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Take no more goals; what runs comes to rest."""
        assert self.driver is not None
        self.driver.deactivate()
        self._tell()
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
        """Disconnect, and be ready to be configured again."""
        self._destroy()
        return TransitionCallbackReturn.SUCCESS

    def close(self) -> None:
        """Leave the arm at rest, quietly: ROS may be gone already."""
        self._ending.set()
        if self.driver is not None:
            self.driver.close()
            self.driver = None

    def _destroy(self) -> None:
        driver, self.driver = self.driver, None
        if driver is not None:
            driver.close()
            self.destroy_timer(self._report_timer)
        sides = (self._goals, self._actions, self._inputs, self._outputs)
        for one in (*sides, self._peers, self._events):
            if one is not None:
                one.destroy()
        self._goals = self._actions = self._inputs = self._outputs = None
        self._peers = self._events = None

    # -------------------------------------------------------------------------- from the driver

    def on_state(self, state: State) -> None:
        """A state came."""
        for outputs in (self._outputs, self._peers, self._events):
            if outputs is not None and self._lives:
                outputs.state(state)

    def on_feedback(self, feedback: Feedback) -> None:
        """A goal went on."""
        if self._goals is not None and self._lives:
            self._goals.on_feedback(feedback)

    def on_end(self, end: End) -> None:
        """A goal ended."""
        if self._goals is not None:
            self._goals.on_end(end)

    def on_link(self, trouble: str) -> None:
        """The connection came or went."""
        if trouble and not self._ending.is_set():
            self.get_logger().error(f"the connection is lost: {trouble}")
        elif not self._ending.is_set():
            self.get_logger().info("connected")

    def on_key(self, slot: int, down: bool) -> None:
        """A user key of the smartPAD was pressed or released."""
        if self._events is not None and self._lives:
            self._events.key(slot, down)

    def on_event(self, number: int, event: MotionEvent) -> None:
        """Something has become of a program."""
        if self._events is not None and self._lives:
            self._events.motion(number, event)

    def on_collision(self, found: Collision) -> None:
        """The collision guard has met something."""
        if self._events is not None and self._lives:
            self._events.collision(found)

    # ------------------------------------------------------------------------------------ others

    @property
    def _lives(self) -> bool:
        """Whether there is anybody to tell: ROS may have ended before the node."""
        return not self._ending.is_set() and bool(self.context.ok())

    def _tell(self) -> None:
        """Diagnostics, and the status if it has changed."""
        driver, publishers = self.driver, self._outputs
        if driver is None or publishers is None or self._ending.is_set():
            return
        report = driver.report()
        state = None
        if not driver.trouble:
            try:
                state = driver.arm.state
            except HeptarmError:
                state = None
        publishers.status(report, state, connected=not driver.trouble, active=driver.active)
        publishers.diagnostics(report, driver.arm.cabinet)
        if self._events is not None:
            self._events.fri(driver.fri.status())


def _version() -> str:
    try:
        return importlib.metadata.version("heptarm")
    except importlib.metadata.PackageNotFoundError:
        return "(from its sources)"
