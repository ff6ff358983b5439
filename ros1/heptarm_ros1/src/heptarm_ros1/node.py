"""The node: life cycle, parameters, and what ties the driver to ROS.

ROS 1 knows no life cycle, so the node has services by the names of ROS 2's transitions.
"""

from __future__ import annotations

import importlib.metadata
import threading
from collections.abc import Callable
from typing import Any

import rospy
from std_srvs.srv import Trigger, TriggerResponse

from heptarm.bridge import parameters
from heptarm.bridge.driver import Driver
from heptarm.bridge.goal import End
from heptarm.bridge.parameters import Configuration
from heptarm.bridge.runner import Feedback
from heptarm.errors import HeptarmError, NotReady
from heptarm.values.collision import Collision
from heptarm.values.event import MotionEvent
from heptarm.values.state import State
from heptarm_ros1 import peers, settings
from heptarm_ros1.actions import ActionServers
from heptarm_ros1.commands import Commands
from heptarm_ros1.events import Events
from heptarm_ros1.peers import Peers
from heptarm_ros1.publishers import Publishers
from heptarm_ros1.trajectory import TrajectoryAction

#: Pause between attempts of the autostart [s].
_RETRY = 2.0


class HeptarmNode:
    """An LBR iiwa. Configuring connects, activating takes goals and commands; states come from configuring on."""

    def __init__(self) -> None:
        self.driver: Driver | None = None
        self.configuration = Configuration.of({})
        self._given: dict[str, Any] = {}
        self._outputs: Publishers | None = None
        self._inputs: Commands | None = None
        self._peers: Peers | None = None
        self._events: Events | None = None
        self._lock = threading.RLock()
        self._ending = threading.Event()
        self._wake = threading.Event()
        # actionlib cannot end a server, so they live as long as the node, and reject while it is not configured
        self._goals = TrajectoryAction(self, ("~follow_joint_trajectory", *peers.actions()))
        self._actions = ActionServers()
        steps: tuple[tuple[type, str, Callable[[], str]], ...] = (
            (Trigger, "~configure", self.configure),
            (Trigger, "~activate", self.activate),
            (Trigger, "~deactivate", self.deactivate),
            (Trigger, "~cleanup", self.cleanup),
            (Trigger, "~reload", self.reload),
        )
        self._services = [rospy.Service(name, kind, _answered(step)) for kind, name, step in steps]
        self._threads = [threading.Thread(target=self._report, name="heptarm-report")]
        if rospy.get_param("~autostart", True):
            self._threads.append(threading.Thread(target=self._start, name="heptarm-start"))
        for thread in self._threads:
            thread.start()

    # ------------------------------------------------------------------------------- life cycle

    def _start(self) -> None:
        """Configure and activate, again and again until it works; later the life cycle is the user's."""
        while not self._ending.is_set():
            try:
                if self.driver is None:
                    self.configure()
                self.activate()
                return
            except HeptarmError as error:
                rospy.logerr(f"not configured: {error}")
            self._ending.wait(_RETRY)

    def configure(self) -> str:
        """Connect.

        Raises:
            HeptarmError: nobody answers, or a parameter is wrong.
        """
        with self._lock:
            if self.driver is not None or self._ending.is_set():
                return "it is configured"
            self._given, strange = settings.read()
            if strange:
                rospy.logwarn(f"unknown parameters: {', '.join(strange)}")
            self.configuration = Configuration.of(self._given)
            self._outputs = Publishers(self.configuration)
            self._peers, self._events = Peers(self), Events(self)
            try:
                self.driver = Driver(self.configuration, self)
            except HeptarmError:
                self._destroy()
                raise
            self._inputs = Commands(self.driver)
            self._actions.serve(self.driver)
            arm = self.driver.arm
            text = f"heptarm {_version()}, {arm.robot.title}, cabinet {arm.cabinet!r} with software {arm.software}"
            rospy.loginfo(text)
            self._wake.set()
            return text

    def activate(self) -> str:
        """Take goals and commands.

        Raises:
            HeptarmError: the node is not configured.
        """
        with self._lock:
            self._configured().activate()
        self._wake.set()
        return "goals and commands are taken"

    def deactivate(self) -> str:
        """Take no more goals; what runs comes to rest.

        Raises:
            HeptarmError: the node is not configured.
        """
        with self._lock:
            self._configured().deactivate()
        self._wake.set()
        return "no goals and commands are taken"

    def cleanup(self) -> str:
        """Disconnect."""
        with self._lock:
            self._destroy()
        return "disconnected"

    def reload(self) -> str:
        """Take parameters that have changed; ROS 1 tells nobody of them, so the node looks now and then, too.

        Raises:
            HeptarmError: one is not legal, or cannot change now; the old ones count.
        """
        with self._lock:
            self._configured()
            given, strange = settings.read()
            before = self._given
            if given == before:
                return "nothing has changed"
            changed = sorted(name for name in {*given, *before} if given.get(name) != before.get(name))
            configuration = Configuration.of(given)
            fixed = {one.name for one in parameters.PARAMETERS if one.fixed}
            held = [name for name in changed if name in fixed]
            if held:
                raise NotReady(f"{', '.join(held)} cannot change now", hint="clean the node up first")
            self._given, self.configuration = given, configuration
            self._configured().configure(configuration)
        text = f"new parameters: {', '.join(changed)}"
        if strange:
            text += f"; unknown ones: {', '.join(strange)}"
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
        self._goals.close()

    def _configured(self) -> Driver:
        if self.driver is None:
            raise NotReady("the node is not configured", hint="call ~configure")
        return self.driver

    def _destroy(self) -> None:
        driver, self.driver = self.driver, None
        self._actions.serve(None)
        if driver is not None:
            driver.close()
        for one in (self._inputs, self._outputs, self._peers, self._events):
            if one is not None:
                one.destroy()
        self._inputs = self._outputs = self._peers = self._events = None

    # -------------------------------------------------------------------------- from the driver

    def on_state(self, state: State) -> None:
        """A state came."""
        for outputs in (self._outputs, self._peers, self._events):
            if outputs is not None and not rospy.is_shutdown():
                outputs.state(state)

    def on_feedback(self, feedback: Feedback) -> None:
        """A goal went on."""
        self._goals.on_feedback(feedback)

    def on_end(self, end: End) -> None:
        """A goal ended."""
        self._goals.on_end(end)

    def on_link(self, trouble: str) -> None:
        """The connection came or went."""
        if trouble:
            rospy.logerr(f"the connection is lost: {trouble}")
        else:
            rospy.loginfo("connected")
        self._wake.set()

    def on_key(self, slot: int, down: bool) -> None:
        """A user key of the smartPAD was pressed or released."""
        if self._events is not None and not rospy.is_shutdown():
            self._events.key(slot, down)

    def on_event(self, number: int, event: MotionEvent) -> None:
        """Something has become of a program."""
        if self._events is not None and not rospy.is_shutdown():
            self._events.motion(number, event)

    def on_collision(self, found: Collision) -> None:
        """The collision guard has met something."""
        if self._events is not None and not rospy.is_shutdown():
            self._events.collision(found)

    # -------------------------------------------------------------------------- now and then

    def _report(self) -> None:
        """Diagnostics, the status if it has changed, and parameters that have changed."""
        told = ""
        while not self._ending.is_set():
            self._wake.wait(1.0 / self.configuration.values["diagnostics_rate"])
            self._wake.clear()
            try:
                trouble = ""
                try:
                    if self.driver is not None:
                        self.reload()
                except HeptarmError as error:
                    trouble = str(error)
                if trouble and trouble != told:
                    rospy.logerr(f"the old parameters count: {trouble}")
                told = trouble
                self._tell()
            except (rospy.ROSException, OSError) as error:  # no master
                if not self._ending.is_set():
                    rospy.logwarn_throttle(10.0, f"reporting: {error}")

    def _tell(self) -> None:
        driver, outputs = self.driver, self._outputs
        if driver is None or outputs is None or self._ending.is_set():
            return
        report = driver.report()
        state = None
        if not driver.trouble:
            try:
                state = driver.arm.state
            except HeptarmError:
                state = None
        outputs.status(report, state, connected=not driver.trouble, active=driver.active)
        outputs.diagnostics(report, driver.arm.cabinet)
        if self._events is not None:
            self._events.fri(driver.fri.status())


def _answered(step: Callable[[], str]) -> Callable[[Any], TriggerResponse]:
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
        return "(from its sources)"
