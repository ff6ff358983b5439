"""All interfaces of a node except trajectories: services, actions and topics; the same for ROS 1 and ROS 2.

A case takes a probe, a client of one node, whose arm is in a cabinet with the project `PROJECT`.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from heptarm.model.kinematics import forward
from heptarm.values.robot import robot
from tests.conformance.stage import Stage

WORLD = (
    "MediaFlange.UserButton&lt;bool MediaFlange.LEDBlue&gt;bool MediaFlange.LEDRed&gt;bool Cell.Offset&gt;i16 "
    "Hand.Opened&lt;bool Hand.Closed&lt;bool Hand.Open&gt;bool Hand.Shut&gt;bool"
)
PROJECT = f"""<persistence><processDataContainer>
<processData dataType="java.lang.String" id="heptarm.io" value="{WORLD}"/>
<processData dataType="java.lang.Integer" id="cell.count" value="3"/>
</processDataContainer></persistence>"""
#: Parameters of the node.
PARAMETERS: dict[str, Any] = {
    "publish_signals": True,
    "publish_tf": True,
    "tf_frames": True,
    "speed": 0.6,
    "moveit": True,
    "gripper__open": "Hand.Open",
    "gripper__close": "Hand.Shut",
    "gripper__is_open": "Hand.Opened",
    "gripper__is_closed": "Hand.Closed",
    "gripper__settle": 0.2,
    "gripper__timeout": 2.0,
}
#: Height of the table [m]; the flange is 10 cm above it at home.
TABLE = 0.3
HOME = np.radians([0, 30, 0, -90, 0, 60, 0]).tolist()
#: Time limit of quick operations on a busy machine [s].
PATIENCE = 120.0


class Sent(Protocol):
    """A goal that was sent."""

    @property
    def reported(self) -> list[Any]:
        """Its feedback so far."""
        ...

    def cancel(self) -> None:
        """Ask to end it."""
        ...

    def end(self) -> Any:
        """Its result, when it has ended; refused goals have one, too."""
        ...


class Probe(Protocol):
    """A client of one node; names are relative to the node unless they start with a slash."""

    def call(self, name: str, kind: str, /, **request: Any) -> Any:
        """The answer of a service."""
        ...

    def send(self, name: str, kind: str, /, **goal: Any) -> Sent:
        """Send a goal to an action."""
        ...

    def listen(self, name: str, kind: str, /, *, latched: bool = False) -> list[Any]:
        """A list that fills with a topic's messages."""
        ...

    def tell(self, name: str, kind: str, /, **message: Any) -> Callable[[], None]:
        """A function that publishes a message; returns when a subscriber is known."""
        ...

    def make(self, kind: str, /, **fields: Any) -> Any:
        """A message."""
        ...

    def point(self, positions: list[float], seconds: float) -> Any:
        """A point of a trajectory."""
        ...

    def seconds(self, duration: Any) -> float:
        """A duration of a message [s]."""
        ...

    def query(self) -> Any:
        """Desired state of the active trajectory; None: there is none."""
        ...


def stage(folder: Path) -> Stage:
    """A cabinet with signals and process data, and a table in front of the arm."""
    project = folder / "RoboticsAPI.data.xml"
    project.write_text(PROJECT)
    return Stage("--project", str(project), "--box", f"0.6,0,{TABLE / 2},0.4,0.6,{TABLE}")


def until(what: Callable[[], Any], why: str) -> Any:
    """Wait until a value is true; return it."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        if value := what():
            return value
        time.sleep(0.01)
    raise TimeoutError(why)


def done(answer: Any) -> Any:
    """Assert that an answer or a result is a success."""
    assert answer.success, answer.message
    return answer


def refused(answer: Any, *words: str) -> None:
    """Assert that an answer or a result is a failure with this reason."""
    assert not answer.success and all(word in answer.message for word in words), answer.message


def act(probe: Probe, name: str, kind: str, /, **goal: Any) -> Any:
    """The result of a goal, when it has ended."""
    return probe.send(name, kind, **goal).end()


def ready(probe: Probe) -> None:
    """Wait until the node is active."""
    status = probe.listen("status", "heptarm_msgs/Status", latched=True)
    until(lambda: status and status[-1].active, "the node is not active")


def home(probe: Probe) -> None:
    done(act(probe, "move_joints", "MoveJoints", position=HOME, speed=0.6))


def case_signals_are_listed_written_and_published(probe: Probe, stage: Stage) -> None:
    seen = probe.listen("signals", "heptarm_msgs/Signals", latched=True)
    reported = done(probe.call("signals", "GetSignals"))
    assert list(reported.names) == [word.partition("&")[0] for word in WORLD.split()]
    assert list(reported.outputs)[:4] == [False, True, True, True] and reported.kinds[3] == "integer"
    done(probe.call("set_signals", "SetSignals", names=["offset", "LEDRed"], values=[-30.0, 1.0]))
    until(lambda: seen and dict(zip(seen[-1].names, seen[-1].values))["Cell.Offset"] == -30.0, "no signal")
    done(probe.call("set_led", "SetText", value="blue"))
    until(lambda: dict(zip(seen[-1].names, seen[-1].values))["MediaFlange.LEDBlue"] == 1.0, "no blue")
    stage.do("set UserButton true")
    until(lambda: dict(zip(seen[-1].names, seen[-1].values))["MediaFlange.UserButton"] == 1.0, "no button")
    stage.do("set UserButton false")
    refused(probe.call("set_signals", "SetSignals", names=["UserButton"], values=[1.0]), "input")
    refused(probe.call("set_signals", "SetSignals", names=["offset"], values=[]), "got 0")
    refused(probe.call("set_led", "SetText", value="pink"), "pink", "blue")


def case_keys_messages_and_process_data(probe: Probe, stage: Stage) -> None:
    keys = probe.listen("keys", "heptarm_msgs/KeyEvent")
    done(probe.call("set_key", "SetKey", slot=2, text="go", led="green"))

    def pressed() -> bool:
        stage.do("press 2 client")  # what is not kept for late subscribers may be missed once
        return any(key.slot == 2 and key.down for key in list(keys))

    until(pressed, "no key")
    refused(probe.call("set_key", "SetKey", slot=9, text="go"), "slot")
    done(probe.call("show", "ShowMessage", text="hello"))
    refused(probe.call("show", "ShowMessage", text="hello", severity="loud"), "loud")
    assert done(probe.call("process_data", "GetText", name="cell.count")).value == "3"
    done(probe.call("set_process_data", "SetEntry", name="cell.count", value="4"))
    assert done(probe.call("process_data", "GetText", name="cell.count")).value == "4"
    refused(probe.call("process_data", "GetText", name="cell.sum"), "cell.sum")


def case_a_condition_ends_a_motion(probe: Probe, stage: Stage) -> None:
    home(probe)
    states = probe.listen("state", "heptarm_msgs/RobotState")
    until(lambda: states, "no states")
    ended = probe.send(
        "move_joints", "MoveJoints", joint_names=["A1"], position=[2.0], until="io.user_button"
    )
    until(lambda: states[-1].position[0] > 0.05, "the arm does not set out")
    stage.do("set UserButton true")
    result = done(ended.end())
    assert "UserButton" in result.stopped_by or "user_button" in result.stopped_by, result.stopped_by
    assert states[-1].position[0] < 1.9
    stage.do("set UserButton false")
    result = done(
        act(probe, "move_joints", "MoveJoints", position=HOME, until="~io.user_button | (force > 900)")
    )
    assert "user_button" in result.stopped_by.casefold().replace("userbutton", "user_button")
    bad = "__import__('os').system('true')"
    refused(
        act(probe, "move_joints", "MoveJoints", position=HOME, until=bad),
        "must be a condition",
        "force.along",
    )
    refused(act(probe, "move_joints", "MoveJoints", position=HOME, until="force > 9999"), "9999")
    home(probe)


def case_a_guard_ends_commands_and_servo_topics(probe: Probe, stage: Stage) -> None:
    home(probe)
    states = probe.listen("state", "heptarm_msgs/RobotState")
    until(lambda: states, "no states")
    done(probe.call("set_guard", "SetText", value="io.user_button"))
    turn = probe.tell("servo/velocity", "sensor_msgs/JointState", name=["A7"], velocity=[0.2])

    def turned() -> bool:
        turn()
        return bool(states[-1].position[6] > 0.1)

    until(turned, "the arm does not follow")
    stage.do("set UserButton true")

    def stands() -> bool:
        turn()
        return all(abs(one.velocity[6]) < 1e-3 for one in states[-30:])

    until(stands, "the guard does not stop the arm")
    stage.do("set UserButton false")
    there = states[-1].position[6]
    for _ in range(20):
        turn()
        time.sleep(0.01)
    assert abs(states[-1].position[6] - there) < 1e-3, "it does not go on by itself"
    refused(probe.call("set_guard", "SetText", value="force"), "compare")
    done(probe.call("set_guard", "SetText", value=""))
    until(lambda: turn() or states[-1].position[6] > there + 0.05, "the arm does not follow again")
    until(lambda: not states[-1].motion, "the servo motion does not end")


def case_a_servo_topic_follows_lines(probe: Probe, stage: Stage) -> None:
    home(probe)
    seen = probe.listen("pose", "geometry_msgs/PoseStamped")
    until(lambda: seen, "no poses")
    target = done(probe.call("get_pose", "GetPose")).pose
    target.position.y += 0.05
    follow = probe.tell("servo/lin", "geometry_msgs/PoseStamped", pose=target)

    def arrived() -> bool:
        follow()
        return bool(abs(seen[-1].pose.position.y - target.position.y) < 2e-3)

    until(arrived, "the flange does not follow")
    states = probe.listen("state", "heptarm_msgs/RobotState")
    until(lambda: states and not states[-1].motion, "the servo motion does not end")


def case_splines_and_programs(probe: Probe, stage: Stage) -> None:
    home(probe)
    points = [0.1, 0.2, 0.2, 0.0]
    done(act(probe, "move_spline", "MoveSpline", joint_names=["A1", "A7"], position=points, speed=0.6))
    here = done(probe.call("get_pose", "GetPose", frame="flange")).pose
    assert abs(math.atan2(here.position.y, here.position.x) - 0.2) < 0.02

    def at(dy: float, dz: float) -> Any:
        place = here.position
        point = probe.make("geometry_msgs/Point", x=place.x, y=place.y + dy, z=place.z + dz)
        return probe.make("geometry_msgs/Pose", position=point, orientation=here.orientation)

    curve = [
        probe.make("heptarm_msgs/Segment", pose=at(0.03, -0.03)),
        probe.make("heptarm_msgs/Segment", kind=1, pose=at(0.06, -0.03), speed_mps=0.1),
        probe.make("heptarm_msgs/Segment", kind=2, via=at(0.08, -0.02), pose=at(0.06, 0.0)),
    ]
    done(act(probe, "move_spline", "MoveSpline", segments=curve, speed_mps=0.2))
    there = done(probe.call("get_pose", "GetPose", frame="flange")).pose
    assert abs(there.position.y - here.position.y - 0.06) < 2e-3
    refused(act(probe, "move_spline", "MoveSpline", position=[0.1]), "position")
    back = probe.make("geometry_msgs/PoseStamped")
    back.pose.position.y, back.header.frame_id = -0.06, "base"
    program = [
        probe.make("heptarm_msgs/Motion", kind=3, pose=back, speed_mps=0.2, blend_rel=0.2),
        probe.make("heptarm_msgs/Motion", kind=0, position=HOME, joint_speed=[0.5]),
        probe.make("heptarm_msgs/Motion", kind=7, joint_speed=[0.5]),
        probe.make("heptarm_msgs/Motion", kind=6, duration=0.1),
    ]
    result = done(act(probe, "run_program", "RunProgram", motions=program, when="queue", speed=0.6))
    assert result.item == 3 and not result.stopped_by and result.residual < 1e-3
    refused(act(probe, "run_program", "RunProgram", motions=[]), "no motions")
    odd = probe.make("heptarm_msgs/Motion", kind=9)
    refused(act(probe, "run_program", "RunProgram", motions=[odd]), "motions[0]", "9")
    refused(act(probe, "run_program", "RunProgram", motions=program, when="later"), "later")


def case_modes_with_all_their_parameters(probe: Probe, stage: Stage) -> None:
    home(probe)
    six = [0.0] * 6
    sine = {
        "amplitude": [0.0, 0.0, 5.0, 0.0, 0.0, 0.0],
        "frequency": [0.0, 0.0, 2.0, 0.0, 0.0, 0.0],
        "bias": six,
        "total_time": [0.5],
        "stay_active": True,
        "stiffness": [3000.0] * 3 + [200.0] * 3,
        "damping": [0.8],
        "nullspace": [50.0, 0.5],
        "max_deviation": [0.2] * 3 + [1.0] * 3,
        "frame": "base",
    }
    done(probe.call("mode/sine_impedance", "SetSineImpedance", **sine))
    done(
        act(
            probe,
            "run_program",
            "RunProgram",
            motions=[probe.make("heptarm_msgs/Motion", kind=6, duration=0.6)],
        )
    )
    for pattern in (
        {"pattern": "force", "force": [0.0, 0.0, 5.0, 0.0, 0.0, 0.0], "total_time": [1.0]},
        {"pattern": "sine", "direction": "z", "frequency": 2.0, "amplitude": 5.0},
        {"pattern": "lissajous", "plane": "xy", "frequency": 2.0, "amplitude": 5.0, "stiffness": [500.0]},
        {"pattern": "spiral", "plane": "xz", "frequency": 2.0, "amplitude": 5.0, "total_time": [1.0]},
    ):
        done(probe.call("mode/force_pattern", "SetForcePattern", **pattern))
    refused(probe.call("mode/force_pattern", "SetForcePattern", pattern="star"), "star", "lissajous")
    refused(
        probe.call("mode/force_pattern", "SetForcePattern", pattern="force", force=[1.0]),
        "must have 6 numbers",
    )
    refused(probe.call("mode/sine_impedance", "SetSineImpedance", **{**sine, "nullspace": six}), "nullspace")
    done(probe.call("mode/position", "std_srvs/Trigger"))


def case_tools_with_frames_and_what_the_arm_is(probe: Probe, stage: Stage) -> None:
    info = done(probe.call("info", "GetInfo"))
    assert info.model == "iiwa14" and info.is_virtual and info.real_time_factor > 0.0 and info.controller
    np.testing.assert_allclose(info.q_max, robot("iiwa14").q_max)
    tip = probe.make("geometry_msgs/Pose")
    tip.position.z, tip.orientation.w = 0.2, 1.0
    done(
        probe.call(
            "attach_tool",
            "AttachTool",
            name="probe",
            mass=1.0,
            inertia=[0.01, 0.01, 0.01, 0.0, 0.0, 0.0],
            frames=[probe.make("heptarm_msgs/Frame", name="tip", pose=tip)],
            frame="tip",
        )
    )

    def distance() -> float:
        pose = done(probe.call("get_pose", "GetPose", reference="flange")).pose
        return float(pose.position.z)

    until(lambda: abs(distance() - 0.2) < 1e-6, "the tool's frame is not what moves")
    wrench = done(probe.call("get_wrench", "GetWrench", frame="flange", axes="flange"))
    assert math.isfinite(wrench.wrench.force.x) and len(wrench.inaccuracy) == 6
    refused(probe.call("get_pose", "GetPose", frame="elbow"), "elbow")
    done(probe.call("detach_tool", "std_srvs/Trigger"))
    refused(probe.call("operate", "SetText", value="start"), "simulator")


def case_the_flange_is_on_tf(probe: Probe, stage: Stage) -> None:
    states = probe.listen("/joint_states", "sensor_msgs/JointState")
    frames = probe.listen("/tf", "tf2_msgs/TFMessage")
    until(lambda: frames and states, "no transforms")
    found = {one.child_frame_id: one for one in frames[-1].transforms}
    assert set(found) == {"flange", "tool"} and {one.header.frame_id for one in found.values()} == {"link_0"}
    place = found["flange"].transform.translation
    np.testing.assert_allclose(
        [place.x, place.y, place.z], forward(robot("iiwa14"), states[-1].position)[:3, 3], atol=2e-3
    )


def case_a_pose_in_a_frame_of_tf_is_reached(probe: Probe, stage: Stage) -> None:
    def frame(parent: str, name: str, height: float) -> Any:
        made = probe.make("geometry_msgs/TransformStamped", child_frame_id=name)
        made.header.frame_id, made.transform.rotation.w = parent, 1.0
        made.transform.translation.z = height
        return made

    def target(name: str) -> Any:
        made = probe.make("geometry_msgs/PoseStamped")
        made.header.frame_id, made.pose.position.z, made.pose.orientation.w = name, 0.07, 1.0
        return made

    home(probe)
    before = done(probe.call("get_pose", "GetPose", frame="flange")).pose.position
    mounted = [frame("flange", "camera", -0.1), frame("camera", "lens", 0.08), frame("shelf", "box", 0.1)]
    probe.tell("/tf_static", "tf2_msgs/TFMessage", transforms=mounted)()
    # the frame of the flange moves: it is of /tf, those of the camera are of /tf_static
    goal = {"path": 1, "pose": target("lens"), "speed_mps": 0.1}
    until(lambda: act(probe, "move_pose", "MovePose", **goal).success, "the frame stays unknown")
    after = done(probe.call("get_pose", "GetPose", frame="flange")).pose.position
    assert abs(before.z - after.z - 0.05) < 2e-3 and abs(before.x - after.x) < 2e-3, (before, after)
    goal["pose"] = target("box")
    refused(act(probe, "move_pose", "MovePose", **goal), "'box' is not connected with 'link_0'", "shelf")


def case_an_fri_session_is_opened_commanded_and_closed(probe: Probe, stage: Stage) -> None:
    home(probe)
    status = probe.listen("fri/status", "heptarm_msgs/FriStatus", latched=True)
    states = probe.listen("state", "heptarm_msgs/RobotState")
    refused(probe.call("fri/open", "OpenFri", kind="dance"), "dance", "monitor")

    def stands(kind: str, **settings: Any) -> bool:
        """Whether the status shows a session; a busy machine may lose one, and then another is opened."""
        if status and status[-1].kind:
            return True
        answer = probe.call("fri/open", "OpenFri", kind=kind, period_ms=10, **settings)
        return answer.success and bool(
            until(lambda: status and (status[-1].kind or status[-1].text), "no status")
        )

    def watched() -> bool:
        return stands("monitor", io=["LEDRed"]) and status[-1].received > 10

    until(watched, "nothing is received")
    again = partial(probe.call, "fri/open", "OpenFri", kind="monitor", period_ms=10, io=["LEDRed"])
    until(lambda: "close it first" in again().message, "a second session is not refused")
    lit = partial(probe.call, "fri/set_outputs", "SetSignals", names=["LEDRed"], values=[1.0])
    until(lambda: stands("monitor", io=["LEDRed"]) and lit().success, "the output is not set")
    done(probe.call("fri/close", "std_srvs/Trigger"))
    until(lambda: not status[-1].kind, "the status does not tell of the end")
    target_a7 = states[-1].position[6] - 0.1
    turn = probe.tell("fri/joint", "sensor_msgs/JointState", name=["A7"], position=[target_a7])

    def arrived() -> bool:
        if not stands("position"):
            return False
        turn()
        return bool(abs(states[-1].position[6] - target_a7) < 2e-3)

    until(arrived, "the arm does not follow FRI")
    done(probe.call("fri/close", "std_srvs/Trigger"))
    home(probe)


def case_the_desired_state_of_a_trajectory(probe: Probe, stage: Stage) -> None:
    home(probe)
    assert probe.query() is None
    path = {"joint_names": [f"A{i}" for i in range(1, 8)], "points": [probe.point([*HOME[:6], 2.0], 12.0)]}
    probe.tell("joint_trajectory", "trajectory_msgs/JointTrajectory", **path)()
    seen: list[float] = []

    def halfway() -> bool:
        wanted = probe.query()
        if wanted is not None:
            assert list(wanted.name) == path["joint_names"]
            seen.append(wanted.position[6])
        return bool(seen) and seen[-1] > 0.2

    until(halfway, "there is no desired state")
    assert seen == sorted(seen)
    done(probe.call("stop", "std_srvs/Trigger"))
    until(lambda: probe.query() is None, "the trajectory does not end")


def case_forward_controllers_are_followed(probe: Probe, stage: Stage) -> None:
    home(probe)
    states = probe.listen("state", "heptarm_msgs/RobotState")
    until(lambda: states, "no states")
    start = states[-1].position[6]
    pushed = 0

    def push() -> bool:
        nonlocal pushed
        pushed = min(pushed + 1, 60)
        data = [*HOME[:6], start + 0.004 * pushed]
        probe.tell("/surface/forward_position_controller/commands", "std_msgs/Float64MultiArray", data=data)()
        return bool(abs(states[-1].position[6] - start - 0.24) < 5e-3)

    until(push, "the positions are not followed")
    until(
        lambda: all(abs(one.position[6] - start - 0.24) < 5e-3 for one in states[-30:]),
        "it does not hold the last one",
    )
    turn = probe.tell(
        "/surface/forward_velocity_controller/commands", "std_msgs/Float64MultiArray", data=[0.0] * 6 + [-0.2]
    )
    until(lambda: turn() or states[-1].position[6] < start + 0.1, "the velocities are not followed")
    until(lambda: all(abs(one.velocity[6]) < 1e-3 for one in states[-30:]), "silence does not end it")
    there = states[-1].position[6]
    probe.tell(
        "/surface/forward_position_controller/commands", "std_msgs/Float64MultiArray", data=[0.0] * 6
    )()
    far = [*HOME[:6], there + 2.0]
    probe.tell("/surface/forward_position_controller/commands", "std_msgs/Float64MultiArray", data=far)()
    time.sleep(0.3)
    assert abs(states[-1].position[6] - there) < 5e-3, "neither six numbers nor a jump move the arm"


def case_a_twist_moves_the_flange_and_silence_ends_it(probe: Probe, stage: Stage) -> None:
    home(probe)
    poses = probe.listen("pose", "geometry_msgs/PoseStamped")
    states = probe.listen("state", "heptarm_msgs/RobotState")
    until(lambda: poses and states, "no poses")

    def place() -> np.ndarray:
        at = poses[-1].pose.position
        return np.array([at.x, at.y, at.z])

    def push(kind: str, name: str, move: np.ndarray, **more: Any) -> None:
        """Move on until the flange has moved by this much, with 0.05 m/s."""
        begin, along = place(), move / np.linalg.norm(move)
        fields = dict(zip("xyz", (0.05 * along).tolist()))
        twist = probe.make("geometry_msgs/Twist", linear=probe.make("geometry_msgs/Vector3", **fields))
        if kind == "geometry_msgs/TwistStamped":
            more["twist"] = twist
        else:
            more["linear"] = twist.linear
        send = probe.tell(name, kind, **more)
        until(lambda: send() or (place() - begin) @ along > np.linalg.norm(move), "the flange does not move")
        until(
            lambda: all(np.abs(one.velocity).max() < 1e-3 for one in states[-30:]), "silence does not end it"
        )
        moved = place() - begin
        assert moved @ along < 2.0 * np.linalg.norm(move), "it does not stop"
        assert np.linalg.norm(moved - (moved @ along) * along) < 5e-3, "it leaves its line"

    push("geometry_msgs/TwistStamped", "servo/twist", np.array([0.0, 0.04, 0.0]))
    push("geometry_msgs/Twist", "servo/twist_unstamped", np.array([0.0, -0.03, 0.02]))

    def orientation() -> np.ndarray:
        one = poses[-1].pose.orientation
        return np.array([one.x, one.y, one.z, one.w])

    before = orientation()
    header = probe.make("std_msgs/Header", frame_id="flange")
    spin = probe.make("geometry_msgs/Twist", angular=probe.make("geometry_msgs/Vector3", z=0.2))
    send = probe.tell("servo/twist", "geometry_msgs/TwistStamped", header=header, twist=spin)
    begin, at = states[-1].position[6], place()
    until(lambda: send() or states[-1].position[6] > begin + 0.05, "the flange does not turn about its axis")
    until(lambda: abs(orientation() @ before) < 1.0 - 1e-4, "the pose does not turn")  # by 0.03 rad
    assert np.linalg.norm(place() - at) < 5e-3
    until(lambda: not states[-1].motion, "the servo motion does not end")
    moon = probe.make("std_msgs/Header", frame_id="moon")
    at = place()
    probe.tell("servo/twist", "geometry_msgs/TwistStamped", header=moon, twist=spin)()
    time.sleep(0.3)
    assert np.linalg.norm(place() - at) < 1e-3


def case_a_joint_jog_moves_the_named_joints(probe: Probe, stage: Stage) -> None:
    home(probe)
    states = probe.listen("state", "heptarm_msgs/RobotState")
    until(lambda: states, "no states")
    jog = probe.tell("servo/jog", "control_msgs/JointJog", joint_names=["A7"], velocities=[0.2])
    until(lambda: jog() or states[-1].position[6] > 0.1, "the joint does not move")
    until(lambda: all(abs(one.velocity[6]) < 1e-3 for one in states[-30:]), "silence does not end it")
    assert np.abs(np.array(states[-1].position[:6]) - HOME[:6]).max() < 5e-3
    there = states[-1].position[6]
    probe.tell("servo/jog", "control_msgs/JointJog", joint_names=["A7"], displacements=[0.2])()
    time.sleep(0.3)
    assert abs(states[-1].position[6] - there) < 1e-3, "displacements are not supported"


def case_the_state_of_the_controller_agrees_with_itself(probe: Probe, stage: Stage) -> None:
    home(probe)
    found = probe.listen("controller_state", "control_msgs/JointTrajectoryControllerState")
    measured = probe.listen("/joint_states", "sensor_msgs/JointState")
    scaling = probe.listen("speed_scaling", "std_msgs/Float64", latched=True)
    until(lambda: found and scaling and measured, "no state of the controller")
    names = ("reference", "feedback") if hasattr(found[-1], "reference") else ("desired", "actual")
    until(  # states that were sampled before the motion home had ended may still arrive
        lambda: np.abs(np.subtract(getattr(found[-1], names[0]).positions, HOME)).max() < 5e-3,
        "the reference is not at home",
    )
    assert list(found[-1].joint_names) == [f"A{i}" for i in range(1, 8)]
    done(probe.call("set_override", "SetNumber", value=0.5))
    until(lambda: scaling[-1].data == 0.5, "the speed scaling is not published")
    there = HOME[6] + 0.3
    path = {"joint_names": [f"A{i}" for i in range(1, 8)], "points": [probe.point([*HOME[:6], there], 2.0)]}
    count = len(found)
    probe.tell("joint_trajectory", "trajectory_msgs/JointTrajectory", **path)()
    until(lambda: getattr(found[-1], names[0]).positions[6] > HOME[6] + 0.2, "the reference does not move")
    done(probe.call("set_override", "SetNumber", value=1.0))
    until(lambda: scaling[-1].data == 1.0, "the speed scaling is not published")
    moving = 0
    for one in list(found)[count:]:
        wanted, actual = (getattr(one, name) for name in names)
        np.testing.assert_allclose(
            one.error.positions, np.subtract(wanted.positions, actual.positions), atol=1e-9
        )
        if abs(wanted.velocities[6]) > 1e-3:  # the trajectory is a straight line in time
            moving += 1
            seconds = probe.seconds(wanted.time_from_start)
            assert abs(wanted.positions[6] - HOME[6] - 0.15 * seconds) < 5e-3
    assert moving > 10
    stamps = [(one.header.stamp, one.position[6]) for one in list(measured)]
    same = [
        (getattr(one, names[1]).positions[6], value)
        for one in list(found)[-50:]
        for stamp, value in stamps
        if stamp == one.header.stamp
    ]
    assert same and all(a == b for a, b in same), "its feedback is the joint state of the same stamp"
    until(lambda: probe.query() is None, "the trajectory does not end")


#: All cases by name.
CASES = {
    name.removeprefix("case_"): case for name, case in list(globals().items()) if name.startswith("case_")
}
