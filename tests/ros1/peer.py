"""A client of a node of ROS 1 with everything that a test needs, and the process of the node."""

from __future__ import annotations

import copy
import os
import signal
import socket
import subprocess
import sys
import sysconfig
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import actionlib
import numpy as np
import rosgraph
import rospy
from actionlib_msgs.msg import GoalStatus
from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryGoal, JointTolerance
from heptarm_msgs.msg import Status
from heptarm_msgs.srv import SetNumber
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, Tolerance, TrajectoryGoal
from heptarm.ros.trajectory.trajectory import KinematicState
from tests.conformance import logs
from tests.conformance.client import ReceivedFeedback, ReceivedResult, SentGoal
from tests.conformance.stage import ROOT, Stage
from tests.doubled import check_lines

#: Time limit of quick operations on a busy machine [s].
PATIENCE = 120.0
#: Watchdogs must not trip within it.
PATIENT = {"watchdog": 5.0, "servo__watchdog": 2.0, "constraints__goal_time": 20.0}
#: Goals that an action client keeps until they are sent. With actionlib's default of 10, a client that sends 20 at
#: once on a busy machine loses the oldest without an error.
QUEUE = 200
PACKAGES = ROOT / "ros1"
NODE = PACKAGES / "heptarm_ros1" / "scripts" / "heptarm_node"


def sources() -> dict[str, str]:
    """Environment in which ROS' own tools find our packages and messages."""
    return {
        "ROS_PACKAGE_PATH": str(PACKAGES),
        "PYTHONPATH": f"{ROOT / 'src'}:{PACKAGES / 'heptarm_ros1' / 'src'}:{sysconfig.get_paths()['purelib']}",
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
    }


def until(what: Callable[[], Any], why: str, timeout: float = PATIENCE) -> Any:
    """Wait until a value is true; return it."""
    deadline = time.monotonic() + timeout
    while time.monotonic() < deadline:
        if value := what():
            return value
        time.sleep(0.005)
    raise TimeoutError(why)


class Core:
    """A private roscore, and this process as a node of it.

    Args:
        name: of the node.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._process: subprocess.Popen[bytes] | None = None
        self._home = tempfile.TemporaryDirectory(prefix="ros1-home-", ignore_cleanup_errors=True)

    def __enter__(self) -> Core:
        try:
            while not self._start():
                pass  # another process was quicker to take the port
            rospy.set_param("/actionlib_client_pub_queue_size", QUEUE)
            rospy.init_node(self._name, disable_signals=True)
        except BaseException:
            self._end()
            raise
        return self

    def _start(self) -> bool:
        """Start a master at a free port; return whether it runs."""
        with socket.socket() as door:
            door.bind(("127.0.0.1", 0))
            port = door.getsockname()[1]
        os.environ.update(
            ROS_MASTER_URI=f"http://127.0.0.1:{port}",
            ROS_HOSTNAME="localhost",
            ROS_HOME=self._home.name,
            ROS_LOG_DIR=self._home.name,
            **sources(),
        )
        process = self._process = subprocess.Popen(
            ["roscore", "-p", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        answered = lambda: rosgraph.is_master_online() or process.poll() is not None  # noqa: E731
        until(answered, "there is no master", 2 * PATIENCE)
        return process.poll() is None

    def __exit__(self, *error: object) -> None:
        rospy.signal_shutdown("it is over")
        self._end()

    def _end(self) -> None:
        if self._process is not None:
            self._process.terminate()
            self._process.wait(PATIENCE)
        self._home.cleanup()


def forget_parameters(name: str) -> None:
    """Delete the parameters of a node."""
    if rospy.has_param(name):
        rospy.delete_param(name)


class NodeProcess:
    """The node as a process of its own."""

    def __init__(self, target: str, name: str = "heptarm", *, ns: str = "/", **values: object) -> None:
        self.log = logs.new()
        forget_parameters(f"{ns.rstrip('/')}/{name}")  # of a node before it: the master would keep them
        command = [sys.executable, str(NODE), f"__name:={name}", f"__ns:={ns}"]
        for key, value in ({"target": target} | PATIENT | values).items():
            command.append(f"_{key.replace('__', '/')}:={value}")
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
            code = self.process.wait(PATIENCE)
            check_lines(self.said)
            return code
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise


def call(name: str, kind: Any, /, **request: object) -> Any:
    """Call a service."""
    rospy.wait_for_service(name, PATIENCE)
    answer = rospy.ServiceProxy(name, kind)(**request)
    check_lines(str(getattr(answer, "message", "")))
    return answer


#: What fills the lists of `collect`.
_collecting: list[rospy.Subscriber] = []


def collect(name: str, kind: Any) -> list[Any]:
    """A list that fills with a topic's messages."""
    found: list[Any] = []
    _collecting.append(rospy.Subscriber(name, kind, found.append, queue_size=100, tcp_nodelay=True))
    return found


def collected() -> int:
    """Number of collected topics."""
    return len(_collecting)


def forget(count: int) -> None:
    """Stop collecting except for the first topics: each costs time with every message."""
    while len(_collecting) > count:
        _collecting.pop().unregister()


def fresh(found: list[Any]) -> Any:
    """A copy of the newest of a topic's messages with headers, measured from now on."""
    now = rospy.Time.now()
    until(lambda: found and found[-1].header.stamp >= now, "nothing new comes")
    return copy.deepcopy(found[-1])


def active(status: list[Status]) -> None:
    """Wait until a node takes commands."""
    until(lambda: status and status[-1].active, "the node is not active")


def publisher(name: str, kind: Any) -> rospy.Publisher:
    """A publisher with a subscriber."""
    one = rospy.Publisher(name, kind, queue_size=1, tcp_nodelay=True)
    until(one.get_num_connections, f"nobody listens to {name}")
    return one


def trajectory(goal: TrajectoryGoal) -> JointTrajectory:
    message = JointTrajectory(joint_names=list(goal.joints))
    if goal.start is not None:
        message.header.stamp = rospy.Time.from_sec(goal.start)
    for point in goal.points:
        message.points.append(
            JointTrajectoryPoint(
                positions=list(point.q),
                velocities=list(point.dq),
                accelerations=list(point.ddq),
                effort=list(point.effort),
                time_from_start=rospy.Duration.from_sec(point.time),
            )
        )
    return message


def _tolerance(one: Tolerance) -> JointTolerance:
    return JointTolerance(
        name=one.joint, position=one.position, velocity=one.velocity, acceleration=one.acceleration
    )


def action_goal(goal: TrajectoryGoal) -> FollowJointTrajectoryGoal:
    return FollowJointTrajectoryGoal(
        trajectory=trajectory(goal),
        path_tolerance=[_tolerance(one) for one in goal.path_tolerance],
        goal_tolerance=[_tolerance(one) for one in goal.goal_tolerance],
        goal_time_tolerance=rospy.Duration.from_sec(goal.goal_time),
    )


def _sample(point: JointTrajectoryPoint) -> KinematicState:
    return KinematicState(
        np.array(point.positions), np.array(point.velocities), np.array(point.accelerations or [0.0] * 7)
    )


class SimpleClient(actionlib.SimpleActionClient):
    """actionlib's simple client, which also hears an answer that comes before its own `send_goal` returns.

    actionlib drops such an answer, and waits for ever (https://github.com/ros/actionlib/issues/206).
    """

    def __init__(self, name: str, action: type) -> None:
        self._sending = threading.RLock()
        super().__init__(name, action)
        assert self.wait_for_server(rospy.Duration.from_sec(PATIENCE))

    def send_goal(self, *args: Any, **kwargs: Any) -> None:
        """Send a goal; its answers are handled afterwards."""
        with self._sending:
            super().send_goal(*args, **kwargs)

    def _handle_transition(self, handle: Any) -> None:
        with self._sending:
            super()._handle_transition(handle)


def stamp(message: Any) -> float:
    """The time stamp of a message with a header [s]."""
    return float(message.header.stamp.to_sec())


class Client:
    """A client for the cases of conformance."""

    preempted: tuple[GoalOutcome, ...] = (GoalOutcome.PREEMPTED,)
    timely = False
    empty_stops = True

    def __init__(self, stage: Stage | None, name: str = "/heptarm", prefix: str = "") -> None:
        self.stage, self.name = stage, name
        self.joints = tuple(f"{prefix}A{i}" for i in range(1, 8))
        namespace = name.rpartition("/")[0]
        self.states = collect(f"{namespace}/joint_states", JointState)
        self.status = collect(f"{name}/status", Status)
        self._action = actionlib.ActionClient(f"{name}/follow_joint_trajectory", FollowJointTrajectoryAction)
        self._topic = rospy.Publisher(f"{name}/joint_trajectory", JointTrajectory, queue_size=1)
        self._reported: dict[int, list[ReceivedFeedback]] = {}
        self._before: dict[str, object] = {}  # of parameters that were changed, by their paths

    def ready(self) -> None:
        """Wait until the node is active and discovery is complete."""
        assert self._action.wait_for_server(rospy.Duration.from_sec(PATIENCE))
        active(self.status)
        until(lambda: self.states, "no joint states come")

    def now(self) -> float:
        return float(rospy.Time.now().to_sec())

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
        handle = self._action.send_goal(
            action_goal(goal), feedback_cb=lambda _, feedback: reported.append(self._telling(feedback))
        )
        status = until(
            lambda: handle.get_goal_status() if handle.get_goal_status() != GoalStatus.PENDING else 0,
            "the goal is neither accepted nor rejected",
        )
        if status == GoalStatus.REJECTED:
            until(lambda: handle.get_result() is not None, "a rejected goal has no result")
            result = handle.get_result()
            assert result.error_string, "a rejection reports why"
            return SentGoal(False, ErrorCode(result.error_code), handle)
        self._reported[id(handle)] = reported
        return SentGoal(True, handle=handle)

    def send_all(self, goals: list[TrajectoryGoal]) -> list[SentGoal]:
        """Send goals without waiting between them; wait until each is accepted or rejected.

        actionlib calls a goal lost that has left the server's list before this process, held up, has read its status;
        such a goal is sent again.
        """
        handles = [self._action.send_goal(action_goal(goal)) for goal in goals]
        for _ in range(5):
            until(
                lambda: all(one.get_goal_status() != GoalStatus.PENDING for one in handles),
                "the goals are neither accepted nor rejected",
            )
            lost = [k for k, one in enumerate(handles) if one.get_goal_status() == GoalStatus.LOST]
            for k in lost:
                handles[k] = self._action.send_goal(action_goal(goals[k]))
            if not lost:
                break
        rejected = [one.get_goal_status() == GoalStatus.REJECTED for one in handles]
        return [SentGoal(not refused, handle=one) for one, refused in zip(handles, rejected)]

    def cancel(self, sent: SentGoal) -> bool:
        handle: Any = sent.handle
        handle.cancel()
        # the next goal is another topic with a thread of its own, and may be quicker
        before = (actionlib.CommState.ACTIVE, actionlib.CommState.WAITING_FOR_CANCEL_ACK)
        until(lambda: handle.get_comm_state() not in before, "cancelling is not answered")
        return True

    def result(self, sent: SentGoal, timeout: float = PATIENCE) -> ReceivedResult:
        handle: Any = sent.handle
        done = actionlib.CommState.DONE
        until(lambda: handle.get_comm_state() == done, "the goal does not end", timeout)
        result = handle.get_result()
        code = ErrorCode(result.error_code)
        outcome = {
            GoalStatus.SUCCEEDED: GoalOutcome.SUCCEEDED,
            GoalStatus.ABORTED: GoalOutcome.ABORTED,
            # one status for two ends; the code distinguishes them
            GoalStatus.PREEMPTED: GoalOutcome.CANCELED
            if code is ErrorCode.SUCCESSFUL
            else GoalOutcome.PREEMPTED,
        }[handle.get_terminal_state()]
        return ReceivedResult(outcome, code, result.error_string)

    def feedback(self, sent: SentGoal) -> list[ReceivedFeedback]:
        return list(self._reported[id(sent.handle)])

    def behave(self, how: str) -> None:
        assert self.stage is not None
        self.stage.do(how)

    def override(self, value: float) -> None:
        answer = call(f"{self.name}/set_override", SetNumber, value=value)
        assert answer.success, answer.message

    def set(self, **values: object) -> bool:
        before = dict(self._before)
        for name, value in values.items():
            path = f"{self.name}/{name.replace('__', '/')}"
            self._before.setdefault(path, rospy.get_param(path, None))
            rospy.set_param(path, value)
        if self.reload():
            return True
        self._restore({path: value for path, value in self._before.items() if path not in before})
        return False

    def _restore(self, values: dict[str, object]) -> None:
        """Restore values of parameters; None: they did not exist."""
        for path, value in values.items():
            if value is None:
                rospy.delete_param(path)
            else:
                rospy.set_param(path, value)
            del self._before[path]

    def reload(self) -> bool:
        """Let the node look at its parameters."""
        return bool(call(f"{self.name}/reload", Trigger).success)

    def reset(self) -> bool:
        """All parameters as they were."""
        self._restore(dict(self._before))
        return self.reload()

    def activate(self, *, on: bool) -> None:
        answer = call(f"{self.name}/{'activate' if on else 'deactivate'}", Trigger)
        assert answer.success, answer.message

    def topic(self, goal: TrajectoryGoal) -> None:
        until(self._topic.get_num_connections, "nobody listens to trajectories")
        self._topic.publish(trajectory(goal))

    @staticmethod
    def _telling(one: Any) -> ReceivedFeedback:
        return ReceivedFeedback(
            tuple(one.joint_names),
            _sample(one.desired),
            _sample(one.actual),
            np.array(one.error.positions),
            one.desired.time_from_start.to_sec(),
            one.actual.time_from_start.to_sec(),
            None,
        )
