"""The actions of both nodes except trajectories: handlers, and `ACTIONS`, the table of them.

A new action is a function that begins a goal, a row of the table, and usually a class or function that carries it out.
"""

from __future__ import annotations

import contextlib
import queue
import threading
from functools import partial
from math import inf
from typing import Any

from heptarm.arm.motion.handle import MotionHandle
from heptarm.errors import CommandRejected, HeptarmError, NotReady, ShapeError
from heptarm.ros.interface import motions
from heptarm.ros.interface.action import (
    FEEDBACK_PERIOD,
    ActionResult,
    GoalClient,
    GoalWork,
    RosAction,
    result_of_failed_task,
    result_of_motion,
    wait_for_task,
)
from heptarm.ros.interface.calibration import calibrate
from heptarm.ros.interface.conditions import condition_of
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.events import with_triggers
from heptarm.ros.interface.gripper import gripper_command
from heptarm.ros.interface.messages import pose_message
from heptarm.ros.interface.planning.paths import plan_and_execute
from heptarm.ros.interface.program_goal import start_program
from heptarm.ros.trajectory.goal import GoalOutcome
from heptarm.skills.replay import Replay
from heptarm.skills.taps import TapWatch
from heptarm.skills.teaching import trajectory_of
from heptarm.values.checks import within
from heptarm.values.condition.contact import Contact, direction_of
from heptarm.values.frames import TOOL
from heptarm.values.mode.compliance import compliance
from heptarm.values.mode.mode import Mode
from heptarm.values.motion.circle import circ
from heptarm.values.motion.line import lin
from heptarm.values.motion.motion import Motion, hold
from heptarm.values.motion.ptp import ptp
from heptarm.values.motion.spline import spline, spline_joints
from heptarm.values.motion.trajectory import Trajectory
from heptarm.values.pose import Pose
from heptarm.values.result import Cause
from heptarm.values.state import State

#: Default name of a recorded trajectory, and the most that are kept.
_LAST, _MAX_TAUGHT = "last", 100
#: Default tolerance of thinning out a recorded trajectory [rad].
_TOLERANCE = 2e-3
#: How long a cancelled motion may take to end [s].
_BRAKING_TIMEOUT = 10.0
#: Default of the longest wait for the operator's answer [s].
_DIALOG_TIMEOUT = 600.0
#: Defaults of waiting for taps: count, force [N], gap [s], timeout [s].
_TAPS, _TAP_FORCE, _TAP_GAP, _TAP_TIMEOUT = 2, 8.0, 1.0, 60.0


# ------------------------------------------------------------------------------ motions and programs


def move_joints(context: NodeContext, goal: Any) -> GoalWork:
    """Move to joint positions."""
    return _move(context, goal, ptp(motions.positions(context.driver, goal.joint_names, goal.position)))


def move_pose(context: NodeContext, goal: Any) -> GoalWork:
    """Move to a pose."""
    moving = goal.moving or TOOL
    how: dict[str, Any] = {"moving": moving}
    if goal.speed_mps:
        how["speed_mps"] = goal.speed_mps
    if goal.path == motions.LIN_REL:
        return _move(context, goal, motions.offset(goal.pose, how))
    if goal.path == motions.PTP:
        return _move(context, goal, ptp(motions.target_of(goal.pose, context.driver), moving=moving))
    if goal.path == motions.LIN:
        return _move(context, goal, lin(motions.target_of(goal.pose, context.driver), **how))
    if goal.path == motions.CIRC:
        pose = motions.stamped_pose(goal.pose, context.driver)
        return _move(context, goal, circ(motions.stamped_pose(goal.via, context.driver), pose, **how))
    raise CommandRejected(
        f"path must be 0 (PTP), 1 (LIN), 2 (CIRC) or 3 (LIN_REL), got {goal.path}",
        parameter="path",
        value=goal.path,
    )


def move_spline(context: NodeContext, goal: Any) -> GoalWork:
    """Move along a spline."""
    if len(goal.segments) and len(goal.position):
        raise CommandRejected(
            "a spline has either segments or joint positions, got both", parameter="segments", hint="give one"
        )
    if len(goal.position):
        points = motions.joint_points(context.driver, goal.joint_names, goal.position)
        return _move(context, goal, spline_joints(points))
    how: dict[str, Any] = {
        name: getattr(goal, name) for name in ("speed_mps", "acceleration_mps2") if getattr(goal, name)
    }
    segments = [motions.segment_of(segment) for segment in goal.segments]
    return _move(context, goal, spline(segments, moving=goal.moving or TOOL, **how))


def run_program(context: NodeContext, goal: Any) -> GoalWork:
    """Run several motions as one program."""
    return start_program(context, goal, motions.program_of(context.driver, goal.motions))


def _move(context: NodeContext, goal: Any, motion: Motion) -> GoalWork:
    return start_program(context, goal, (with_triggers(motion, goal.triggers),))


# -------------------------------------------------------------------- hand guiding, teaching, replay


def guide(context: NodeContext, goal: Any) -> GoalWork:
    """Let somebody guide the arm by hand."""
    guiding = _GuidingGoal.begin(context, goal)

    def work(client: GoalClient) -> ActionResult:
        end = guiding.run(client)
        return ActionResult(
            end.outcome, end.text, {**end.fields, "position": _position(context)}, end.success
        )

    return work


def teach(context: NodeContext, goal: Any) -> GoalWork:
    """Let somebody guide the arm by hand, and record the trajectory."""
    name = goal.name or _LAST
    if name not in context.taught and len(context.taught) >= _MAX_TAUGHT:
        raise CommandRejected(
            f"at most {_MAX_TAUGHT} trajectories can be kept",
            parameter="name",
            value=name,
            hint="reuse a name",
        )
    tolerance = within(goal.tolerance or _TOLERANCE, "tolerance", 0.0, 1.0, above=True, unit="rad")
    guiding = _GuidingGoal.begin(context, goal)
    return partial(_teach, context, guiding, name, None if goal.whole else tolerance)


def _teach(
    context: NodeContext, guiding: _GuidingGoal, name: str, tolerance: float | None, client: GoalClient
) -> ActionResult:
    """Record until guiding ends, then keep the trajectory; `tolerance`: None keeps every point."""
    end = guiding.run(client)
    if not end.success:
        return end
    try:
        trajectory = trajectory_of(guiding.recorded, context.arm.robot.name)
        if tolerance is not None:
            trajectory = trajectory.trimmed().thinned(tolerance=tolerance)
    except HeptarmError as error:
        outcome = GoalOutcome.CANCELED if end.outcome is GoalOutcome.CANCELED else GoalOutcome.ABORTED
        return ActionResult(outcome, f"{end.text}; {error}", success=False)
    context.taught[name] = trajectory
    fields = {
        **end.fields,
        "name": name,
        "recorded": len(guiding.recorded),
        "trajectory": {
            "joint_names": context.joints,
            "points": [
                context.ros.point(positions=q.tolist(), time_from_start=context.ros.duration(float(t)))
                for t, q in zip(trajectory.times, trajectory.q)
            ],
        },
    }
    text = f"{end.text}; kept {len(trajectory)} points in {trajectory.duration:.1f} s as {name!r}"
    return ActionResult(end.outcome, text, fields, success=True)


def _position(context: NodeContext) -> list[float]:
    try:
        position: list[float] = context.arm.state.q.tolist()
    except HeptarmError:  # connection lost
        return []
    return position


class _GuidingGoal:
    """A goal that makes the arm compliant to a hand, until something ends it.

    Args:
        context: of the node.
        handle: of the motion.
        goal: of the actions guide or teach.

    Attributes:
        recorded: the states since its begin.
    """

    def __init__(self, context: NodeContext, handle: MotionHandle, goal: Any) -> None:
        self.recorded: list[State] = []
        self._arm = context.arm
        self._handle = handle
        self._longest = within(goal.duration, "duration", 0.0, 1e6, unit="s") or inf
        self._key, self._slot = goal.key, goal.slot
        self._pressed = False
        self._begin = 0  # stamp of the first state with the motion running [ns]

    @classmethod
    def begin(cls, context: NodeContext, goal: Any) -> _GuidingGoal:
        """Start the compliant motion of a goal.

        Raises:
            HeptarmError: refused; the text gives the reason.
        """
        within(goal.duration, "duration", 0.0, 1e6, unit="s")  # refuse it before anything moves
        mode: Mode | None = None
        motion: Motion = motions.guiding(goal)
        if goal.free:
            mode, motion = compliance(goal.free, frame=goal.frame or TOOL), hold(inf)
        handle = context.driver.start(motion, mode=mode, until=condition_of(goal.until))
        return cls(context, handle, goal)

    def run(self, client: GoalClient) -> ActionResult:
        """Wait for the end; a goal that its client, the key or the time ends is a success."""
        with contextlib.ExitStack() as stack:
            try:
                if self._key:
                    self._arm.pad.set_key(self._slot, self._key, led="green")
                    stack.callback(self._clear_key)
                    stack.callback(self._arm.pad.on_key(self._on_key))
                why = self._record(client)
            except HeptarmError as error:
                with contextlib.suppress(HeptarmError):
                    self._handle.cancel()
                return ActionResult(GoalOutcome.ABORTED, str(error), success=False)
        with contextlib.suppress(HeptarmError):  # reported by `result_of_motion`
            self._handle.wait(timeout=_BRAKING_TIMEOUT)
        end = result_of_motion(self._handle, cancelled=bool(why))
        if end.outcome is GoalOutcome.CANCELED:
            outcome = GoalOutcome.CANCELED if client.is_cancel_requested() else GoalOutcome.SUCCEEDED
            return ActionResult(outcome, why, end.fields, success=True)
        released = end.outcome is GoalOutcome.SUCCEEDED and not end.fields["stopped_by"]
        text = "the enabling switch was released" if released else end.text
        return ActionResult(end.outcome, text, end.fields, success=end.outcome is GoalOutcome.SUCCEEDED)

    def _record(self, client: GoalClient) -> str:
        """Record states until the motion has ended; returns why this goal ended it, empty: something else did."""
        published = 0
        why = ""
        for state in self._handle.states():  # to its end, also those that are read late
            self.recorded.append(state)
            if state.stamp - published >= FEEDBACK_PERIOD * 1e9:
                published = state.stamp
                self._publish(client, state)
            if not why and (why := self._end_reason(client, state)):
                self._handle.cancel()
        return why

    def _publish(self, client: GoalClient, state: State) -> None:
        held = state.groups.safety is not None and state.groups.safety.hand_guiding_switch
        client.publish_feedback({"position": state.q.tolist(), "held": held, "recorded": len(self.recorded)})

    def _end_reason(self, client: GoalClient, state: State) -> str:
        self._begin = self._begin or (state.stamp if self._handle.started else 0)
        if client.is_cancel_requested():
            return "ended by the client"
        if self._pressed:
            return f"ended by the key {self._key!r}"
        if self._begin and (state.stamp - self._begin) * 1e-9 >= self._longest:
            return f"ended after {self._longest:g} s"
        return ""

    def _on_key(self, slot: int, down: bool) -> None:
        self._pressed = self._pressed or (down and slot == self._slot)

    def _clear_key(self) -> None:
        with contextlib.suppress(HeptarmError):  # connection lost
            self._arm.pad.set_key(self._slot, "", enabled=False)


def replay(context: NodeContext, goal: Any) -> GoalWork:
    """Replay a trajectory."""
    return _ReplayGoal(context, goal).run


class _ReplayGoal:
    """A goal that replays a trajectory in a task."""

    def __init__(self, context: NodeContext, goal: Any) -> None:
        self._progress = 0.0
        driver = context.driver
        until = condition_of(goal.until)
        call = partial(
            context.arm.replay,
            _trajectory(context, goal),
            by=goal.by or "servo",
            speed_scaling=goal.speed_scaling or 1.0,
            until=driver.guard if until is None else until,
            watchdog=driver.configuration.values["servo.watchdog"],
            on_progress=self._on_progress,
            **({"approach": goal.approach} if goal.approach else {}),
        )
        self._task = driver.run_task("the replay", call)

    def _on_progress(self, progress: float) -> None:
        self._progress = progress

    def run(self, client: GoalClient) -> ActionResult:
        """Wait for the end of the replay."""

        def report() -> None:
            client.publish_feedback({"progress": self._progress})

        error = wait_for_task(self._task, client, report)
        if error is not None:
            return result_of_failed_task(self._task, client, error)
        report()
        replay: Replay = self._task.result()
        result = replay.result
        fields: dict[str, Any] = {"deviation": replay.deviation, "lag": replay.lag}
        if result.cause is Cause.CONDITION:
            condition = "the condition" if result.stopped_by is None else str(result.stopped_by)
            fields["stopped_by"] = condition
            return ActionResult(GoalOutcome.SUCCEEDED, f"ended by {condition}", fields)
        if result.cause is not Cause.FINISHED:
            return ActionResult(GoalOutcome.ABORTED, f"the replay was {result.cause.value}", fields)
        return ActionResult(GoalOutcome.SUCCEEDED, "replay finished", fields)


def _trajectory(context: NodeContext, goal: Any) -> Trajectory:
    """Look up the trajectory of a goal, or convert the one that it brings."""
    points = goal.trajectory.points
    if not len(points):
        name = goal.name or _LAST
        if name not in context.taught:
            raise CommandRejected(
                f"unknown trajectory {name!r}",
                parameter="name",
                value=name,
                allowed=", ".join(sorted(context.taught)) or "none",
                hint="teach it, or send a trajectory",
            )
        return context.taught[name]
    names = goal.trajectory.joint_names
    return Trajectory.of(
        [context.ros.seconds(point.time_from_start) for point in points],
        [motions.positions(context.driver, names, point.positions) for point in points],
    )


# ------------------------------------------------------------------------------- contacts and taps


def touch(context: NodeContext, goal: Any) -> GoalWork:
    """Move along a line until contact."""
    return _TouchGoal(context, goal).run


class _TouchGoal:
    """A goal that touches, once or twice, in a task."""

    def __init__(self, context: NodeContext, goal: Any) -> None:
        self._context = context
        vector = [goal.vector.x, goal.vector.y, goal.vector.z]
        if goal.direction and any(vector):
            raise ShapeError(
                "direction and vector exclude each other, got both", parameter="vector", hint="give one"
            )
        direction = direction_of(goal.direction or (vector if any(vector) else "z"))
        how: dict[str, Any] = {
            "distance": goal.distance,
            "force": goal.force,
            "frame": goal.frame or TOOL,
            "retreat": goal.retreat_m if goal.retreat else None,
            "baseline": goal.baseline or "rest",
        }
        names = (
            {"speed_mps": "fast_mps", "slow_mps": "slow_mps", "back": "back"}
            if goal.twice
            else {"speed_mps": "speed_mps", "retreat_mps": "retreat_mps"}
        )
        how |= {argument: getattr(goal, name) for name, argument in names.items() if getattr(goal, name)}
        arm = context.arm
        self._start = arm.state.pose
        call = arm.touch_twice if goal.twice else arm.touch
        self._task = context.driver.run_task("the touch", partial(call, direction, **how))

    def run(self, client: GoalClient) -> ActionResult:
        """Wait for the contact."""
        context = self._context

        def report() -> None:
            client.publish_feedback({"travel": self._travel(context.arm.state.pose)})

        error = wait_for_task(self._task, client, report)
        if error is not None:
            return result_of_failed_task(self._task, client, error)
        contact: Contact = self._task.result()
        fields = {
            "contact": True,
            "pose": {
                "header": {"frame_id": context.base, "stamp": context.ros.time(context.ros.now())},
                "pose": pose_message(context.ros, contact.pose),
            },
            "force": dict(zip("xyz", contact.force.tolist())),
            "travel": float(contact.travel),
            "position": contact.q.tolist(),
            "spread": float(contact.spread),
        }
        return ActionResult(GoalOutcome.SUCCEEDED, f"contact after {contact.travel * 1e3:.1f} mm", fields)

    def _travel(self, pose: Pose) -> float:
        return self._start.distance_to(pose)


def wait_for_taps(context: NodeContext, goal: Any) -> GoalWork:
    """Wait until somebody taps the arm at rest."""
    count = goal.count or _TAPS
    taps = TapWatch(force=goal.force or _TAP_FORCE, gap=goal.gap or _TAP_GAP)
    timeout = within(goal.timeout or _TAP_TIMEOUT, "timeout", 0.0, 1e6, unit="s")
    motion = context.arm.state.motion
    if motion is not None and motion.active:
        raise NotReady("a motion is running", hint="the arm has to be at rest for taps")
    return partial(_wait_for_taps, context, taps, count, timeout)


def _wait_for_taps(
    context: NodeContext, taps: TapWatch, count: int, timeout: float, client: GoalClient
) -> ActionResult:
    found, published = 0, -inf
    try:
        for state in context.arm.states(duration=timeout):
            wrench = state.wrench
            time_s = wrench.stamp * 1e-9
            found = taps.see(time_s, wrench.force)
            if found >= count:
                return ActionResult(
                    GoalOutcome.SUCCEEDED, f"tapped {found} times", {"position": state.q.tolist()}
                )
            if time_s - published >= FEEDBACK_PERIOD:
                published = time_s
                client.publish_feedback({"count": found})
                if client.is_cancel_requested():
                    return ActionResult(GoalOutcome.CANCELED, "cancelled")
    except HeptarmError as error:
        return ActionResult(GoalOutcome.ABORTED, str(error))
    return ActionResult(GoalOutcome.ABORTED, f"not tapped {count} times within {timeout:g} s")


def ask(context: NodeContext, goal: Any) -> GoalWork:
    """Ask the operator at the smartPAD."""
    return partial(_ask, context, goal)


def _ask(context: NodeContext, goal: Any, client: GoalClient) -> ActionResult:
    buttons = tuple(goal.buttons)
    answers: queue.SimpleQueue[str | HeptarmError] = queue.SimpleQueue()

    def wait() -> None:
        try:
            how: dict[str, Any] = {
                "kind": goal.kind or "question",
                "timeout": goal.timeout or _DIALOG_TIMEOUT,
            }
            answers.put(context.arm.pad.ask(goal.text, *buttons, **how))
        except HeptarmError as error:
            answers.put(error)

    threading.Thread(target=wait, name="heptarm-ask", daemon=True).start()
    while True:
        try:
            answer = answers.get(timeout=FEEDBACK_PERIOD)
        except queue.Empty:
            if client.is_cancel_requested():
                text = "cancelled; the dialog stays on the smartPAD until somebody presses a button"
                return ActionResult(GoalOutcome.CANCELED, text, {"button": -1})
            continue
        if isinstance(answer, str):
            return ActionResult(GoalOutcome.SUCCEEDED, answer, {"button": buttons.index(answer)})
        return ActionResult(GoalOutcome.ABORTED, str(answer), {"button": -1})


#: All actions except trajectories.
ACTIONS = (
    RosAction("~/move_joints", "heptarm_msgs/MoveJoints", move_joints),
    RosAction("~/move_pose", "heptarm_msgs/MovePose", move_pose),
    RosAction("~/move_spline", "heptarm_msgs/MoveSpline", move_spline),
    RosAction("~/run_program", "heptarm_msgs/RunProgram", run_program),
    RosAction("~/plan_and_execute", "heptarm_msgs/PlanAndExecute", plan_and_execute),
    RosAction("~/calibrate", "heptarm_msgs/Calibrate", calibrate),
    RosAction("~/touch", "heptarm_msgs/Touch", touch),
    RosAction("~/wait_for_taps", "heptarm_msgs/WaitForTaps", wait_for_taps),
    RosAction("~/ask", "heptarm_msgs/Ask", ask),
    RosAction("~/guide", "heptarm_msgs/Guide", guide),
    RosAction("~/teach", "heptarm_msgs/Teach", teach),
    RosAction("~/replay", "heptarm_msgs/Replay", replay),
    RosAction("~/gripper_cmd", "control_msgs/GripperCommand", gripper_command),
)
