"""One arm behind a node: its life, goals, commands, services; free of ROS.

A node makes one, converts messages for it, and is told of states and goals from the driver's own threads.
"""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.arm.connect import connect
from heptarm.arm.groups import GROUPS
from heptarm.arm.handle import MotionHandle
from heptarm.bridge.collision import CollisionWatch
from heptarm.bridge.execution import Execution
from heptarm.bridge.feed import Feed
from heptarm.bridge.fri_execution import FriExecution
from heptarm.bridge.fri_session import FriSession
from heptarm.bridge.goal import End, Goal, GoalRefused
from heptarm.bridge.listener import DriverListener
from heptarm.bridge.parameters import Configuration
from heptarm.bridge.report import Report, report
from heptarm.bridge.runner import Feedback
from heptarm.bridge.servo_execution import ServoExecution
from heptarm.bridge.spline_execution import SplineExecution
from heptarm.bridge.stream import Stream
from heptarm.bridge.task import Task
from heptarm.bridge.trajectory import Sample
from heptarm.errors import HeptarmError, NotReady
from heptarm.values.arrays import Array
from heptarm.values.collision import Collision
from heptarm.values.condition import Condition
from heptarm.values.mode import Mode
from heptarm.values.motion import Motion
from heptarm.values.pose import Pose
from heptarm.values.state import State

_log = logging.getLogger("heptarm.bridge")

#: How long a motion may take to come to rest before a goal [s].
_REST = 5.0


class Driver:
    """One arm behind a node.

    Args:
        configuration: what the node's parameters say.
        listener: hears of everything.

    Attributes:
        configuration: what the node's parameters say now.
        fri: the session that services open.
        collisions: the guard against them.

    Raises:
        ConnectFailed: nobody answers.
        NotInControl: another client controls the robot.
    """

    def __init__(self, configuration: Configuration, listener: DriverListener) -> None:
        values = configuration.values
        self.configuration = configuration
        self._listener = listener
        self._active = False
        self._handle: MotionHandle | None = None
        self._task: Task | None = None
        self._arm = connect(
            values["target"] or None,
            key=values["key"] or None,
            state_rate=values["state_rate"],
            name=_name(),
            groups=(*GROUPS, "io") if values["publish_signals"] else GROUPS,
            watchdog=values["watchdog"],
        )
        self._arm.pad.on_key(listener.on_key)
        self.fri = FriSession(self._arm)
        self.collisions = CollisionWatch(self._arm, tell=self._on_collision, start=self.start)
        self._told = (0, 0.0)  # the last feedback: of which goal, and when
        self._execution = self._way()
        self._stream = Stream(
            self._arm,
            timeout=values["command_timeout"],
            options=configuration.servo,
            line_speed=values["servo.line_speed"],
        )
        self._feed = Feed(self._arm, on_state=self._on_state, on_link=listener.on_link)

    def _way(self) -> Execution:
        """The way of execution that the parameters choose."""
        known = self.configuration
        if known.values["execution"] == "spline":
            speed = known.values["servo.speed"]
            return SplineExecution(self._arm, known.joints, self, speed=speed, settings=known.settings)
        if known.values["execution"] == "fri":
            return FriExecution(self._arm, known.joints, self, options=known.fri, settings=known.settings)
        return ServoExecution(self._arm, known.joints, self, options=known.servo, settings=known.settings)

    # ------------------------------------------------------------------------------------ life

    @property
    def arm(self) -> Arm:
        """The arm."""
        return self._arm

    @property
    def trouble(self) -> str:
        """Why there is no connection; empty: there is one."""
        return self._feed.trouble

    @property
    def active(self) -> bool:
        """Whether goals and commands are taken."""
        return self._active

    def activate(self) -> None:
        """Take goals and commands from now on."""
        self._active = True

    def deactivate(self) -> None:
        """Take no more; what runs comes to rest."""
        self._active = False
        self._end_task("the node was deactivated")
        self._execution.abort("the node was deactivated")
        self._stream.close()
        self.fri.close()
        if self._handle is not None and not self._handle.done:
            try:
                self._arm.stop()
            except HeptarmError as error:
                _log.warning("deactivating: %s", error)
        self._execution.wait_idle(_REST)

    def close(self) -> None:
        """Leave the arm at rest and disconnect. Closing twice is legal."""
        if self._feed.ended:
            return
        self.deactivate()
        self._feed.end()
        self.collisions.off()
        self._execution.close()
        self._arm.close()
        self._feed.join()

    def configure(self, configuration: Configuration) -> None:
        """Take other values of those parameters that count at once."""
        self.configuration = configuration
        self._execution.settings = configuration.settings

    def report(self) -> Report:
        """How the arm is."""
        state = None
        try:
            state = self._arm.state
        except HeptarmError as error:
            return report(None, trouble=self.trouble or str(error), active=self._active)
        return report(state, trouble=self.trouble, active=self._active, age=state.age)

    def _on_state(self, state: State) -> None:
        """A stop of the safety controller ends the goal: its time would stand still, and it would go on by surprise."""
        safety = state.status
        if safety is not None and (safety.emergency_stop or safety.protective_stop) and self._execution.goal:
            self._execution.drop(report(state).text)
        self._listener.on_state(state)

    # ------------------------------------------------------------------------------------ goals

    @property
    def now(self) -> float:
        """The time on the clock that goals start by [s]."""
        return self._execution.now

    def accept(self, goal: Goal) -> int:
        """Take a goal of FollowJointTrajectory; whatever else moves the arm comes to rest first.

        Returns:
            Its number.

        Raises:
            GoalRefused: it makes no sense, or the node is not active, or the arm cannot follow.
        """
        if not self._active:
            raise GoalRefused("the node is not active", hint="activate it")
        if self.trouble:
            raise GoalRefused(f"no connection: {self.trouble}")
        try:
            self._check_ready()
            self._hold_control()
            self._clear("a trajectory took the place of it")
        except HeptarmError as error:
            raise GoalRefused(str(error)) from error
        return self._execution.accept(goal)

    def begin(self, what: str, work: Callable[[], object]) -> Task:
        """Begin a call that moves the arm several times; whatever else moves it comes to rest first.

        Args:
            what: what it is, in words.
            work: the call.

        Raises:
            HeptarmError: refused; the text says why.
        """
        self._check_active()
        self._check_ready()
        self._execution.abort(f"{what} took the place of this goal")
        self._execution.wait_idle(_REST)
        self._clear(f"{what} took the place of it")
        self._task = Task(self._arm, what, work)
        return self._task

    def _clear(self, why: str) -> None:
        """Bring to rest what moves the arm beside goals."""
        self._end_task(why)
        self._stream.close()
        if self._handle is not None and not self._handle.done:
            self._handle.cancel()
            self._arm.wait_for_rest(timeout=_REST)

    def _end_task(self, why: str) -> None:
        if self._task is not None:
            self._task.end(why)

    def at(self, time: float) -> Sample | None:
        """What the goal under way wants at a time on the clock of `now` [s]; None: nothing."""
        return self._execution.at(time)

    def cancel(self, number: int) -> bool:
        """End a goal early; the arm brakes. False: it is not under way."""
        return self._execution.cancel(number)

    def on_feedback(self, feedback: Feedback) -> None:
        """From the execution: goes on to the listener as often as the parameter `action_monitor_rate` says."""
        number, then = self._told
        if (
            number != feedback.number
            or self.now - then >= 1.0 / self.configuration.values["action_monitor_rate"]
        ):
            self._told = feedback.number, self.now
            self._listener.on_feedback(feedback)

    def on_end(self, end: End) -> None:
        """From the execution."""
        self._listener.on_end(end)

    def _check_ready(self) -> None:
        safety = self._arm.state.status
        if safety is not None and (safety.emergency_stop or safety.protective_stop):
            raise NotReady("a stop is active", hint=report(self._arm.state).text)

    def _hold_control(self) -> None:
        """Take control again if it was lost, by a moment of silence, and nobody else has taken it."""
        if not self._arm.in_control and not self._arm.controller:
            self._arm.take_control()
            _log.warning("took control again")

    # --------------------------------------------------------------------------------- commands

    def start(
        self,
        motion: Motion | Sequence[Motion],
        *,
        mode: Mode | None = None,
        speed: float | None = None,
        until: Condition | None = None,
        when: Literal["queue", "replace", "reject"] = "replace",
    ) -> MotionHandle:
        """Start any motion, or several as one program.

        Args:
            motion: what to do.
            mode: control mode; None: that of the services.
            speed: ceiling for this one, (0, 1]; None: that of the parameter `speed`.
            until: condition that ends it; None: that of `guard`.
            when: while something runs: "replace" it, "queue" behind it, or "reject" this one.

        Raises:
            HeptarmError: refused; the text says why.
        """
        self._check_active()
        if when == "replace":
            self._end_task("a command took the place of it")
            self._execution.abort("a command took the place of this goal")
            self._stream.close()
        self._check_task()
        ceiling = self.configuration.values["speed"] if speed is None else speed
        ends = self.guard if until is None else until
        handle = self._handle = self._arm.start(motion, mode=mode, speed=ceiling, until=ends, when=when)
        handle.add_event_callback(lambda event: self._listener.on_event(handle.id, event))
        return handle

    def follow(self, target: Array | Pose, dq: Array | None = None, *, straight: bool = False) -> None:
        """Follow a target of a servo topic until none comes for `command_timeout`.

        Args:
            target: joint positions, shape (7,) [rad], or a pose of the flange in the base.
            dq: velocity to pass the joint positions at, shape (7,) [rad/s].
            straight: to a pose on straight lines.

        Raises:
            HeptarmError: refused; the text says why.
        """
        self._prepare_stream()
        if isinstance(target, Pose):
            self._stream.pose(target, straight=straight)
        else:
            self._stream.joints(target, dq)

    def follow_velocity(self, dq: Array) -> None:
        """Move at joint velocities, shape (7,) [rad/s], until none come for `command_timeout`.

        Raises:
            HeptarmError: refused; the text says why.
        """
        self._prepare_stream()
        self._stream.velocity(np.asarray(dq, dtype=np.float64))

    def _prepare_stream(self) -> None:
        self._check_active()
        self._check_task()
        if not self._stream.active:
            if self._execution.busy:
                self._execution.abort("a servo command took the place of this goal")
            self._execution.wait_idle(_REST)

    def _check_active(self) -> None:
        if not self._active:
            raise NotReady("the node is not active", hint="activate it")
        self._hold_control()

    def _check_task(self) -> None:
        if self._task is not None and not self._task.done:
            raise NotReady(f"{self._task.what} is under way", hint="cancel it first")

    # --------------------------------------------------------------------------------- services

    @property
    def guard(self) -> Condition | None:
        """Condition that ends motions that bring none, and servo topics; None: there is none."""
        return self._stream.guard

    @guard.setter
    def guard(self, value: Condition | None) -> None:
        self._stream.guard = value

    def stop(self, kind: Literal["path", "fast", "after_motion"] = "path") -> None:
        """Stop whatever runs; see `Arm.stop`. A task is one motion: "after_motion" lets it finish.

        Raises:
            HeptarmError: it cannot be stopped; the text says why.
        """
        if kind != "after_motion":
            self._end_task("it was stopped")
        self._arm.stop(kind)

    def _on_collision(self, found: Collision) -> None:
        self._stream.latch(str(found))
        self._listener.on_collision(found)


def _name() -> str:
    return f"ROS node at {socket.gethostname()}:{os.getpid()}"
