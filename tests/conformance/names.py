"""Programs for other drivers, by those drivers' own names and types; the same for ROS 1 and ROS 2."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Protocol

from tests.conformance.surface import until

NAN, NONE = math.nan, 1e6
_SIX = ("x", "y", "z", "a", "b", "c")


class NamesProbe(Protocol):
    """A client of a node with the names of another driver; names are relative to its namespace."""

    def call(self, name: str, kind: str, /, **request: Any) -> Any:
        """The answer of a service."""
        ...

    def listen(self, name: str, kind: str, /, *, latched: bool = False) -> list[Any]:
        """A list that fills with a topic's messages."""
        ...

    def tell(self, name: str, kind: str, /, **message: Any) -> Callable[[], None]:
        """A function that publishes a message; returns when a subscriber is known."""
        ...


def six(*values: float, **more: Any) -> dict[str, Any]:
    return dict(zip(_SIX, values)) | more


#: Services of libiiwa that have to succeed, in this order.
LIBIIWA: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("set_communication_mode", "SetString", {"data": "on-demand"}),
    ("set_execution_type", "SetString", {"data": "ASYNCHRONOUS"}),
    ("set_desired_joint_velocity_rel", "SetNumber", {"data": 0.6}),
    ("set_desired_joint_acceleration_rel", "SetNumber", {"data": 0.6}),
    ("set_desired_joint_jerk_rel", "SetNumber", {"data": 0.6}),
    ("set_desired_cartesian_velocity", "SetNumber", {"data": 0.2}),
    ("set_desired_cartesian_acceleration", "SetNumber", {"data": 1.0}),
    ("set_desired_cartesian_jerk", "SetNumber", {"data": 20.0}),
    ("set_joint_stiffness", "SetArray", {"data": [900.0, 800.0, 700.0, 600.0, 500.0, 400.0, 300.0]}),
    ("set_joint_damping", "SetArray", {"data": [0.8] * 7}),
    (
        "set_cartesian_stiffness",
        "SetXYZABCParam",
        six(3000.0, 3000.0, 2500.0, 120.0, 110.0, 90.0, float_param=80.0),
    ),
    ("set_cartesian_damping", "SetXYZABCParam", six(0.8, 0.8, 0.8, 0.6, 0.6, 0.6, float_param=0.6)),
    ("set_cartesian_additional_control_force", "SetXYZABC", six(*[0.0] * 6)),
    (
        "set_cartesian_max_control_force",
        "SetXYZABCParam",
        six(NONE, NONE, 90.0, NONE, NONE, NONE, boolean_param=True),
    ),
    ("set_cartesian_max_velocity", "SetXYZABC", six(NONE, NONE, 5.0, NONE, NONE, NONE)),
    ("set_cartesian_max_path_deviation", "SetXYZABC", six(NONE, 0.2, NONE, NONE, NONE, NONE)),
    ("set_control_mode", "SetString", {"data": "JOINT_IMPEDANCE"}),
    ("set_control_mode", "SetString", {"data": "cartesian_sine_impedance"}),
    ("set_control_mode", "SetString", {"data": "cartesian_impedance"}),
    ("set_cartesian_stiffness", "SetXYZABCParam", six(*[2000.0] * 3, *[200.0] * 3, float_param=100.0)),
    ("set_control_mode", "SetString", {"data": "POSITION"}),
    ("set_force_condition", "SetArray", {"data": [NAN, NAN, 60.0, NAN, NAN, 20.0]}),
    ("set_force_condition", "SetArray", {"data": [70.0, 70.0, 70.0]}),
)
#: Requests that have to fail.
LIBIIWA_REFUSED: tuple[tuple[str, str, dict[str, Any], str], ...] = (
    ("set_joint_stiffness", "SetArray", {"data": [9000.0] * 7}, "9000"),
    ("set_joint_damping", "SetArray", {"data": [0.7]}, "7 numbers"),
    ("set_motion_type", "SetString", {"data": "circ"}, "ptp, lin"),
    ("set_desired_joint_velocity_rel", "SetNumber", {"data": 0.0}, "speed"),
)


def a_program_for_libiiwa(probe: NamesProbe) -> None:
    """Services, conditions and command topics."""

    def ask(name: str, kind: str, **request: Any) -> Any:
        package = "" if "/" in kind else "libiiwa_msgs/"
        return probe.call(f"iiwa/{name}", f"{package}{kind}", **request)

    states = probe.listen("iiwa/state/joint_states", "sensor_msgs/JointState")
    poses = probe.listen("iiwa/state/end_effector_pose", "geometry_msgs/Pose")
    wrenches = probe.listen("iiwa/state/end_effector_wrench", "geometry_msgs/Wrench")
    until(lambda: states and poses and wrenches, "no states come")
    assert list(states[-1].name) == [f"iiwa_joint_{i}" for i in range(1, 8)]
    until(lambda: ask("is_ready_to_move", "GetBool").data, "the node is not active")
    for name, kind, request in LIBIIWA:
        answer = ask(name, kind, **request)
        assert answer.success, f"{name}: {answer.message}"
    assert ask("last_error", "GetError").error_code == -10
    for name, kind, request, word in LIBIIWA_REFUSED:
        answer = ask(name, kind, **request)
        assert not answer.success and word in answer.message, answer.message
    assert [ask("last_error", "GetError").error_code for _ in range(2)] == [-11, -10]

    def arrived(joint: int, value: float) -> bool:
        return abs(states[-1].position[joint] - value) < 2e-3 and not ask("has_active_motion", "GetBool").data

    turn = [NAN] * 6 + [0.3]
    probe.tell("iiwa/command/joint", "sensor_msgs/JointState", position=turn)()
    until(lambda: arrived(6, 0.3), "joint 7 does not arrive")
    named = {"name": ["iiwa_joint_2"], "position": [0.2]}
    probe.tell("iiwa/command/joint", "sensor_msgs/JointState", **named)()
    until(lambda: arrived(1, 0.2), "joint 2 does not arrive")
    assert not ask("has_fired_condition", "GetBool").data
    band = [NAN] * 3 + [300.0] + [NAN] * 6 + [400.0] + [NAN] * 3
    assert ask("set_joint_torque_condition", "SetArray", data=band).success
    far = [NAN] * 6 + [1.5]
    probe.tell("iiwa/command/joint", "sensor_msgs/JointState", position=far)()
    until(lambda: ask("has_fired_condition", "GetBool").data, "the condition does not fire")
    assert states[-1].position[6] < 1.4
    ask("reset_conditions", "std_srvs/Empty")


def servo_of_libiiwa(probe: NamesProbe) -> None:
    """A stream of joint positions with the control interface of libiiwa's launch file, and its stop topic."""
    states = probe.listen("iiwa/state/joint_states", "sensor_msgs/JointState")
    until(lambda: states, "no states come")
    mode = {"data": "SERVO"}
    assert probe.call("iiwa/set_control_interface", "libiiwa_msgs/SetString", **mode).success
    target = [NAN] * 6 + [states[-1].position[6] - 0.1]
    send = probe.tell("iiwa/command/joint", "sensor_msgs/JointState", position=target)
    until(lambda: send() or abs(states[-1].position[6] - target[6]) < 2e-3, "the stream is not followed")
    mode = {"data": "standard"}
    assert probe.call("iiwa/set_control_interface", "libiiwa_msgs/SetString", **mode).success
    away = {"name": ["iiwa_joint_1"], "position": [2.5]}
    probe.tell("iiwa/command/joint", "sensor_msgs/JointState", **away)()
    until(lambda: states[-1].velocity[0] > 0.1, "the arm does not set out")
    probe.tell("iiwa/command/stop", "std_msgs/Empty")()
    until(lambda: abs(states[-1].velocity[0]) < 1e-3, "the arm does not stop")
    assert states[-1].position[0] < 2.4


def a_program_for_lbr_stack(probe: NamesProbe) -> None:
    """States, wrench, the command topic of joint positions, and the forward controller."""
    states = probe.listen("lbr/joint_states", "sensor_msgs/JointState")
    full = probe.listen("lbr/state", "lbr_fri_idl/LBRState")
    wrenches = probe.listen("lbr/force_torque_broadcaster/wrench", "geometry_msgs/WrenchStamped")
    controller = probe.listen(
        "lbr/joint_trajectory_controller/controller_state", "control_msgs/JointTrajectoryControllerState"
    )
    until(lambda: states and full and wrenches and controller, "no states come")
    assert list(states[-1].name) == [f"lbr_A{i}" for i in range(1, 8)]
    assert wrenches[-1].header.frame_id == "lbr_link_0"
    until(lambda: full[-1].operation_mode == 2 and full[-1].safety_state == 0, "not in automatic mode")
    here = list(full[-1].measured_joint_position)
    assert max(abs(a - b) for a, b in zip(here, states[-1].position)) < 5e-3
    pushed = 0

    def push(topic: str, kind: str, field: str, to: float) -> bool:
        nonlocal pushed
        pushed += 1
        begin = here[6]
        there = begin + (1.0 if to > begin else -1.0) * min(0.004 * pushed, abs(to - begin))
        probe.tell(topic, kind, **{field: [*here[:6], there]})()
        return bool(abs(states[-1].position[6] - to) < 5e-3)

    goal = here[6] + 0.2
    until(
        lambda: push(
            "lbr/command/joint_position", "lbr_fri_idl/LBRJointPositionCommand", "joint_position", goal
        ),
        "the positions are not followed",
    )
    here, pushed = list(states[-1].position), 0
    goal = here[6] - 0.2
    until(
        lambda: push("lbr/forward_position_controller/commands", "std_msgs/Float64MultiArray", "data", goal),
        "the forward controller is not followed",
    )


def a_tool_for_controllers(probe: NamesProbe) -> None:
    """What the graphical tool for trajectories asks of a controller manager, and that nothing can be unloaded."""

    def ask(name: str, kind: str, **request: Any) -> Any:
        return probe.call(f"lbr/controller_manager/{name}", f"controller_manager_msgs/{kind}", **request)

    found = {one.name: one for one in ask("list_controllers", "ListControllers").controller}
    trajectories = found["joint_trajectory_controller"]
    assert "JointTrajectoryController" in trajectories.type and trajectories.state == "active"
    joints = [f"lbr_A{i}" for i in range(1, 8)]
    assert list(trajectories.claimed_interfaces) == [f"{joint}/position" for joint in joints]
    types = ask("list_controller_types", "ListControllerTypes")
    assert trajectories.type in types.types and len(types.types) == len(types.base_classes)
    for name, kind in (
        ("load_controller", "LoadController"),
        ("unload_controller", "UnloadController"),
        ("switch_controller", "SwitchController"),
        ("reload_controller_libraries", "ReloadControllerLibraries"),
    ):
        assert not ask(name, kind).ok
