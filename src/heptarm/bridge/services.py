"""Services of the nodes, free of ROS: one table for both, and what each does.

A node makes a service of every row of `SERVICES`; the fields of a request are those of the row's type::

    services = Services(driver, ros)
    for row in SERVICES:
        ...                # of row.type, under row.name: fill(response, services.answer(row, request))
"""

from __future__ import annotations

import contextlib
import logging
import threading
from typing import Any

from heptarm.bridge.collision_services import COLLISIONS, CollisionServices
from heptarm.bridge.conditions import condition_of
from heptarm.bridge.driver import Driver
from heptarm.bridge.fri_services import FRI, FriServices
from heptarm.bridge.io_services import SIGNALS, Signals
from heptarm.bridge.messages import Ros
from heptarm.bridge.mode_services import MODES, Modes
from heptarm.bridge.service import Answer, Service, Told, names
from heptarm.bridge.tool_services import TOOLS, Tools
from heptarm.errors import HeptarmError, NotReady

_log = logging.getLogger("heptarm.bridge")

#: Names of stops by what the service is called with.
_STOPS = ("path", "fast", "after_motion")


class Services(Modes, Tools, Signals, FriServices, CollisionServices):
    """What the services do with an arm.

    Args:
        driver: whose arm it is.
        ros: of which ROS the requests are.
    """

    def __init__(self, driver: Driver, ros: Ros) -> None:
        super().__init__(driver)
        self._ros = ros
        self._lock = threading.Lock()

    def answer(self, row: Service, request: Any) -> Answer:
        """Do what a request wants; what goes wrong is in the answer.

        Args:
            row: which service.
            request: with the fields of its type.
        """
        try:
            with contextlib.nullcontext() if row.at_once else self._lock:
                done = row.work(self, request)
        except HeptarmError as error:
            return Answer(False, str(error))
        except Exception as error:  # it would end the node, and what the arm does
            _log.exception("%s", row.name)
            return Answer(False, f"the node failed: {error!r}")
        return done if isinstance(done, Answer) else Answer(True, done)

    # ------------------------------------------------------------------------------- stop and go

    def stop(self, request: Any) -> str:
        """Stop whatever runs."""
        self._driver.stop()
        return "stopped"

    def stop_as(self, request: Any) -> str:
        """Stop on the path, fast, or after the motion that runs."""
        if request.value not in _STOPS:
            raise NotReady(f"there is no stop {request.value!r}", hint=f"choose from {', '.join(_STOPS)}")
        self._driver.stop(request.value)
        return f"stopped: {request.value}"

    def pause(self, request: Any) -> str:
        """Stop on the path until `resume`."""
        self._arm.pause()
        return "paused"

    def resume(self, request: Any) -> str:
        """Go on."""
        self._arm.resume()
        return "resumed"

    def recover(self, request: Any) -> Answer:
        """Come back after trouble as far as a program may."""
        done = self._arm.recover()
        return Answer(done.done, str(done))

    def take_control(self, request: Any) -> str:
        """Become the one who may move the arm."""
        self._arm.take_control()
        return "in control"

    def release_control(self, request: Any) -> str:
        """Let another client move the arm."""
        self._rest()
        self._arm.release_control()
        return "control is free"

    def operate(self, request: Any) -> str:
        """Play the person beside a simulated arm that this node has started."""
        self._arm.operator.do(request.value)
        return f"done: {request.value}"

    def query(self, request: Any) -> Answer:
        """What the trajectory under way wants at a time of ROS; 0: now."""
        seconds = self._ros.seconds(request.time)
        ahead = seconds - 1e-9 * self._ros.now() if seconds else 0.0
        wanted = self._driver.at(self._driver.now + ahead)
        if wanted is None:
            return Answer(False, "no trajectory is under way at that time")
        fields = {
            "name": list(self._driver.configuration.joints),
            "position": wanted.q.tolist(),
            "velocity": wanted.dq.tolist(),
            "acceleration": wanted.ddq.tolist(),
        }
        return Told(True, "where the arm should be then", fields)

    # ------------------------------------------------------------------------------------ limits

    def set_override(self, request: Any) -> str:
        """Set the cabinet's application override."""
        self._arm.set_override(request.value)
        return f"override is {request.value:g}"

    def set_speed(self, request: Any) -> str:
        """Set the ceiling of the speed of motions that come."""
        self._arm.speed = request.value
        return f"ceiling of the speed is {request.value:g}"

    def guard(self, request: Any) -> str:
        """Set the condition that ends motions and servo topics that bring none; an empty text: none."""
        condition = condition_of(request.value, "value")
        self._driver.guard = condition
        return "no guard" if condition is None else f"from the next motion on: until {condition}"

    # -------------------------------------------------------------------------------------- what

    def capabilities(self, request: Any) -> Told:
        """What the cabinet's application can do."""
        return names(self._arm.capabilities)

    def info(self, request: Any) -> Told:
        """What arm this is."""
        arm, robot = self._arm, self._arm.robot
        fields = {
            "model": robot.name,
            "title": robot.title,
            "cabinet": arm.cabinet,
            "software": arm.software,
            "is_virtual": arm.is_virtual,
            "pace": float(arm.pace),
            "controller": arm.controller,
        }
        limits = {name: getattr(robot, name).tolist() for name in ("q_min", "q_max", "dq_max", "tau_max")}
        return Told(True, f"{robot.title}, cabinet {arm.cabinet!r}", fields | limits)


_TRIGGER, _NUMBER, _TEXT = "std_srvs/Trigger", "heptarm_msgs/SetNumber", "heptarm_msgs/SetText"
#: All of them.
SERVICES = (
    Service("~/stop", _TRIGGER, Services.stop, at_once=True),
    Service("~/stop_as", _TEXT, Services.stop_as, at_once=True),
    Service("~/pause", _TRIGGER, Services.pause, at_once=True),
    Service("~/resume", _TRIGGER, Services.resume, at_once=True),
    Service("~/recover", _TRIGGER, Services.recover),
    Service("~/take_control", _TRIGGER, Services.take_control),
    Service("~/release_control", _TRIGGER, Services.release_control),
    Service("~/query_state", "control_msgs/QueryTrajectoryState", Services.query, at_once=True),
    Service("~/operate", _TEXT, Services.operate, at_once=True),
    Service("~/set_override", _NUMBER, Services.set_override, at_once=True),
    Service("~/set_speed", _NUMBER, Services.set_speed, at_once=True),
    Service("~/set_guard", _TEXT, Services.guard, at_once=True),
    Service("~/capabilities", "heptarm_msgs/GetNames", Services.capabilities, at_once=True),
    Service("~/info", "heptarm_msgs/GetInfo", Services.info, at_once=True),
    *MODES,
    *TOOLS,
    *SIGNALS,
    *FRI,
    *COLLISIONS,
)
