"""The node: life cycle, parameters, and the connection of the driver to ROS.

ROS 1 has no life cycle, so the node has services with the names of the transitions of ROS 2.
"""

from __future__ import annotations

import importlib.metadata
import threading
from collections.abc import Callable
from typing import Any

import rospy
from std_srvs.srv import Trigger, TriggerResponse

from heptarm.errors import HeptarmError, NotReady
from heptarm.fri import State as FriState
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.names import NameRole
from heptarm.ros.node.driver import Driver
from heptarm.ros.node.parameters import PARAMETERS, NodeConfiguration
from heptarm.ros.trajectory.goal import GoalResult
from heptarm.ros.trajectory.runner import GoalFeedback
from heptarm.values.condition.collision import Collision
from heptarm.values.result import MotionEvent
from heptarm.values.state import State
from heptarm_ros1 import parameters
from heptarm_ros1.actions import ActionServers
from heptarm_ros1.commands import Commands
from heptarm_ros1.convert import ROS
from heptarm_ros1.events import EventPublisher
from heptarm_ros1.presets import PresetPublisher
from heptarm_ros1.publishers import StatePublisher, TransformPublisher
from heptarm_ros1.trajectory import TrajectoryAction

#: Pause between two attempts of the autostart [s].
_RETRY = 2.0


class HeptarmNode:
    """An LBR iiwa. ~configure connects and publishes states, ~activate accepts goals and commands."""

    def __init__(self) -> None:
        self.driver: Driver | None = None
        self.configuration = NodeConfiguration.of(parameters.read()[0])  # what it refuses no retry mends
        self._given: dict[str, Any] = {}
        self._states: StatePublisher | None = None
        self._presets: PresetPublisher | None = None
        self._transforms: TransformPublisher | None = None
        self._events: EventPublisher | None = None
        self._commands: Commands | None = None
        self._lock = threading.RLock()
        self._ending = threading.Event()
        self._wake = threading.Event()
        # actionlib cannot destroy a server, so they live as long as the node, and reject while it is not configured
        self._trajectories = TrajectoryAction(("~follow_joint_trajectory", *parameters.preset().actions()))
        self._actions = ActionServers(
            str(rospy.get_param("~names", "heptarm")), with_moveit=rospy.get_param("~moveit", False) is True
        )
        steps: tuple[tuple[type, str, Callable[[], str]], ...] = (
            (Trigger, "~configure", self.configure),
            (Trigger, "~activate", self.activate),
            (Trigger, "~deactivate", self.deactivate),
            (Trigger, "~cleanup", self.cleanup),
            (Trigger, "~reload", self.reload),
        )
        self._services = [rospy.Service(name, kind, _service(step)) for kind, name, step in steps]
        self._threads = [threading.Thread(target=self._run_reports, name="heptarm-report")]
        if rospy.get_param("~autostart", True):
            self._threads.append(threading.Thread(target=self._start, name="heptarm-start"))
        for thread in self._threads:
            thread.start()

    # ------------------------------------------------------------------------------- life cycle

    def _start(self) -> None:
        """Configure and activate, with retries until it works; after that the user controls the life cycle."""
        while not self._ending.is_set():
            try:
                if self.driver is None:
                    self.configure()
                self.activate()
                return
            except HeptarmError as error:
                rospy.logerr(f"not configured: {error}; wait, the next attempt is in {_RETRY:g} s")
            self._ending.wait(_RETRY)

    def configure(self) -> str:
        """Connect.

        Raises:
            HeptarmError: the cabinet does not answer, or a parameter is not allowed.
        """
        with self._lock:
            if self.driver is not None or self._ending.is_set():
                return "configured already"
            self._given, warning = parameters.read()
            if warning:
                rospy.logwarn(warning)
            self.configuration = NodeConfiguration.of(self._given)
            self._states = StatePublisher(self.configuration)
            self._presets = PresetPublisher(self.configuration, fri=self._fri_state)
            self._events = EventPublisher(self.configuration)
            try:
                self.driver = Driver(self.configuration, self, clock=rospy.get_time)
            except HeptarmError:
                self._destroy()
                raise
            arm = self.driver.arm
            if self.configuration.values["publish_tf"]:
                self._transforms = TransformPublisher(self.configuration, arm.robot)
            context = NodeContext(self.driver, ROS)
            self._commands = Commands(context)
            self._actions.serve(context)
            self._trajectories.serve(self.driver)
            text = f"heptarm {_version()}, {arm.robot.title}, cabinet {arm.cabinet!r} with software {arm.software}"
            rospy.loginfo(text)
            self._wake.set()
            return text

    def activate(self) -> str:
        """Accept goals and commands.

        Raises:
            HeptarmError: the node is not configured.
        """
        with self._lock:
            self._configured().activate()
        self._wake.set()
        return "active"

    def deactivate(self) -> str:
        """Accept nothing more, and bring the arm to rest.

        Raises:
            HeptarmError: the node is not configured.
        """
        with self._lock:
            self._configured().deactivate()
        self._wake.set()
        return "inactive"

    def cleanup(self) -> str:
        """Disconnect."""
        with self._lock:
            self._destroy()
        return "disconnected"

    def reload(self) -> str:
        """Apply changed parameters; ROS 1 does not report changes, so the node also calls this periodically.

        Raises:
            HeptarmError: one is not allowed, or cannot change now; the old ones stay in effect.
        """
        with self._lock:
            self._configured()
            given, warning = parameters.read()
            before = self._given
            if given == before:
                return "nothing has changed"
            changed = sorted(name for name in {*given, *before} if given.get(name) != before.get(name))
            configuration = NodeConfiguration.of(given)
            fixed = {one.name for one in PARAMETERS if one.fixed}
            held = [name for name in changed if name in fixed]
            if held:
                raise NotReady(
                    f"{', '.join(held)} cannot change while the node is configured",
                    hint="call ~cleanup first",
                )
            self._given, self.configuration = given, configuration
            self._configured().configure(configuration)
        text = f"new parameters: {', '.join(changed)}"
        if warning:
            text += f"; {warning}"
        rospy.loginfo(text)
        return text

    def close(self) -> None:
        """Leave the arm at rest."""
        self._ending.set()
        self._wake.set()
        with self._lock:
            driver, self.driver = self.driver, None
            if driver is not None:
                driver.close()
        for thread in self._threads:
            thread.join()
        self._trajectories.close()

    def _configured(self) -> Driver:
        if self.driver is None:
            raise NotReady("the node is not configured", hint="call ~configure")
        return self.driver

    def _destroy(self) -> None:
        driver, self.driver = self.driver, None
        self._actions.serve(None)
        self._trajectories.serve(None)
        if driver is not None:
            driver.close()
        for one in (self._commands, *self._publishers, self._events):
            if one is not None:
                one.destroy()
        self._commands = self._states = self._presets = self._transforms = self._events = None

    @property
    def _publishers(self) -> tuple[StatePublisher | PresetPublisher | TransformPublisher | None, ...]:
        return self._states, self._presets, self._transforms

    def _fri_state(self) -> FriState | None:
        return None if self.driver is None else self.driver.fri.newest

    # -------------------------------------------------------------------------- from the driver

    def on_state(self, state: State) -> None:
        """Publish a state."""
        for publisher in (*self._publishers, self._events):
            if publisher is not None and not rospy.is_shutdown():
                publisher.state(state)
        driver, states = self.driver, self._states
        if driver is not None and states is not None and not rospy.is_shutdown():
            states.controller_state(state, driver)

    def on_feedback(self, feedback: GoalFeedback) -> None:
        """Publish feedback of a goal."""
        self._trajectories.on_feedback(feedback)

    def on_result(self, result: GoalResult) -> None:
        """Report the result of a goal."""
        self._trajectories.on_result(result)

    def on_link(self, error: str) -> None:
        """Log that the arm was connected or the connection was lost."""
        if error:
            rospy.logerr(error)
        else:
            rospy.loginfo("connected")
        self._wake.set()

    def on_key(self, slot: int, down: bool) -> None:
        """Publish that a user key of the smartPAD was pressed or released."""
        if self._events is not None and not rospy.is_shutdown():
            self._events.key(slot, down)
        if self._presets is not None and not rospy.is_shutdown():
            self._presets.event(NameRole.KEY, f"key{slot}_{'pressed' if down else 'released'}")

    def on_event(self, number: int, event: MotionEvent) -> None:
        """Publish an event of a program."""
        if self._events is not None and not rospy.is_shutdown():
            self._events.motion(number, event)

    def on_collision(self, found: Collision) -> None:
        """Publish a collision."""
        if self._events is not None and not rospy.is_shutdown():
            self._events.collision(found)

    def on_arrival(self) -> None:
        """Publish that the arm is at its destination."""
        if self._presets is not None and not rospy.is_shutdown():
            self._presets.event(NameRole.ARRIVED)

    # ---------------------------------------------------------------------------------- reporting

    def _run_reports(self) -> None:
        """Periodically apply changed parameters and publish diagnostics, until the node closes."""
        last_error = ""
        while not self._ending.is_set():
            self._wake.wait(1.0 / self.configuration.values["diagnostics_rate"])
            self._wake.clear()
            try:
                found = self._reload_error()
                if found and found != last_error:
                    rospy.logerr(f"parameters not applied: {found}")
                last_error = found
                self._report()
            except (rospy.ROSException, OSError) as error:  # the master does not answer
                if not self._ending.is_set():
                    rospy.logwarn_throttle(10.0, f"reporting: {error}")

    def _reload_error(self) -> str:
        try:
            if self.driver is not None:
                self.reload()
        except HeptarmError as error:
            return str(error)
        return ""

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


def _service(step: Callable[[], str]) -> Callable[[Any], TriggerResponse]:
    def callback(_: Any) -> TriggerResponse:
        try:
            return TriggerResponse(success=True, message=step())
        except HeptarmError as error:
            return TriggerResponse(success=False, message=str(error))

    return callback


def _version() -> str:
    try:
        return importlib.metadata.version("heptarm")
    except importlib.metadata.PackageNotFoundError:
        return "(not installed)"
