"""Commands that a client may send, and those that end the motion, as on a cabinet."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan, sin

import numpy as np
import pytest

from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.version import Version
from heptarm.model.kinematics import forward
from heptarm.sim.fri import cartesian, controller_side
from heptarm.sim.fri.controller_side import MIRRORED
from heptarm.sim.fri.overlay import MotionOverlay
from heptarm.sim.fri.settings import SessionConfiguration
from heptarm.values.pose import Pose
from tests.long import longer
from tests.sim_fri.rig import READY, Law, Rig, State, mirror

TORQUE = MotionOverlay(m.CommandMode.TORQUE, m.ControlMode.JOINT_IMPEDANCE)
WRENCH = MotionOverlay(m.CommandMode.WRENCH, m.ControlMode.CARTESIAN_IMPEDANCE)
POSE = MotionOverlay(m.CommandMode.CARTESIAN_POSE)


def beside(axis: int, offset: float) -> tuple[float, ...]:
    return tuple(q + offset if i == axis - 1 else q for i, q in enumerate(READY))


def seconds(message: m.Monitoring) -> float:
    assert message.monitor is not None and message.monitor.stamp is not None
    stamp = message.monitor.stamp
    return stamp.seconds - 1_700_000_000 + stamp.nanoseconds * 1e-9


def sine(amplitude: float, start: float) -> Law:
    """A4 on a sine that starts at its crest, at rest."""

    def law(message: m.Monitoring) -> m.Command:
        time = max(0.0, seconds(message) - start)
        return replace(mirror(message), q=beside(4, amplitude * sin(2 * time) ** 2))

    return law


def wave(time: float, amplitude: float) -> float:
    return READY[3] + amplitude * sin(2 * time) ** 2


# ------------------------------------------------------------------------------ what is carried out

#: Receive period and multiplier; each with one version, and in the long run with each.
RECEIVED = [(1, 1), (1, 2), (5, 1), (10, 1)]


@pytest.mark.parametrize(
    ("version", "receive"),
    longer(
        list(zip(Version, RECEIVED, strict=True)),
        [(version, receive) for version in Version for receive in RECEIVED],
    ),
)
def test_the_arm_follows_a_law_one_and_a_half_receive_periods_behind(
    version: Version, receive: tuple[int, int]
) -> None:
    rig = Rig(configuration=SessionConfiguration(version, *receive)).active()
    start = rig.now * 1e-9
    rig.client.law = sine(0.3, start)
    first = len(rig.arm.track)
    rig.run(2000)
    assert rig.controller.state is State.COMMANDING_ACTIVE, rig.reported
    # a message, its answer in the next tick, one receive period of transfer, the mean over one: the delay in ticks
    period = receive[0] * receive[1]
    delay = period + (0 if period == 1 else 1) + 0.5 * (period - 1)
    ticks = np.arange(500, 2000)
    expected = np.array([wave((tick + 1 - delay) * 1e-3, 0.3) for tick in ticks])
    got = np.array(rig.arm.track)[first + ticks, 3]
    assert float(np.abs(got - expected).max()) < 1e-3
    assert (rig.arm.leaps <= 1.2 * rig.arm.robot.dq_max * 1e-3 + 1e-12).all()


def test_torques_go_through_as_they_are_while_they_come() -> None:
    rig = Rig().active(TORQUE)
    tau = (1.0, -2.0, 3.0, 0.0, 0.5, 0.25, -0.125)
    rig.command(tau=tau)
    rig.run(20)
    given, wrench = rig.arm.loads[-1]
    assert given is not None and given.tolist() == list(tau) and wrench is None
    rig.silent = True
    rig.run(15)
    assert rig.controller.state is State.COMMANDING_ACTIVE
    assert rig.arm.loads[-1] == (None, None), "a torque that nobody renews ends"


def test_a_wrench_goes_through_as_it_is() -> None:
    rig = Rig(Version.V1_11).active(WRENCH)
    rig.command(wrench=(1.0, 2.0, -30.0, 0.1, 0.2, 0.3))
    rig.run(20)
    tau, wrench = rig.arm.loads[-1]
    assert tau is None and wrench is not None and wrench.tolist() == [1.0, 2.0, -30.0, 0.1, 0.2, 0.3]


def test_torques_of_answers_to_waiting_messages_are_ignored() -> None:
    rig = Rig().ready()
    rig.client.waiting = lambda message: replace(mirror(message), tau=(30.0,) * 7)
    rig.run(50)
    rig.controller.start(TORQUE)
    rig.run(9)
    rig.latency = 2_900_000  # answers to waiting messages are in transit when commanding becomes active
    rig.until(State.COMMANDING_ACTIVE)
    rig.command(tau=(1.0,) * 7)
    rig.run(6)
    given = [tau for tau, _ in rig.arm.loads if tau is not None]
    assert given[-1].tolist() == [1.0] * 7 and max(float(tau.max()) for tau in given) == 1.0


def test_a_pose_is_reached_with_the_a3_that_goes_with_it() -> None:
    rig = Rig(Version.V2_7).active(POSE)
    start, a3 = Pose.from_matrix(forward(rig.arm.robot, READY)), READY[2]
    done = 400

    def law(message: m.Monitoring) -> m.Command:
        fraction = min(1.0, (message.header.sequence - first) / done)
        x, y, z = (1e3 * (start.xyz + fraction * np.array((0.05, -0.04, 0.03)))).tolist()
        i, j, k, w = start.quat.tolist()
        pose = m.Transformation("any", (x, y, z, w, i, j, k))
        return m.Command(
            m.Header(0, 0), pose=pose, redundancy=m.Redundancy(m.RedundancyStrategy.E1, a3 + 0.1 * fraction)
        )

    first = rig.client.seen[-1].header.sequence
    rig.client.law = law
    rig.run(done + 20)
    assert rig.controller.state is State.COMMANDING_ACTIVE, rig.reported
    reached = Pose.from_matrix(forward(rig.arm.robot, rig.arm.q))
    assert reached.xyz == pytest.approx(start.xyz + (0.05, -0.04, 0.03), abs=1e-6)
    assert reached.angle_to(start) < 1e-6 and rig.arm.q[2] == pytest.approx(a3 + 0.1, abs=1e-6)


def test_a_pose_without_redundancy_keeps_a3() -> None:
    rig = Rig(Version.V2_5).active(POSE)

    def law(message: m.Monitoring) -> m.Command:
        assert message.ipo is not None and message.ipo.pose is not None
        x, *rest = message.ipo.pose.values
        return m.Command(message.header, pose=m.Transformation("any", (x + 0.1, *rest)))

    rig.client.law = law
    rig.run(10)
    assert rig.controller.state is State.COMMANDING_ACTIVE, rig.reported
    assert rig.arm.q[2] == pytest.approx(READY[2], abs=1e-9) and rig.arm.q[3] != READY[3]


# ------------------------------------------------------------------------------ what ends the motion


@pytest.mark.parametrize(
    ("fields", "cause", "text"),
    [
        (
            {"q": beside(4, 0.5)},
            "limit",
            "Illegal axis delta: A4 by 28.648 deg in 1 ms; allowed is 0.090 deg",
        ),
        ({"q": beside(1, 1.9e-3)}, "limit", "Illegal axis delta: A1"),
        ({"q": beside(7, 3.2)}, "limit", "Illegal axis position: A7"),
        ({"q": beside(3, nan)}, "limit", "Illegal axis position: A3 is not finite"),
        ({"q": beside(3, -inf)}, "limit", "Illegal axis position: A3 is not finite"),
        ({"q": None}, "field", "Illegal command: no joint position in command mode POSITION"),
    ],
)
def test_an_illegal_position_ends_the_motion_and_the_arm_has_not_moved(
    fields: dict[str, object], cause: str, text: str
) -> None:
    rig = Rig().active()
    rig.run(10)
    rig.command(**fields)
    rig.run(3)
    assert rig.end.cause == cause and text in rig.end.text
    assert rig.controller.state is State.MONITORING_READY and rig.controller.superposition is None
    assert rig.arm.q == pytest.approx(np.array(READY), abs=1e-12)


@pytest.mark.parametrize(
    ("overlay", "fields", "text"),
    [
        (TORQUE, {"tau": None}, "no joint torque"),
        (TORQUE, {"q": None}, "no joint position"),
        (TORQUE, {"tau": (0.0, 400.0, *(0.0,) * 5)}, "Illegal torque: A2 400 Nm; allowed is 320 Nm"),
        (TORQUE, {"tau": (0.0,) * 6 + (nan,)}, "Illegal torque: A7"),
        (TORQUE, {"q": beside(2, 0.2)}, "Illegal axis delta: A2"),
        (WRENCH, {"wrench": None}, "no wrench"),
        (WRENCH, {"wrench": (0.0, 0.0, -501.0, 0.0, 0.0, 0.0)}, "Illegal wrench"),
        (WRENCH, {"wrench": (0.0, 0.0, nan, 0.0, 0.0, 0.0)}, "Illegal wrench"),
        (POSE, {"pose": None}, "no Cartesian pose"),
        (POSE, {"pose": m.Transformation("p", (nan, 0, 0, 1, 0, 0, 0))}, "must be finite"),
        (POSE, {"pose": m.Transformation("p", (400, 0, 400, 2, 0, 0, 0))}, "unit quaternion"),
        (POSE, {"pose": m.Transformation("p", (4000.0, 0, 400, 1, 0, 0, 0))}, "4.001 m from the shoulder"),
        (POSE, {"redundancy": m.Redundancy(m.RedundancyStrategy.E1, inf)}, "redundancy"),
        (POSE, {"redundancy": m.Redundancy(m.RedundancyStrategy.E1, 0.5)}, "Illegal axis delta"),
    ],
)
def test_an_illegal_command_of_another_mode_ends_the_motion(
    overlay: MotionOverlay, fields: dict[str, object], text: str
) -> None:
    rig = Rig(Version.V2_7).active(overlay)
    rig.command(**fields)
    rig.run(4)
    assert rig.end.is_error and text in rig.end.text and rig.controller.state is State.MONITORING_READY


def test_under_a_torque_overlay_the_position_may_lie_a_tenth_beside() -> None:
    rig = Rig().active(TORQUE)
    rig.command(q=beside(2, 0.1))
    rig.run(100)
    assert rig.controller.state is State.COMMANDING_ACTIVE
    assert rig.arm.q[1] == pytest.approx(READY[1] + 0.1)
    assert (rig.arm.leaps <= 1.2 * rig.arm.robot.dq_max * 1e-3 + 1e-12).all()


@pytest.mark.parametrize(("missing", "state"), [(0, State.MONITORING_READY), (4, State.COMMANDING_ACTIVE)])
def test_what_may_be_far_after_a_gap_may_not_be_so_at_once(missing: int, state: m.SessionState) -> None:
    rig = Rig().active()
    rig.run(100)
    rig.silent = True
    rig.run(missing)
    rig.silent = False
    rig.command(q=beside(4, 0.0075))  # just under five ticks at full speed
    rig.run(30)
    assert rig.controller.state is state
    assert (rig.arm.leaps <= 1.2 * rig.arm.robot.dq_max * 1e-3 + 1e-12).all()


def test_the_next_overlay_begins_where_the_arm_is() -> None:
    rig = Rig().active()
    rig.client.law = sine(0.2, rig.now * 1e-9)
    rig.run(300)
    rig.command(q=beside(1, 1.0))
    rig.run(5)
    assert rig.end.cause == "limit"
    there = rig.arm.q.copy()
    rig.client.law = mirror
    rig.controller.start(MotionOverlay())
    rig.until(State.COMMANDING_ACTIVE).run(50)
    assert rig.arm.q == pytest.approx(there, abs=1e-12) and there[3] != READY[3]


# ------------------------------------------------------------------------------ synchronising


@pytest.mark.parametrize(
    ("overlay", "fields", "text"),
    [
        (MotionOverlay(), {"q": beside(5, 0.1)}, "its A5 is 5.73 deg off the interpolator's"),
        (MotionOverlay(), {"q": beside(5, nan)}, "its A5 is nan deg off"),
        (TORQUE, {"tau": None}, "its answers carry no joint torque"),
        (WRENCH, {"wrench": None}, "its answers carry no wrench"),
        (POSE, {"pose": m.Transformation("p", (0, 0, 0, 1, 0, 0, 0))}, "mm and"),
        (POSE, {"pose": m.Transformation("p", (0, 0, 0, 0, 0, 0, 0))}, "unit quaternion"),
    ],
)
def test_a_client_that_does_not_mirror_never_commands(
    overlay: MotionOverlay, fields: dict[str, object], text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(controller_side, "SYNCHRONISATION", 200_000_000)
    rig = Rig(Version.V2_5)
    rig.client.waiting = lambda message: replace(mirror(message), **fields)  # type: ignore[arg-type]
    rig.waiting(overlay).until(State.MONITORING_READY)
    assert rig.end.cause == "synchronisation" and text in rig.end.text
    assert State.COMMANDING_ACTIVE not in rig.states


def test_mirroring_is_ten_answers_in_a_row() -> None:
    rig, count = Rig(), 0

    def waiting(message: m.Monitoring) -> m.Command:
        nonlocal count
        count += 1
        return replace(mirror(message), q=beside(1, 0.1)) if count == MIRRORED else mirror(message)

    rig.client.waiting = waiting
    rig.active()
    assert count == 2 * MIRRORED or count == 2 * MIRRORED + 1


def test_a_pose_from_its_own_joints_is_found_from_near() -> None:
    rig = Rig()
    robot, generator = rig.arm.robot, np.random.default_rng(3)
    for _ in range(200):
        q = np.array(READY) + generator.uniform(-0.6, 0.6, 7)
        near = q + generator.uniform(-0.02, 0.02, 7)
        goal = cartesian.matrix(cartesian.transformation(robot, tuple(q.tolist())))
        assert cartesian.joints(robot, goal, q[2], near) == pytest.approx(q, abs=1e-6)


@pytest.mark.parametrize("axis", [2, 4, 6])
def test_a_pose_of_a_straight_joint_is_found_as_well(axis: int) -> None:
    robot, q = Rig().arm.robot, np.array(READY)
    q[axis - 1] = 2e-4
    near = q + 0.01
    goal = cartesian.matrix(cartesian.transformation(robot, tuple(q.tolist())))
    found = cartesian.joints(robot, goal, q[2], near)
    assert forward(robot, found) == pytest.approx(goal, abs=1e-9)
    assert found[2] == pytest.approx(q[2], abs=1e-12) and np.abs(found - near).max() < 0.05
