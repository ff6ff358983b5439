"""A client of a node of ROS 2 with everything that a test needs, and the process of the node."""

from __future__ import annotations

import copy
import signal
import subprocess
import sys
import threading
import time
import uuid
from collections.abc import Callable, Sequence
from pathlib import PurePosixPath
from typing import Any

import numpy as np
import rclpy
from action_msgs.msg import GoalStatus
from builtin_interfaces.msg import Duration, Time
from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTolerance
from heptarm_msgs.msg import Status
from heptarm_msgs.srv import SetNumber
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from unique_identifier_msgs.msg import UUID

from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, Tolerance, TrajectoryGoal
from heptarm.ros.trajectory.trajectory import KinematicState
from tests.conformance import logs
from tests.conformance.client import ReceivedFeedback, ReceivedResult, SentGoal
from tests.conformance.stage import Stage
from tests.doubled import check_lines

#: Discovery can take some seconds, and a busy machine many more [s].
PATIENCE = 120.0
#: Time limits of a node on a busy machine.
PATIENT: dict[str, Any] = {"servo__watchdog": 2.0, "watchdog": 5.0, "constraints__goal_time": 20.0}
#: Parameters that cases change.
DEFAULTS: dict[str, object] = {
    "max_deceleration_on_cancel": 2.0,
    "allow_nonzero_velocity_at_trajectory_end": False,
    "allow_partial_joints_goal": False,
    "allow_integration_in_goal_trajectories": False,
    "cmd_timeout": 0.0,
    "constraints__goal_time": PATIENT["constraints__goal_time"],
    "constraints__stopped_velocity_tolerance": 0.02,
    "constraints__A7__trajectory": 0.0,
}
OUTCOMES = {
    GoalStatus.STATUS_SUCCEEDED: GoalOutcome.SUCCEEDED,
    GoalStatus.STATUS_ABORTED: GoalOutcome.ABORTED,
    GoalStatus.STATUS_CANCELED: GoalOutcome.CANCELED,
}


def until(what: Callable[[], Any], why: str, timeout: float = PATIENCE) -> Any:
    """Wait until a value is true; return it."""
    deadline = time.monotonic() + timeout
    while time.monotonic() < deadline:
        if value := what():
            return value
        time.sleep(0.005)
    raise TimeoutError(why)


class NodeProcess:
    """The node as users start it, with parameters or the words of a launch file, in a process of its own."""

    def __init__(
        self,
        target: str,
        *,
        name: str = "heptarm",
        space: str = "/",
        words: Sequence[str] = (),
        **values: object,
    ) -> None:
        self.log = logs.new()
        command = [sys.executable, "-m", "heptarm_ros2.main"]
        command += words or ["--ros-args", "-r", f"__node:={name}", "-r", f"__ns:={space}"]
        if not words:
            for key, value in ({"target": target} | values).items():
                command += ["-p", f"{key.replace('__', '.')}:={value}"]
        with self.log.open("w") as log:
            self.process = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)

    @property
    def said(self) -> str:
        """Its log."""
        return self.log.read_text()

    def waits_for(self, text: str) -> None:
        """Wait until its log contains a text."""
        until(lambda: text in self.said or self.process.poll() is not None, f"the node does not say {text!r}")
        assert text in self.said, self.said

    def end(self, number: int = signal.SIGINT) -> int:
        """End it; returns its exit code."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            return self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.wait()

    def finish(self) -> None:
        """End it and check its exit code."""
        code = self.end()
        print(self.said)
        assert code == 0, self.said
        check_lines(self.said)


class Ros:
    """A context of ROS 2 with a node and a thread that serves it; ends in order."""

    def __init__(self, name: str = "tester") -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node(name, context=self.context)
        self._clients: dict[str, Any] = {}
        self._actions: dict[str, ActionClient[Any, Any, Any]] = {}
        self._collected: list[Any] = []
        self._feedback: dict[bytes, Callable[[Any], None]] = {}  # what takes it, by goals
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self._over: Future[None] = Future()
        self._thread = threading.Thread(target=self._executor.spin_until_future_complete, args=(self._over,))
        self._thread.start()

    @property
    def serves(self) -> bool:
        """Whether the thread still serves the node; an error of a callback ends it."""
        return self._thread.is_alive()

    def wait(self, future: Any, why: str, timeout: float = PATIENCE) -> Any:
        """Wait for the result of a future."""
        until(lambda: future.done() or not self.serves, why, timeout)
        assert future.done(), f"{why}: the node of the tests is served no more"
        return future.result()

    def do(self, action: Callable[..., Any], *given: Any, **named: Any) -> Any:
        """Let the executor's thread do something, and return what it returns.

        Whatever makes or destroys a part of the node is done so: rclpy shows a client to the executor before it is
        complete, and its wait in Fast DDS may crash while another thread changes the node.
        """
        done = self._executor.create_task(action, *given, **named)
        return self.wait(done, f"{action.__name__} does not end")

    def act(self, kind: type, name: str) -> ActionClient[Any, Any, Any]:
        """A client of an available action."""
        if name not in self._actions:
            many = QoSProfile(depth=100)  # by default more than ten answers at once are lost
            self._actions[name] = self.do(ActionClient, self.node, kind, name, goal_service_qos_profile=many)
            until(self._actions[name].server_is_ready, f"there is no action {name}")
            topic, message = f"{name}/_action/feedback", kind.Impl.FeedbackMessage  # type: ignore[attr-defined]
            self.do(self.node.create_subscription, message, topic, self._on_feedback, 1000)
            self.meet(name)
        client = self._actions[name]
        until(client.server_is_ready, f"there is no action {name}")
        return client

    def _on_feedback(self, message: Any) -> None:
        take = self._feedback.get(bytes(message.goal_id.uuid))
        if take is not None:
            take(message.feedback)

    def send_goals(
        self, client: Any, goals: Sequence[Any], feedback: Callable[[Any], None] | None = None
    ) -> list[Any]:
        """Send goals without waiting between them; returns the futures of their handles.

        rclpy replaces a future after it has sent the goal, so an answer is lost that another thread takes in between:
        the executor's thread has to send. rclpy also drops feedback that waits when the result is taken, so that is
        taken from the topic itself; it may arrive after the result.
        """
        numbers = [uuid.uuid4().bytes for _ in goals]
        if feedback is not None:
            self._feedback.update(dict.fromkeys(numbers, feedback))

        def send() -> list[Any]:
            return [
                client.send_goal_async(goal, goal_uuid=UUID(uuid=list(number)))
                for goal, number in zip(goals, numbers)
            ]

        return list(self.do(send))

    def send_goal(self, client: Any, goal: Any, feedback: Callable[[Any], None] | None = None) -> Any:
        """Send a goal; returns its handle when it is accepted or rejected."""
        (answer,) = self.send_goals(client, [goal], feedback)
        return self.wait(answer, "the goal is neither accepted nor rejected")

    def publisher(self, kind: type, name: str, *, latched: bool = False) -> Any:
        """A publisher whose messages arrive: its subscriber has discovered it, too, or gets them then."""
        if latched:
            profile = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
            return self.do(self.node.create_publisher, kind, name, profile)
        made = self.do(self.node.create_publisher, kind, name, 1)
        until(made.get_subscription_count, f"nobody listens to {name}")
        self.meet(name)
        return made

    def find(self, kind: type, name: str) -> Any:
        """A client of an available service."""
        if name not in self._clients:
            self._clients[name] = self.do(self.node.create_client, kind, name)
            self.meet(name)
        client = self._clients[name]
        until(client.service_is_ready, f"there is no service {name}")
        return client

    def meet(self, name: str) -> None:
        """Wait until the node of a name has discovered all clients, publishers and subscriptions of this process.

        A client knows that it has discovered a server, but not whether the server has discovered it, and until then
        answers and messages are lost. Discovery goes in the order in which clients are made. So one that is made now
        asks for nothing, and again after a second: when it is answered, all those before it can be.
        """
        nodes = [f"{above}/get_parameters" for above in map(str, PurePosixPath(name).parents)]

        def parameters() -> str:
            there = [service for service, _ in self.node.get_service_names_and_types()]
            near = (one for one in there if PurePosixPath(one).parts[1:2] == PurePosixPath(name).parts[1:2])
            others = (one for one in near if one.endswith("/get_parameters"))  # with a name of another driver
            return next((one for one in nodes if one in there), "") or next(others, "")

        service, probe = "", None
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            found = until(parameters, f"no node with {name} is there")
            # the first one found may have ended: its name stays for a while
            if probe is None or found != service:
                if probe is not None:
                    self.do(self.node.destroy_client, probe)
                service, probe = found, self.do(self.node.create_client, GetParameters, found)
            asked = probe.call_async(GetParameters.Request())
            try:
                self.wait(asked, "no answer", timeout=1.0)
                break
            except TimeoutError:
                probe.remove_pending_request(asked)
        else:
            raise TimeoutError(f"{service} does not answer")
        self.do(self.node.destroy_client, probe)

    def call(self, kind: type, name: str, request: Any) -> Any:
        """Call a service."""
        return self.wait(self.find(kind, name).call_async(request), f"{name} does not answer")

    def collect(self, kind: type, name: str, *, latched: bool = False) -> list[Any]:
        """A list that fills with a topic's messages."""
        found: list[Any] = []
        durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
        profile = QoSProfile(depth=100, durability=durability)
        self._collected.append(self.do(self.node.create_subscription, kind, name, found.append, profile))
        return found

    def forget(self, count: int) -> None:
        """Stop collecting except for the first topics: each costs time with every message."""
        while len(self._collected) > count:
            self.do(self.node.destroy_subscription, self._collected.pop())

    @property
    def collected(self) -> int:
        """Number of collected topics."""
        return len(self._collected)

    def close(self) -> None:
        """End it; an executor must not be shut down while a thread is in it."""
        self._over.set_result(None)
        self._thread.join()
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


def to_time(seconds: float) -> Time:
    nanos = round(seconds * 1e9)
    return Time(sec=nanos // 10**9, nanosec=nanos % 10**9)


def to_duration(seconds: float) -> Duration:
    nanos = round(seconds * 1e9)
    return Duration(sec=nanos // 10**9, nanosec=nanos % 10**9)


def trajectory(goal: TrajectoryGoal) -> JointTrajectory:
    message = JointTrajectory(joint_names=list(goal.joints))
    if goal.start is not None:
        message.header.stamp = to_time(goal.start)
    for point in goal.points:
        message.points.append(
            JointTrajectoryPoint(
                positions=list(point.q),
                velocities=list(point.dq),
                accelerations=list(point.ddq),
                effort=list(point.effort),
                time_from_start=to_duration(point.time),
            )
        )
    return message


def _tolerance(one: Tolerance) -> JointTolerance:
    return JointTolerance(
        name=one.joint, position=one.position, velocity=one.velocity, acceleration=one.acceleration
    )


def action_goal(goal: TrajectoryGoal) -> FollowJointTrajectory.Goal:
    message = FollowJointTrajectory.Goal(trajectory=trajectory(goal))
    message.path_tolerance = [_tolerance(one) for one in goal.path_tolerance]
    message.goal_tolerance = [_tolerance(one) for one in goal.goal_tolerance]
    message.goal_time_tolerance = to_duration(goal.goal_time)
    if "multi_dof_trajectory" in goal.extras:
        message.multi_dof_trajectory.joint_names = ["base"]
    return message


def _sample(point: JointTrajectoryPoint) -> KinematicState:
    return KinematicState(
        np.array(point.positions), np.array(point.velocities), np.array(point.accelerations or [0.0] * 7)
    )


def _seconds(message: Any) -> float:
    return float(message.sec + message.nanosec * 1e-9)


def stamp(message: Any) -> float:
    """The time stamp of a message with a header [s]."""
    return _seconds(message.header.stamp)


def _value(value: object) -> ParameterValue:
    if isinstance(value, bool):
        return ParameterValue(type=ParameterType.PARAMETER_BOOL, bool_value=value)
    if isinstance(value, str):
        return ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=value)
    if isinstance(value, int):
        return ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=value)
    assert isinstance(value, float)
    return ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)


def parameter(name: str, value: object) -> Parameter:
    """A parameter to set."""
    return Parameter(name=name, value=_value(value))


def fresh(ros: Ros, found: list[Any]) -> Any:
    """A copy of the newest of a topic's messages with headers, measured from now on."""
    now = ros.node.get_clock().now().nanoseconds * 1e-9
    until(lambda: found and stamp(found[-1]) >= now, "nothing new comes")
    return copy.deepcopy(found[-1])


class Client:
    """A client for the cases of conformance."""

    preempted: tuple[GoalOutcome, ...] = (GoalOutcome.ABORTED,)
    timely = False
    empty_stops = False

    def __init__(
        self,
        ros: Ros,
        stage: Stage | None,
        name: str = "/heptarm",
        prefix: str = "",
    ) -> None:
        self.ros, self.stage, self.name = ros, stage, name
        self.joints = tuple(f"{prefix}A{i}" for i in range(1, 8))
        self.states = ros.collect(JointState, f"{name.rpartition('/')[0]}/joint_states")
        self.status = ros.collect(Status, f"{name}/status", latched=True)
        self._topic = ros.do(ros.node.create_publisher, JointTrajectory, f"{name}/joint_trajectory", 1)
        self._reported: dict[int, list[ReceivedFeedback]] = {}
        self._changed: set[str] = set()
        self._how, self._override = "follows", 1.0

    def ready(self) -> None:
        """Wait until the node is active and discovery is complete."""
        _ = self._action
        self.ros.meet(f"{self.name}/status")  # a node that has started again has to discover this client, too
        until(lambda: self.states and self.status and self.status[-1].active, "the node is not active")

    @property
    def _action(self) -> ActionClient[Any, Any, Any]:
        return self.ros.act(FollowJointTrajectory, f"{self.name}/follow_joint_trajectory")

    def now(self) -> float:
        return float(self.ros.node.get_clock().now().nanoseconds * 1e-9)

    def sleep(self, seconds: float) -> None:
        time.sleep(seconds)

    def place(self) -> KinematicState:
        now = self.now()  # a busy machine may still be handing over older ones
        until(lambda: self.states and stamp(self.states[-1]) >= now, "no joint states come")
        message = self.states[-1]
        assert tuple(message.name) == self.joints
        return KinematicState(np.array(message.position), np.array(message.velocity), np.zeros(7))

    def track(self, begin: float) -> list[tuple[float, Any]]:
        found = [(stamp(message), message) for message in list(self.states)]
        return [(time, np.array(message.position)) for time, message in found if time >= begin]

    def send(self, goal: TrajectoryGoal) -> SentGoal:
        reported: list[ReceivedFeedback] = []
        handle = self.ros.send_goal(
            self._action, action_goal(goal), lambda one: reported.append(self._telling(one))
        )
        if not handle.accepted:
            return SentGoal(False)
        self._reported[id(handle)] = reported
        return SentGoal(True, handle=(handle, handle.get_result_async()))

    def send_all(self, goals: list[TrajectoryGoal]) -> list[SentGoal]:
        """Send goals without waiting between them; wait until each is accepted or rejected."""
        futures = self.ros.send_goals(self._action, [action_goal(goal) for goal in goals])
        handles = [self.ros.wait(future, "a goal is neither accepted nor rejected") for future in futures]
        return [SentGoal(handle.accepted, handle=handle) for handle in handles]

    def cancel(self, sent: SentGoal) -> bool:
        handle, _ = sent.handle
        answer = self.ros.wait(handle.cancel_goal_async(), "cancelling is not answered")
        return bool(answer.goals_canceling)

    def result(self, sent: SentGoal, timeout: float = PATIENCE) -> ReceivedResult:
        _, future = sent.handle
        answer = self.ros.wait(future, "the goal does not end", timeout)
        return ReceivedResult(
            OUTCOMES[answer.status], ErrorCode(answer.result.error_code), answer.result.error_string
        )

    def feedback(self, sent: SentGoal) -> list[ReceivedFeedback]:
        handle, _ = sent.handle
        return list(self._reported[id(handle)])

    def restore(self) -> None:
        """Undo what a case has changed."""
        if self._how != "follows":
            self.behave("follows")
        if self._override != 1.0:
            self.override(1.0)
        if self._changed:
            assert self.set(**{name: DEFAULTS[name] for name in self._changed if name in DEFAULTS})
            self._changed.clear()

    def behave(self, how: str) -> None:
        assert self.stage is not None
        self._how = how
        self.stage.do(how)

    def override(self, value: float) -> None:
        self._override = value
        answer = self.ros.call(SetNumber, f"{self.name}/set_override", SetNumber.Request(value=value))
        assert answer.success, answer.message

    def set(self, **values: object) -> bool:
        self._changed |= values.keys()
        request = SetParameters.Request(
            parameters=[parameter(name.replace("__", "."), value) for name, value in values.items()]
        )
        answer = self.ros.call(SetParameters, f"{self.name}/set_parameters", request)
        return all(one.successful for one in answer.results)

    def activate(self, *, on: bool) -> None:
        wanted = Transition.TRANSITION_ACTIVATE if on else Transition.TRANSITION_DEACTIVATE
        assert self.change(wanted)

    def change(self, transition: int) -> bool:
        """Ask for a transition of the life cycle."""
        request = ChangeState.Request(transition=Transition(id=transition))
        return bool(self.ros.call(ChangeState, f"{self.name}/change_state", request).success)

    def life(self) -> str:
        """The state of the node's life."""
        answer = self.ros.call(GetState, f"{self.name}/get_state", GetState.Request())
        return str(answer.current_state.label)

    def topic(self, goal: TrajectoryGoal) -> None:
        until(self._topic.get_subscription_count, "nobody listens to trajectories")
        self._topic.publish(trajectory(goal))

    @staticmethod
    def _telling(one: FollowJointTrajectory.Feedback) -> ReceivedFeedback:
        return ReceivedFeedback(
            tuple(one.joint_names),
            _sample(one.desired),
            _sample(one.actual),
            np.array(one.error.positions),
            _seconds(one.desired.time_from_start),
            _seconds(one.actual.time_from_start),
            one.index if hasattr(one, "index") else None,
        )
