"""One arm behind a node: its connection, goals, motions and servo topics, and which of them may move it."""

from __future__ import annotations

import contextlib
import importlib.util
import logging
import os
import socket
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Literal, Protocol

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.arm.connect import connect
from heptarm.arm.link.state_stream import GROUPS
from heptarm.arm.link.target import parse_target
from heptarm.arm.motion.handle import MotionHandle
from heptarm.errors import ConnectFailed, HeptarmError, NotReady
from heptarm.model.kinematics import forward
from heptarm.ros.node.collision_guard import CollisionReaction
from heptarm.ros.node.destination import Destination, DestinationKeeper
from heptarm.ros.node.diagnostics import Diagnosis, diagnose
from heptarm.ros.node.fri_session import NodeFriSession
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.ros.node.state_feed import ReconnectingStates
from heptarm.ros.node.target_stream import StreamLimits, TargetStream
from heptarm.ros.node.task import ArmTask
from heptarm.ros.node.transforms import Transforms
from heptarm.ros.trajectory.check import check_form
from heptarm.ros.trajectory.execution import Execution, GoalListener
from heptarm.ros.trajectory.fri_execution import FriExecution
from heptarm.ros.trajectory.goal import GoalRefused, GoalResult, TrajectoryGoal, TrajectoryPoint
from heptarm.ros.trajectory.point_stream import is_streamed
from heptarm.ros.trajectory.runner import ExecutionSettings, GoalFeedback
from heptarm.ros.trajectory.send_times import PublishInfo
from heptarm.ros.trajectory.servo_execution import ServoExecution
from heptarm.ros.trajectory.spline_execution import SplineExecution
from heptarm.ros.trajectory.trajectory import TrajectorySample
from heptarm.skills.control import keep_control
from heptarm.values.checks import Array
from heptarm.values.condition.collision import Collision
from heptarm.values.condition.condition import Condition
from heptarm.values.condition.reaction import Reaction
from heptarm.values.frames import TOOL
from heptarm.values.mode.mode import Mode
from heptarm.values.motion.motion import Motion
from heptarm.values.pose import Pose
from heptarm.values.result import MotionEvent
from heptarm.values.state import State


class DriverListener(GoalListener, Protocol):
    """Receives all events, from the driver's threads; it must not block."""

    def on_state(self, state: State) -> None:
        """New robot state."""
        ...

    def on_link(self, error: str) -> None:
        """Connected (empty), or why the connection was lost."""
        ...

    def on_key(self, slot: int, down: bool) -> None:
        """A user key of the smartPAD was pressed or released."""
        ...

    def on_event(self, number: int, event: MotionEvent) -> None:
        """Event of the program with that number."""
        ...

    def on_collision(self, found: Collision) -> None:
        """The collision guard detected a collision."""
        ...

    def on_arrival(self) -> None:
        """The arm is at the destination of `Driver.go_to`, or `Driver.announce_arrival` was called."""
        ...


_log = logging.getLogger("heptarm.ros")

#: How long a motion may take to come to rest before a goal [s].
_REST_TIMEOUT = 5.0
#: Results of goals that are kept for those that wait for them.
_MOST_RESULTS = 32
#: When the arm is to be at a streamed position that has no time [s].
_STREAM_AHEAD = 0.01
#: Repetitions of the target on the way to a destination within `command_timeout`.
_REPETITIONS = 4
#: How near the set-point is to a destination that is reached: joints and angle [rad], position [m].
_AT_ANGLE, _AT_POSITION = 1e-3, 5e-4


class Driver:
    """One arm behind a node.

    Args:
        configuration: the node's parameters.
        listener: receives all events.
        clock: the time of ROS [s].

    Attributes:
        configuration: current parameters of the node.
        fri: the FRI session that services open.
        collisions: the collision guard.
        transforms: frames of /tf; None: the parameter `tf_frames` is off.

    Raises:
        ConnectFailed: the cabinet does not answer.
        NotInControl: another client controls the robot.
        LimitError: the parameter `servo.posture` is outside the limits of the joints.
    """

    def __init__(
        self,
        configuration: NodeConfiguration,
        listener: DriverListener,
        *,
        clock: Callable[[], float] = time.time,
    ) -> None:
        values = configuration.values
        self.configuration = configuration
        self._listener = listener
        self._active = False
        self._handles: list[MotionHandle] = []  # of the programs that run or wait, oldest first
        self._starting = threading.Lock()  # messages and goals come in several threads
        # another one with each stop and deactivation: what was requested before one must not begin after it
        self._stop = object()
        self._is_stopping = False  # the motion of a goal that was stopped may still be open
        self._beginning = threading.Lock()  # of goals and tasks; held only for a moment, for `stop` needs it
        self._task: ArmTask | None = None
        self._results: dict[int, GoalResult] = {}
        self._has_result = threading.Condition()
        _check_simulator(values["target"])
        with contextlib.ExitStack() as undo:  # a node tries again, so what fails must not keep control
            self._arm = connect(
                values["target"] or None,
                key_file=values["key_file"] or None,
                state_rate=values["state_rate"],
                name=_name(),
                groups=(*GROUPS, "io") if values["publish_signals"] else GROUPS,
                watchdog=values["watchdog"],
                datagrams=values["datagrams"],
                flange=values["flange"] or None,
            )
            undo.callback(self._arm.close)
            self._stream = TargetStream(
                self._arm,
                timeout=values["command_timeout"],
                options=configuration.servo,
                shortest=values["servo.min_trajectory_time"],
                line_speed=values["servo.line_speed"],
                turn_speed=values["servo.turn_speed"],
                elbow=values["servo.elbow"],
                posture=configuration.posture,
            )
            self._arm.pad.on_key(listener.on_key)
            self.fri = NodeFriSession(self._arm)
            self.transforms = Transforms(clock) if values["tf_frames"] else None
            self.collisions = CollisionReaction(self._arm, notify=self._on_collision, start=self.start)
            self._last_feedback = (0, 0.0)  # number of its goal, and its time
            self._execution = self._make_execution()
            undo.callback(self._execution.close)
            self._destinations = DestinationKeeper(
                self._stream,
                lambda: self.state,
                period=values["command_timeout"] / _REPETITIONS,
                arrived=listener.on_arrival,
            )
            self._feed = ReconnectingStates(self._arm, on_state=self._on_state, on_link=listener.on_link)
            undo.pop_all()

    def _make_execution(self) -> Execution:
        """Make the execution that the parameters select."""
        config, settings = self.configuration, self._settings()
        if config.values["execution"] == "spline":
            speed = config.values["servo.speed"]
            return SplineExecution(self._arm, config.joints, self, speed=speed, settings=settings)
        if config.values["execution"] == "fri":
            return FriExecution(self._arm, config.joints, self, options=config.fri, settings=settings)
        return ServoExecution(self._arm, config.joints, self, options=config.servo, settings=settings)

    def _settings(self) -> ExecutionSettings:
        """How goals are executed, by the parameters and the present speed limit of the arm."""
        settings = self.configuration.settings
        if self.configuration.values["execution"] != "servo":
            return settings  # a spline takes longer, and the speed limit is none of FRI
        ceiling = min(settings.rules.speed, self._arm.speed)  # a faster goal is refused, not followed late
        return replace(settings, rules=replace(settings.rules, speed=ceiling))

    # -------------------------------------------------------------------------------- life cycle

    @property
    def arm(self) -> Arm:
        """The arm."""
        return self._arm

    @property
    def link_error(self) -> str:
        """Why there is no connection; empty: connected."""
        return self._feed.link_error

    @property
    def active(self) -> bool:
        """Whether goals and commands are accepted."""
        return self._active

    def activate(self) -> None:
        """Accept goals and commands."""
        self._active = True

    def deactivate(self) -> None:
        """Accept nothing more, and bring the arm to rest."""
        self._active, self._stop = False, object()
        self._end_task("the node was deactivated")
        self._execution.abort("the node was deactivated")
        self._stream.close()
        self.fri.close()
        with self._starting:
            moving = bool(self._unfinished())
        if moving:
            try:
                self._arm.stop()
            except HeptarmError as error:
                _log.warning("deactivating: %s", error)
        self._execution.wait_idle(_REST_TIMEOUT)

    def close(self) -> None:
        """Leave the arm at rest and disconnect. Closing twice is legal."""
        if self._feed.ended:
            return
        self.deactivate()
        self._feed.end()
        self.collisions.disable()
        self._destinations.close()
        self._execution.close()
        self._arm.close()
        self._feed.join()

    def configure(self, configuration: NodeConfiguration) -> None:
        """Apply changed parameters, of those that apply at once."""
        self.configuration = configuration
        self._execution.settings = self._settings()

    @property
    def state(self) -> State | None:
        """Newest state; None: not connected, or none received yet."""
        if self.link_error:
            return None
        try:
            return self._arm.state
        except HeptarmError:
            return None

    def diagnosis(self) -> Diagnosis:
        """Diagnose the arm."""
        try:
            state, datagrams = self._arm.state, self._arm.connection.datagrams
        except HeptarmError as error:
            return diagnose(None, link_error=self.link_error or str(error), active=self._active)
        return diagnose(
            state, link_error=self.link_error, active=self._active, age=state.age, datagrams=datagrams
        )

    def _on_state(self, state: State) -> None:
        if self._execution.goal:
            safety = state.groups.safety
            if safety is not None and (safety.emergency_stop or safety.protective_stop):
                # the time of the goal would stand still, and the arm would continue unexpectedly after the stop
                self._execution.drop(diagnose(state).text)
        self._listener.on_state(state)

    # ------------------------------------------------------------------------------------ goals

    @property
    def now(self) -> float:
        """Current time on the clock of goal starts [s]."""
        return self._execution.now

    def accept(self, goal: TrajectoryGoal) -> int:
        """Accept a goal of FollowJointTrajectory, after bringing any other motion to rest.

        Returns:
            Its number.

        Raises:
            GoalRefused: it is invalid, the node is not active, or the arm cannot follow.
        """
        if not self._active:
            raise GoalRefused("the node is not active", hint="activate it")
        if self.link_error:
            raise GoalRefused(f"no connection: {self.link_error}")
        last_stop = self._stop
        goal = goal.renamed(self.configuration.own)
        self._execution.settings = self._settings()  # the speed limit may have changed
        # what is malformed must not end another motion
        check_form(goal, self.configuration.joints, self._execution.settings.rules)
        try:
            if is_streamed(goal, self.now):
                self._stream.admit()
            self._check_ready()
            self._regain_control()
            self._end_motions("preempted by a trajectory")
            self._wait_for_stop()
            with self._beginning:
                self._check_not_stopped(last_stop)
                return self._execution.accept(goal)
        except GoalRefused:
            raise
        except HeptarmError as error:
            raise GoalRefused(str(error)) from error

    def run_task(self, name: str, work: Callable[[], object]) -> ArmTask:
        """Run a function that moves the arm several times, after bringing any other motion to rest.

        Args:
            name: what it does, for messages, such as "the touch".
            work: the function.

        Raises:
            HeptarmError: refused; the text gives the reason.
        """
        last_stop = self._stop
        self._check_active()
        self._check_ready()
        self._execution.abort(f"preempted by {name}")
        self._execution.wait_idle(_REST_TIMEOUT)
        self._end_motions(f"preempted by {name}")
        with self._beginning:
            self._check_not_stopped(last_stop)
            self._task = ArmTask(self._arm, name, work)
            return self._task

    def _end_motions(self, reason: str) -> None:
        """Bring to rest what moves the arm besides goals."""
        self._end_task(reason)
        self._stream.close()
        with self._starting:  # a motion that the cabinet is about to accept runs, too
            handles = self._unfinished()
        for handle in reversed(handles):  # a waiting one must not begin when the one before it ends
            handle.cancel()
        if handles:
            self._arm.wait_for_rest(timeout=_REST_TIMEOUT)

    def _unfinished(self) -> list[MotionHandle]:
        """Programs that run or wait, oldest first; under the lock."""
        self._handles = [handle for handle in self._handles if not handle.done]
        return self._handles

    def _end_task(self, reason: str) -> None:
        if self._task is not None:
            self._task.end(reason)

    def _wait_for_stop(self) -> None:
        """Wait until a stop has ended the motion of the last goal: a new goal must not begin in that motion."""
        if self._is_stopping:
            if not self._execution.wait_idle(_REST_TIMEOUT):
                raise NotReady(
                    f"the last goal was stopped, and its motion has not ended within {_REST_TIMEOUT:g} s",
                    hint="request it again when the arm rests",
                )
            self._is_stopping = False

    def _check_not_stopped(self, last_stop: object) -> None:
        """Refuse what was requested before a stop and would begin after it; `last_stop` is that before the request."""
        if self._stop is not last_stop:
            raise NotReady("the arm was stopped meanwhile", hint="request it again")

    def at(self, time: float) -> TrajectorySample | None:
        """Evaluate the active goal at a time on the clock of `now` [s]; None: there is none at that time."""
        return self._execution.at(time)

    def cancel(self, number: int) -> bool:
        """Cancel a goal; the arm brakes. False: it is not active."""
        return self._execution.cancel(number)

    def end_trajectory(self) -> None:
        """Cancel the active goal of any client; without one stop what moves the arm."""
        if not self._execution.cancel(self._execution.goal):
            self.stop()

    def on_feedback(self, feedback: GoalFeedback) -> None:
        """Forward feedback of the execution at the rate of the parameter `action_monitor_rate`."""
        number, time = self._last_feedback
        period = 1.0 / self.configuration.values["action_monitor_rate"]
        if number != feedback.number or self.now - time >= period:
            self._last_feedback = feedback.number, self.now
            self._listener.on_feedback(feedback)

    def on_result(self, result: GoalResult) -> None:
        """Forward a result of the execution."""
        with self._has_result:
            self._results[result.number] = result
            while len(self._results) > _MOST_RESULTS:
                del self._results[min(self._results)]
            self._has_result.notify_all()
        self._listener.on_result(result)

    def result(self, number: int, *, timeout: float) -> GoalResult | None:
        """Wait for the result of a goal, of one of the last ones; None: it has none within `timeout` [s]."""
        with self._has_result:
            self._has_result.wait_for(lambda: number in self._results, timeout)
            return self._results.get(number)

    def _check_ready(self) -> None:
        safety = self._arm.state.groups.safety
        if safety is not None and (safety.emergency_stop or safety.protective_stop):
            raise NotReady("a safety stop is active", hint=diagnose(self._arm.state).text)

    def _regain_control(self) -> None:
        """Take control again if it was lost during a short silence and no other client has taken it."""
        if keep_control(self._arm):
            _log.warning("took control again")

    # --------------------------------------------------------------------------------- commands

    def start(
        self,
        motion: Motion | Sequence[Motion],
        *,
        mode: Mode | None = None,
        speed: float | None = None,
        until: Condition | None = None,
        then: Reaction | None = None,
        when: Literal["queue", "replace", "reject"] = "replace",
    ) -> MotionHandle:
        """Start a motion, or several as one program.

        Args:
            motion: one or more.
            mode: control mode; None: the one that the services have set.
            speed: speed limit for this one, (0, 1]; None: that of the parameter `speed`.
            until: condition that ends it; None: that of `guard`.
            then: reaction to it; None: stay.
            when: while another motion runs: "replace" it, "queue" behind it, or "reject" this one.

        Raises:
            HeptarmError: refused; the text gives the reason.
        """
        last_stop = self._stop
        self._check_active()
        if when == "replace":
            self._end_task("preempted by a command")
            self._execution.abort("preempted by a command")
            self._stream.close()
        self._check_no_task()
        limit = self.configuration.values["speed"] if speed is None else speed
        condition = self.guard if until is None else until
        with self._starting:
            self._check_not_stopped(last_stop)
            handle = self._arm.start(motion, mode=mode, speed=limit, until=condition, then=then, when=when)
            self._handles = [*self._unfinished(), handle]
        if self._stop is not last_stop:  # the cabinet may have had the stop before the motion
            handle.cancel()
        handle.add_event_callback(lambda event: self._listener.on_event(handle.id, event))
        return handle

    def follow(self, target: Array | Pose, dq: Array | None = None, *, straight: bool = False) -> None:
        """Follow a target of a servo topic until none arrives for `command_timeout`.

        Args:
            target: joint positions, shape (7,) [rad], or a pose of the flange in the base.
            dq: velocity to pass the joint positions with, shape (7,) [rad/s].
            straight: move to a pose on straight lines.

        Raises:
            HeptarmError: refused; the text gives the reason.
        """
        self._prepare_stream()
        if isinstance(target, Pose):
            self._stream.pose(target, straight=straight)
        else:
            self._stream.joints(target, dq)

    def go_to(
        self,
        target: Array | Pose,
        dq: Array | None = None,
        *,
        straight: bool = False,
        moving: str = TOOL,
        offset: Pose | None = None,
        limits: StreamLimits | None = None,
        stays: bool = False,
    ) -> None:
        """Go to a target of a servo topic, also when no other message comes; then report it.

        Args:
            target: joint positions, shape (7,) [rad], or a pose of the motion frame in the base.
            dq: velocity to pass the joint positions with, shape (7,) [rad/s].
            straight: move to a pose on straight lines.
            moving: the motion frame of a pose, see `Arm.servo`.
            offset: its pose in the flange; None: it is the motion frame of the arm.
            limits: None: those of the parameters.
            stays: the servo motion stays open at the target, as a compliant arm needs.

        Raises:
            HeptarmError: refused; the text gives the reason.
        """
        self._prepare_stream()
        if isinstance(target, Pose):
            pose = self._stream.pose(target, straight=straight, moving=moving, limits=limits)
            robot = self._arm.robot

            def reached(state: State) -> bool:
                here = (
                    state.pose_cmd
                    if offset is None
                    else Pose.from_matrix(forward(robot, state.q_cmd)) @ offset
                )
                return here.distance_to(pose) < _AT_POSITION and here.angle_to(pose) < _AT_ANGLE
        else:
            sent = self._stream.joints(target, dq, limits=limits)

            def reached(state: State) -> bool:
                return bool(np.abs(state.q_cmd - sent).max() < _AT_ANGLE)

        self._destinations.go(Destination(reached, stays))

    def end_stream(self) -> None:
        """End the servo motion of the topics, at rest."""
        self._stream.close()

    def announce_arrival(self) -> None:
        """Report that the arm is where it was to go."""
        self._listener.on_arrival()

    def follow_velocity(self, dq: Array) -> None:
        """Move with joint velocities, shape (7,) [rad/s], until none arrive for `command_timeout`.

        Raises:
            HeptarmError: refused; the text gives the reason.
        """
        self._prepare_stream()
        self._stream.velocity(np.asarray(dq, dtype=np.float64))

    def follow_twist(self, twist: Array, frame: Literal["base", "flange", "tool"] = "base") -> None:
        """Move with a Cartesian velocity until none arrives for `command_timeout`.

        Args:
            twist: velocity and angular velocity of the origin of the flange, of the tool if that is the frame, shape
                (6,) [m/s, rad/s].
            frame: its axes.

        Raises:
            HeptarmError: refused; the text gives the reason.
        """
        self._prepare_stream()
        self._stream.twist(np.asarray(twist, dtype=np.float64), frame)

    def follow_stream(self, q: Array, sent: PublishInfo | None = None) -> None:
        """Follow a stream of joint positions as the trajectory topic does, or as a servo topic where it cannot.

        Args:
            q: shape (7,) [rad].
            sent: when or as which its message was published; None: unknown.

        Raises:
            HeptarmError: refused; the text gives the reason.
        """
        if self.configuration.values["execution"] == "spline":
            self.follow(q)
            return
        point = TrajectoryPoint(_STREAM_AHEAD, tuple(q.tolist()))
        self.accept(TrajectoryGoal(self.configuration.joints, (point,), from_topic=True, sent=sent))

    def _prepare_stream(self) -> None:
        last_stop = self._stop
        self._check_active()
        self._check_no_task()
        self._stream.admit()  # what is refused must not end a goal
        if not self._stream.active:
            if self._execution.busy:
                self._execution.abort("preempted by a servo topic")
            self._execution.wait_idle(_REST_TIMEOUT)
            self._check_not_stopped(last_stop)

    def _check_active(self) -> None:
        if not self._active:
            raise NotReady("the node is not active", hint="activate it")
        self._regain_control()

    def _check_no_task(self) -> None:
        if self._task is not None and not self._task.done:
            raise NotReady(f"{self._task.name} is running", hint="cancel it first")

    # --------------------------------------------------------------------------------- services

    @property
    def guard(self) -> Condition | None:
        """Condition that ends servo topics, and motions without a condition of their own; None: there is none."""
        return self._stream.guard

    @guard.setter
    def guard(self, value: Condition | None) -> None:
        self._stream.guard = value

    def stop(self, kind: Literal["path", "fast", "after_motion"] = "path") -> None:
        """Stop the arm, see `Arm.stop`, and end what is to move it: goals, also before their start, tasks, streams.

        A stream of messages is followed again after a silence of `command_timeout`. A task counts as one motion:
        "after_motion" lets it finish, and goals and streams go on.

        Raises:
            HeptarmError: the arm cannot be stopped; the text gives the reason.
        """
        if kind == "after_motion":
            self._arm.stop(kind)
            return
        self._stop, self._is_stopping = object(), True
        self._stream.hold_off()
        if self._task is not None:
            self._task.expect_end("stopped")
        try:
            self._arm.stop(kind)
        finally:
            with self._beginning:
                self._execution.abort("stopped")
            self._end_task("stopped")

    def _on_collision(self, found: Collision) -> None:
        self._stream.block(str(found))
        self._listener.on_collision(found)


def _check_simulator(target: str) -> None:
    """Refuse to start a simulator where its libraries are missing: a Python with ROS often is not that of heptarm.

    Raises:
        ConnectFailed: they are missing; the text has what to do instead.
    """
    if target and parse_target(target).is_private and importlib.util.find_spec("mujoco") is None:
        raise ConnectFailed(
            f"{target} needs a simulator, which {sys.executable} lacks",
            hint="run `heptarm sim --port 30001` with another Python and set target to sim://127.0.0.1:30001, "
            "or install heptarm[sim] for this one",
        )


def _name() -> str:
    return f"ROS node at {socket.gethostname()}:{os.getpid()}"
