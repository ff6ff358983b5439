"""Contacts, hand guiding, teaching, triggers and collisions, for ROS 1 and ROS 2; see `tests.conformance.surface`."""

from __future__ import annotations

import math
from collections.abc import Callable
from threading import Event, Thread
from typing import Any

import numpy as np

from tests.conformance.stage import Stage
from tests.conformance.surface import HOME, TABLE, Probe, Sent, act, done, home, refused, until


def towards(probe: Probe, z: float) -> Any:
    """An offset along z of the base."""
    offset = probe.make("geometry_msgs/PoseStamped")
    offset.pose.position.z, offset.header.frame_id = z, "base"
    return offset


def along(probe: Probe, z: float, **more: Any) -> Any:
    """A motion of a program by that offset."""
    return probe.make("heptarm_msgs/Motion", kind=3, pose=towards(probe, z), **more)


def push(stage: Stage, sent: Sent, covered: float) -> None:
    """Push until a joint has turned by this angle [rad]."""
    before = until(lambda: sent.reported, "no feedback")[-1].position
    stage.do("push 0 6 6 300")
    until(
        lambda: np.abs(np.subtract(sent.reported[-1].position, before)).max() > covered,
        "the arm is not guided",
    )
    stage.do("push 0 0 0 0")


def case_the_arm_touches_once_and_twice(probe: Probe, stage: Stage) -> None:
    home(probe)
    down: dict[str, Any] = {"direction": "-z", "frame": "base", "distance": 0.2, "force": 10.0}
    sent = probe.send("touch", "Touch", **down, speed_mps=0.08, retreat=True, retreat_m=0.02)
    contact = done(sent.end())
    assert contact.contact and abs(contact.pose.pose.position.z - TABLE) < 0.015
    assert contact.pose.header.frame_id == "link_0" and contact.force.z > 8.0
    assert 0.05 < contact.travel < 0.15 and len(contact.position) == 7 and math.isnan(contact.spread)
    until(lambda: any(one.travel > 0.05 for one in list(sent.reported)), "the travel is not reported")

    def height() -> float:
        return float(done(probe.call("get_pose", "GetPose", frame="flange")).pose.position.z)

    above = contact.pose.pose.position.z + 0.02
    until(lambda: abs(height() - above) < 2e-3, "the arm does not retreat")
    vector = probe.make("geometry_msgs/Vector3", z=-2.0)
    goal = {
        "vector": vector,
        "frame": "base",
        "distance": 0.1,
        "force": 8.0,
        "retreat": True,
        "retreat_m": 0.05,
    }
    exact = done(act(probe, "touch", "Touch", **goal, twice=True, slow_mps=0.01))
    assert abs(exact.pose.pose.position.z - TABLE) < 3e-3 and 0.0 <= exact.spread < 0.02
    refused(act(probe, "touch", "Touch", direction="z", frame="base", distance=0.02, force=10.0, speed_mps=0.1),
            "nothing was touched")  # fmt: skip
    refused(act(probe, "touch", "Touch", **{**down, "direction": "up"}), "up")
    refused(act(probe, "touch", "Touch", **{**down, "force": 0.0}), "force")
    refused(act(probe, "touch", "Touch", **down, vector=vector), "both")


def case_a_touch_is_cancelled_and_preempted(probe: Probe, stage: Stage) -> None:
    home(probe)
    slowly = {"direction": "-z", "frame": "base", "distance": 0.08, "force": 20.0, "speed_mps": 0.02}
    sent = probe.send("touch", "Touch", **slowly)
    until(lambda: sent.reported and sent.reported[-1].travel > 2e-3, "the arm does not set out")
    follow = probe.tell("servo/velocity", "sensor_msgs/JointState", name=["A7"], velocity=[0.2])
    follow()  # a servo topic has no place in the queue
    sent.cancel()
    refused(sent.end(), "cancelled")
    sent = probe.send("touch", "Touch", **slowly)
    until(lambda: sent.reported and sent.reported[-1].travel > 2e-3, "the arm does not set out")
    home(probe)
    refused(sent.end(), "preempted")
    sent = probe.send("touch", "Touch", **slowly)
    until(lambda: sent.reported and sent.reported[-1].travel > 2e-3, "the arm does not set out")
    done(probe.call("stop", "std_srvs/Trigger"))
    refused(sent.end(), "stopped")
    states = probe.listen("state", "heptarm_msgs/RobotState")
    until(lambda: states and not states[-1].motion and not states[-1].queued, "something runs on")


def case_triggers_write_outputs_and_notify(probe: Probe, stage: Stage) -> None:
    home(probe)
    news = probe.listen("events", "heptarm_msgs/MotionEvent")
    signals = probe.listen("signals", "heptarm_msgs/Signals", latched=True)
    done(probe.call("set_signals", "SetSignals", names=["LEDRed", "LEDBlue"], values=[0.0, 0.0]))

    def trigger(condition: str, **action: Any) -> Any:
        return probe.make("heptarm_msgs/Trigger", condition=condition, **action)

    def lit(name: str) -> bool:
        return bool(signals) and dict(zip(signals[-1].names, signals[-1].values))[name] == 1.0

    red = trigger("path.after(0.02)", signal="LEDRed", value=1.0)
    near = trigger("path.before_end(0.01)", label="nearly there")
    here = done(probe.call("get_pose", "GetPose", frame="flange")).pose
    curve = [
        probe.make(
            "heptarm_msgs/Segment",
            pose=probe.make(
                "geometry_msgs/Pose",
                position=probe.make(
                    "geometry_msgs/Point", x=here.position.x, y=here.position.y + dy, z=here.position.z
                ),
                orientation=here.orientation,
            ),
        )
        for dy in (0.03, 0.06)
    ]
    program = [
        along(probe, 0.05, speed_mps=0.1, triggers=[red, near]),
        along(probe, -0.05, speed_mps=0.1),
        probe.make("heptarm_msgs/Motion", kind=4, segments=curve, speed_mps=0.1),
    ]
    sent = probe.send("run_program", "RunProgram", motions=program)
    assert done(sent.end()).item == 2
    until(lambda: lit("MediaFlange.LEDRed"), "the output is not written")
    # the last feedback may arrive after the result
    until(
        lambda: {feedback.item for feedback in list(sent.reported)} == {0, 1, 2}, "not every item is reported"
    )
    fed = [event for feedback in sent.reported for event in feedback.events]
    assert fed[0].kind == "begun" and any(feedback.remaining > 0.0 for feedback in sent.reported)
    number = fed[0].motion
    last = ("ended", 2)
    until(lambda: any((one.motion, one.kind, one.item) == (number, *last) for one in list(news)), "no events")
    received = [one for one in news if one.motion == number]
    kinds = [(one.kind, one.item) for one in received]
    assert kinds[0] == ("begun", 0) and kinds[-1] == last, kinds
    fired = {one.signal or one.label: one for one in received if one.kind == "trigger"}
    assert set(fired) == {"LEDRed", "nearly there"} and all(one.item == 0 for one in fired.values())
    assert 0.0 < fired["LEDRed"].time < fired["nearly there"].time
    assert fired["LEDRed"].code == 0 and len(fired["LEDRed"].position) == 7
    assert [one.segment for one in received if one.kind == "segment"] == [0, 1]
    blue = trigger("path.before_end()", signal="LEDBlue", value=1.0)
    done(act(probe, "move_joints", "MoveJoints", position=HOME, speed=0.6, triggers=[blue]))
    until(lambda: lit("MediaFlange.LEDBlue"), "the output is not written")
    for wrong, words in (
        ([trigger("", label="never")], ("triggers[0].condition", "empty")),
        ([trigger("sometimes")], ("must be a condition",)),
        ([trigger("path.after()", signal="UserButton")], ("input",)),
        ([trigger("path.after()")] * 17, ("at most 16",)),
    ):
        refused(act(probe, "move_joints", "MoveJoints", position=HOME, triggers=wrong), *words)
    guided = probe.make("heptarm_msgs/Motion", kind=8, triggers=[near])
    refused(act(probe, "run_program", "RunProgram", motions=[guided]), "hand guiding cannot have triggers")


def case_a_collision_guard_stops_motions_and_makes_compliant(probe: Probe, stage: Stage) -> None:
    home(probe)
    seen = probe.listen("collisions", "heptarm_msgs/Collision")
    states = probe.listen("state", "heptarm_msgs/RobotState")
    down: dict[str, Any] = {"path": 3, "pose": towards(probe, -0.2), "speed_mps": 0.1}
    answer = done(probe.call("collision_guard", "SetCollisionGuard", threshold=[12.0]))
    assert len(answer.baseline) == 7 and "the cabinet" in answer.message
    refused(act(probe, "move_pose", "MovePose", **down), "collision at A", "12.0 Nm")
    met = until(lambda: seen, "no collision is reported")[-1]
    assert met.joint in ("A2", "A4") and abs(met.torque) > 12.0 and met.allowed == 12.0
    turn = probe.tell("servo/velocity", "sensor_msgs/JointState", name=["A7"], velocity=[0.2])
    until(lambda: states and not states[-1].motion, "the arm does not rest")
    count = len(states)

    def received() -> bool:
        turn()
        return len(states) > count + 50

    until(received, "no states")
    assert not any(state.motion for state in states[count:]), (
        "a servo topic is not followed after a collision"
    )
    done(probe.call("collision_guard", "SetCollisionGuard", disable=True))
    home(probe)
    answer = done(
        probe.call(
            "collision_guard", "SetCollisionGuard", threshold=[12.0] * 7, margin=[2.0], reaction="soft"
        )
    )
    assert "this node" in answer.message
    until(lambda: not states[-1].motion, "the arm does not rest")
    count, first = len(seen), len(states)
    assert not act(probe, "move_pose", "MovePose", **down).success
    until(lambda: len(seen) > count, "no collision is reported")
    until(lambda: len({state.motion for state in states[first:]} - {0}) == 2, "the arm is not compliant")
    home(probe)  # the guard is disabled, and a command replaces the compliant hold
    refused(probe.call("collision_guard", "SetCollisionGuard", threshold=[-1.0]), "threshold")
    refused(probe.call("collision_guard", "SetCollisionGuard", reaction="flee"), "flee", "soft")


def case_the_arm_is_guided_by_hand(probe: Probe, stage: Stage) -> None:
    home(probe)
    before = done(probe.call("get_pose", "GetPose", frame="flange")).pose.position
    sent = probe.send("guide", "Guide", free="y", frame="base")
    push(stage, sent, 0.03)
    sent.cancel()
    assert done(sent.end()).message == "ended by the client"
    after = done(probe.call("get_pose", "GetPose", frame="flange")).pose.position
    assert after.y - before.y > 0.005 and abs(after.z - before.z) < 5e-3
    limits = {"joint_velocity": 0.5, "q_max": [0.8] + [math.nan] * 6}
    sent = probe.send("guide", "Guide", **limits)
    until(lambda: sent.reported, "no feedback")
    stage.do("guide")
    until(lambda: sent.reported[-1].held, "the switch is not seen")
    push(stage, sent, 0.03)
    stage.do("let_go")
    result = done(sent.end())
    assert "released" in result.message and len(result.position) == 7
    done(act(probe, "guide", "Guide", free="xyz", frame="base", duration=0.2))
    assert done(act(probe, "guide", "Guide", free="xyz", frame="base", until="~(force > 50)")).stopped_by
    refused(act(probe, "guide", "Guide", free="w"), "xyzabc")
    refused(act(probe, "guide", "Guide", q_max=[9.0] + [math.nan] * 6), "A1")


def case_a_trajectory_is_taught_and_replayed(probe: Probe, stage: Stage) -> None:
    home(probe)
    refused(act(probe, "replay", "Replay", name="nothing"), "nothing")
    sent = probe.send("teach", "Teach", free="xyz", frame="base", key="done", slot=1, name="wave")
    push(stage, sent, 0.06)
    stage.do("press 1 client")
    taught = done(sent.end())
    covered = taught.trajectory
    assert "the key 'done'" in taught.message and taught.name == "wave"
    assert 2 <= len(covered.points) < taught.recorded and list(covered.joint_names) == [
        f"A{i}" for i in range(1, 8)
    ]
    again = probe.send("replay", "Replay", name="wave", by="spline", speed_scaling=0.5)
    result = done(again.end())
    assert result.deviation < 0.1 and math.isnan(result.lag)
    until(lambda: any(one.progress > 0.2 for one in list(again.reported)), "no progress is reported")
    tries: list[Any] = []

    def repeated() -> bool:
        tries.append(act(probe, "replay", "Replay", trajectory=covered))
        if not tries[-1].success:  # a busy machine may fall silent
            refused(tries[-1], "for want of targets")
        return bool(tries[-1].success)

    until(repeated, "the trajectory is not replayed")
    assert tries[-1].deviation < 0.3 and math.isfinite(tries[-1].lag)
    slowly = probe.send("replay", "Replay", name="wave", speed_scaling=0.05)
    until(lambda: slowly.reported and slowly.reported[-1].progress > 0.01, "it does not begin")
    slowly.cancel()
    refused(slowly.end(), "cancelled")
    sent = probe.send("teach", "Teach", free="xyz", frame="base", whole=True)
    until(lambda: sent.reported and sent.reported[-1].recorded > 20, "nothing is recorded")
    sent.cancel()
    taught = done(sent.end())
    assert taught.name == "last" and len(taught.trajectory.points) > 20
    refused(act(probe, "teach", "Teach", free="xyz", frame="base", duration=0.2), "nothing moves")
    refused(act(probe, "replay", "Replay", name="wave", by="foot"), "foot")


def case_somebody_taps_the_arm(probe: Probe, stage: Stage) -> None:
    home(probe)
    sent = probe.send("wait_for_taps", "WaitForTaps", count=2, gap=10.0)
    until(lambda: sent.reported, "no feedback")
    over = Event()

    def tap() -> None:
        while not over.wait(0.5):
            stage.do("push 0 0 30 0.1")

    hand = Thread(target=tap)
    hand.start()
    try:
        assert len(done(sent.end()).position) == 7
    finally:
        over.set()
        hand.join()
    refused(act(probe, "wait_for_taps", "WaitForTaps", timeout=0.2), "not tapped 2 times")
    sent = probe.send("wait_for_taps", "WaitForTaps")
    until(lambda: sent.reported, "no feedback")
    sent.cancel()
    refused(sent.end(), "cancelled")
    refused(act(probe, "wait_for_taps", "WaitForTaps", force=9999.0), "force")


def case_the_operator_is_asked(probe: Probe, stage: Stage) -> None:
    def answered(sent: Sent, button: int) -> Any:
        over = Event()

        def press() -> None:
            while not over.wait(0.05):
                stage.do(f"answer {button}")

        hand = Thread(target=press)
        hand.start()
        try:
            return sent.end()
        finally:
            over.set()
            hand.join()

    end = done(answered(probe.send("ask", "Ask", text="Is the part clamped?", buttons=["Yes", "No"]), 1))
    assert (end.message, end.button) == ("No", 1)
    refused(act(probe, "ask", "Ask", text="Go on?", buttons=["Yes"], timeout=0.3), "nobody pressed")
    refused(act(probe, "ask", "Ask", text="and", buttons=["Ok"]), "Go on?")  # it stays
    stage.do("answer 0")
    refused(act(probe, "ask", "Ask", text="x", buttons=["Ok"], kind="loud"), "kind")
    refused(act(probe, "ask", "Ask", text="x", buttons=[]), "buttons")


# --------------------------------------------------------------------------------------------- gripper


def fingers(stage: Stage, *, opened: bool, closed: bool) -> None:
    """Set the end switches of the gripper."""
    stage.do(f"set Hand.Opened {str(opened).lower()}")
    stage.do(f"set Hand.Closed {str(closed).lower()}")


def grip(probe: Probe, position: float) -> Sent:
    command = probe.make("control_msgs/GripperCommand", position=position)
    return probe.send("gripper_cmd", "control_msgs/GripperCommand", command=command)


def case_a_gripper_closes_on_something_and_opens(probe: Probe, stage: Stage) -> None:
    fingers(stage, opened=True, closed=False)
    opened = grip(probe, 0.1).end()
    assert opened.reached_goal and not opened.stalled and opened.position == 0.1
    sent = grip(probe, 0.0)
    until(lambda: sent.reported, "no feedback")
    fingers(stage, opened=False, closed=False)
    held = sent.end()
    assert held.stalled and not held.reached_goal and math.isnan(held.position)
    values = done(probe.call("signals", "GetSignals"))
    assert dict(zip(values.names, values.values))["Hand.Shut"] == 1.0
    fingers(stage, opened=False, closed=True)
    empty = grip(probe, 0.0).end()
    assert empty.reached_goal and not empty.stalled and empty.position == 0.0


def case_a_gripper_goal_ends_without_its_switches(probe: Probe, stage: Stage) -> None:
    fingers(stage, opened=False, closed=False)
    late = grip(probe, 0.1).end()  # without air
    assert not late.reached_goal and not late.stalled
    replaced, sent = grip(probe, 0.1), grip(probe, 0.1)
    assert not replaced.end().reached_goal
    sent.cancel()
    assert not sent.end().reached_goal
    assert not grip(probe, math.nan).end().reached_goal
    fingers(stage, opened=True, closed=False)
    assert grip(probe, 0.1).end().reached_goal


#: All cases by name.
CASES: dict[str, Callable[[Probe, Stage], None]] = {
    name.removeprefix("case_"): case for name, case in list(globals().items()) if name.startswith("case_")
}
