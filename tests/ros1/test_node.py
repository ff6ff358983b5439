"""The node without its action: states, commands, services, life cycle, parameters."""

from __future__ import annotations

import itertools

import numpy as np
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, WrenchStamped
from heptarm_msgs.msg import RobotState, Status
from heptarm_msgs.srv import SetNumber
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty
from std_srvs.srv import Trigger

from heptarm.ros.trajectory.goal import TrajectoryGoal, TrajectoryPoint
from tests.conformance.case import arrives, goal, long, point, quiet, rests, step
from tests.conformance.streams import streamed
from tests.ros1.peer import Client, NodeProcess, call, collect, fresh, publisher, until


def stamps(messages: list[JointState]) -> list[int]:
    return [message.header.stamp.to_nsec() for message in messages]


def test_joint_states_are_new_each_time_and_bear_the_time_of_their_measurement(client: Client) -> None:
    before = rospy.Time.now().to_nsec()
    states = collect("/joint_states", JointState)
    until(lambda: len(states) >= 50, "no joint states come")
    times = stamps(states[:50])
    assert all(b > a for a, b in itertools.pairwise(times))
    assert before - 10**10 < times[0] and times[-1] <= rospy.Time.now().to_nsec()
    for state in states:
        assert tuple(state.name) == client.joints
        numbers = [*state.position, *state.velocity, *state.effort]
        assert len(numbers) == 21 and np.isfinite(numbers).all()


def test_states_agree_with_each_other(client: Client) -> None:
    everything = collect("/heptarm/state", RobotState)
    poses = collect("/heptarm/pose", PoseStamped)
    wrenches = collect("/heptarm/wrench", WrenchStamped)
    torques = collect("/heptarm/external_torques", JointState)
    until(lambda: wrenches and torques, "not all topics come")
    state, pose = fresh(everything), fresh(poses)
    assert pose.header.frame_id == state.header.frame_id == wrenches[-1].header.frame_id == "link_0"
    assert np.abs(np.array(state.position) - client.place().q).max() < 1e-3
    assert abs(pose.pose.position.z - state.pose.position.z) < 1e-3
    assert np.abs(np.array(torques[-1].effort) - state.torque_external).max() < 1.0
    assert not torques[-1].position


def test_the_status_waits_for_late_subscribers(client: Client) -> None:
    found = collect("/heptarm/status", Status)
    until(lambda: found, "the status is not kept")
    assert found[0].connected and found[0].active and found[0].ready_to_move
    assert found[0].operation_mode == Status.MODE_AUT and found[0].text == "ready"


def test_diagnostics_name_the_node_and_the_cabinet(client: Client) -> None:
    found = collect("/diagnostics", DiagnosticArray)
    until(lambda: found, "no diagnostics come")
    status = found[0].status[0]
    assert status.name == "heptarm: arm" and status.level == 0 and status.hardware_id
    assert {pair.key: pair.value for pair in status.values}["connected"] == "yes"


def test_a_joint_command_moves_the_joints_it_names(client: Client) -> None:
    here = rests(client)
    publisher("/heptarm/command/joint", JointState).publish(
        JointState(name=["A7", "A2"], position=[0.3, 0.2])
    )
    wanted = here.copy()
    wanted[[6, 1]] = 0.3, 0.2
    until(lambda: np.abs(client.place().q - wanted).max() < 2e-3, "the arm does not arrive")


def test_poses_are_gone_to_by_joints_and_on_a_line(client: Client) -> None:
    home = np.radians([0, 30, 0, -90, 0, 60, 0])
    publisher("/heptarm/command/joint", JointState).publish(JointState(position=home.tolist()))
    arrives(client, home)
    poses = collect("/heptarm/pose", PoseStamped)
    for topic, change in (("command/pose", -0.05), ("command/lin", 0.05)):
        target = fresh(poses)
        count = len(poses)
        target.pose.position.z += change
        publisher(f"/heptarm/{topic}", PoseStamped).publish(target)
        until(
            lambda: abs(poses[-1].pose.position.z - target.pose.position.z) < 1e-3,  # noqa: B023
            f"{topic}: the flange does not arrive",
        )
        rests(client)
    xs = np.array([one.pose.position.x for one in poses[count:]])
    assert np.ptp(xs) < 2e-3, "a line is a line"


def test_a_pose_in_another_frame_is_refused_in_words(client: Client, node: NodeProcess) -> None:
    here = rests(client)
    message = PoseStamped()
    message.header.frame_id, message.pose.orientation.w = "table", 1.0
    publisher("/heptarm/command/pose", PoseStamped).publish(message)
    node.waits_for("got 'table'")
    assert np.abs(client.place().q - here).max() < 1e-3


def test_a_servo_topic_is_followed_until_it_falls_silent(client: Client) -> None:
    here = rests(client)
    servo = publisher("/heptarm/servo/joint", JointState)
    there = here + 0.1 * (np.arange(7) == 0)

    def followed() -> bool:
        servo.publish(JointState(name=["A1"], position=[there[0]]))
        return bool(np.abs(client.place().q - there).max() < 2e-3)

    until(followed, "the arm does not follow")
    assert np.abs(rests(client) - there).max() < 3e-3


def test_velocities_are_followed_until_they_fall_silent(client: Client) -> None:
    here = rests(client)
    servo = publisher("/heptarm/servo/velocity", JointState)

    def followed() -> bool:
        servo.publish(JointState(name=["A1"], velocity=[-0.2]))
        return bool(client.place().q[0] < here[0] - 0.1)

    until(followed, "the arm does not follow")
    assert np.abs((rests(client) - here)[1:]).max() < 2e-3


def test_a_stop_ends_a_motion_and_a_goal(client: Client) -> None:
    stop = publisher("/heptarm/stop", Empty)
    publisher("/heptarm/command/joint", JointState).publish(JointState(name=["A1"], position=[2.8]))
    until(lambda: client.place().dq[0] > 0.1, "the arm does not set out")
    stop.publish(Empty())
    assert rests(client)[0] < 2.7
    sent = client.send(long(client))
    until(lambda: client.feedback(sent), "the goal does not begin")
    answer = call("/heptarm/stop", Trigger)
    assert answer.success and answer.message == "stopped"
    assert client.result(sent).code != 0
    rests(client)


def test_services_say_why_they_did_nothing(client: Client) -> None:
    answer = call("/heptarm/set_override", SetNumber, value=1.5)
    assert not answer.success and "1.5" in answer.message
    assert call("/heptarm/recover", Trigger).success


def test_life_cycle(client: Client) -> None:
    assert call("/heptarm/cleanup", Trigger).success
    until(lambda: quiet(client), "states come from a node that is disconnected")
    assert not client.send(step_nowhere(client)).accepted
    refused = call("/heptarm/activate", Trigger)
    assert not refused.success and "configure" in refused.message
    assert call("/heptarm/configure", Trigger).success
    assert call("/heptarm/activate", Trigger).success
    client.ready()
    assert client.result(client.send(step(client))).code == 0


def step_nowhere(client: Client) -> TrajectoryGoal:
    return TrajectoryGoal(client.joints, (TrajectoryPoint(1.0, (0.0,) * 7),))


def test_parameters_change_while_the_node_runs_and_the_fixed_ones_do_not(
    client: Client, node: NodeProcess
) -> None:
    assert client.set(allow_partial_joints_goal=True)
    assert not client.set(state_rate=50.0)
    rospy.set_param("/heptarm/constraints/goal_time", -5.0)
    node.waits_for("parameters not applied")
    rospy.delete_param("/heptarm/constraints/goal_time")


def test_streams_and_replaced_trajectories_leave_no_warnings(client: Client, node: NodeProcess) -> None:
    begin = len(node.said)
    here, last = streamed(client, rate=100.0)
    arrives(client, last)
    client.topic(goal(client, point(5.0, here)))
    client.sleep(0.3)
    client.topic(goal(client, point(1.0, here)))
    arrives(client, here)
    assert "WARN" not in node.said[begin:], node.said[begin:]
