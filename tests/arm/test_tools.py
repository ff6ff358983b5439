"""Tools, workpieces and frames through the whole stack, on the virtual cabinet."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm import Arm, Tool, Workpiece
from heptarm.arm.devices.tools import Tooling
from heptarm.errors import CommandRejected, ModeConflict
from heptarm.model import dynamics
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import Position
from heptarm.values.motion.line import Lin, LinRel, lin, lin_rel
from heptarm.values.motion.motion import hold
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import Pose, deg
from heptarm.values.tool import KnownTool
from heptarm.wire.codes import Code
from tests.conftest import RunningCabinet
from tests.doubles.test_tools import PROJECT as DOUBLES_PROJECT
from tests.simulators import FASTER

HOME = deg(0, 30, 0, -90, 0, 60, 0)
PATIENCE = 5.0
#: Of the shared virtual cabinet.
SPEED = FASTER
TIP = Pose.xyz_abc(0.03, 0.0, 0.15, *deg(0, 90, 0))
GRIPPER = Tool("gripper", mass=2.0, com=(0.0, 0.0, 0.08), tcp=TIP, frames={"pad": Pose.at(0.0, 0.04, 0.1)})
PART = Workpiece("part", mass=1.0, com=(0.0, 0.0, 0.05), frames={"peg": Pose.at(0.0, 0.0, 0.1)})


PROJECT = DOUBLES_PROJECT.replace('mass="3.0"', 'mass="1.5"').replace(
    "</RoboticsAPIData>",
    '<processData dataType="java.lang.String" id="heptarm.frames" value="/Table/Corner, /Gone"/></RoboticsAPIData>',
)


@pytest.fixture
def bare(cabinet: RunningCabinet) -> Iterator[Arm]:
    """An arm at home with nothing on its flange, before and after; patient, for busy machines."""
    with ha.connect(cabinet.target, watchdog=PATIENCE) as arm:
        arm.detach_tool()
        arm.move(ptp(HOME))
        yield arm
        arm.wait_for_rest()
        arm.detach_tool()


def fresh(arm: Arm) -> ha.State:
    """A state sampled after the call, which includes all earlier effects."""
    now = arm.state.stamp
    return arm.wait_until(lambda s: s.stamp > now + 30_000_000)


def settled(arm: Arm) -> ha.State:
    """A state after the arm has settled under another load."""
    arm.move(hold(0.5))
    return fresh(arm)


def test_the_state_names_the_tool_and_its_pose_is_the_tips(bare: Arm) -> None:
    flange = fresh(bare).pose
    assert fresh(bare).tool == ""
    with bare.tool(GRIPPER):
        state = fresh(bare)
        assert (state.tool, state.workpiece, state.frame) == ("gripper", "", "tcp")
        assert state.pose.distance_to(flange @ TIP) < 1e-4
        assert state.pose.angle_to(flange @ TIP) < 1e-4
        with bare.attached(PART):
            control = fresh(bare).groups.mode
            assert control is not None
            assert (control.tool, control.workpiece) == ("gripper", "part")
    state = fresh(bare)
    assert state.tool == ""
    assert state.pose.distance_to(flange) < 1e-4


def test_while_tools_are_changed_every_pose_is_of_the_flange_or_of_the_tip(bare: Arm) -> None:
    flange = fresh(bare).pose
    bare.subscribe(rate=500)
    seen = bare.states(size=50_000)
    for _ in range(20):
        with bare.tool(GRIPPER):
            fresh(bare)
    end = bare.state.stamp
    for state in seen:
        assert min(state.pose.distance_to(flange), state.pose.distance_to(flange @ TIP)) < 1e-3
        if state.stamp >= end:
            break


def test_the_motors_carry_it_and_nothing_is_felt(bare: Arm) -> None:
    before = fresh(bare)
    with bare.tool(GRIPPER), bare.attached(PART):
        bare.move(hold(0.3))
        state = fresh(bare)
        expected = dynamics.gravity(bare.robot, state.q, load=GRIPPER.body) - dynamics.gravity(
            bare.robot, state.q
        )
        assert np.abs(state.tau_ext).max() < 0.01
        assert np.abs(state.wrench.array).max() < 0.02
        more = state.tau - before.tau
        assert abs(more[1]) > abs(expected[1]) + 2.0  # plus the weight of the part
        assert state.q == pytest.approx(before.q, abs=1e-4)


def test_motions_move_the_tip_or_what_they_name(bare: Arm) -> None:
    with bare.tool(GRIPPER):
        start = fresh(bare).pose
        bare.move(lin_rel(z=0.03))  # along the tip's own z, which points along the flange's x
        end = fresh(bare).pose
        assert end.distance_to(start @ Pose.at(0, 0, 0.03)) < 2e-4
        target = start @ Pose.xyz_abc(0, 0, 0, *deg(10, 0, 0))
        bare.move(lin(target))
        assert fresh(bare).pose.distance_to(target) < 2e-4
        assert fresh(bare).pose.angle_to(target) < 1e-3
        for name, make in (("pad", lin), ("flange", ptp)):
            target = bare.pose(name) @ Pose.at(0, 0.01, 0.02)
            bare.move(make(target, moving=name))
            fresh(bare)
            assert bare.pose(name).distance_to(target) < 2e-4
        with bare.attached(PART):
            bare.move(ptp(HOME))
            fresh(bare)
            peg = bare.pose("part/peg")
            assert peg.distance_to(bare.pose() @ Pose.at(0, 0, 0.1)) < 1e-4
            bare.move(lin_rel(x=0.02, frame="flange", moving="peg"))
            fresh(bare)
            moved = peg.inverse() @ bare.pose("peg")
            assert bare.pose("peg").distance_to(peg) == pytest.approx(0.02, abs=2e-4)
            assert moved.z == pytest.approx(0.02, abs=2e-4)  # the flange's x is the peg's z
    bare.move(ptp(HOME))


def test_another_frame_of_the_tool_can_be_the_default(bare: Arm) -> None:
    bare.attach_tool(GRIPPER, frame="pad")
    assert fresh(bare).pose.distance_to(bare.pose("pad")) < 1e-4
    assert bare.pose("tcp", reference="pad").distance_to(GRIPPER.frame("pad").inverse() @ TIP) < 1e-5
    bare.attach_tool("gripper")  # it is known by its name now
    control = fresh(bare).groups.mode
    assert control is not None
    assert control.frame == "tcp"
    known = KnownTool("gripper", 2.0, GRIPPER.frames, com=GRIPPER.com, inertia=GRIPPER.inertia)
    assert bare.tools["gripper"] == known


def test_the_wrench_is_reported_where_and_as_one_likes() -> None:
    """With too light load data, the rest of the weight counts as an external force."""
    heavy = Tool("heavy", mass=3.0, com=(0.0, 0.0, 0.1), tcp=Pose.at(0, 0, 0.2))
    with ha.connect("sim://iiwa14?speed=3&payload=3,0,0,0.1", watchdog=PATIENCE) as arm:
        arm.move(ptp(HOME))
        state = settled(arm)
        assert state.wrench.force == pytest.approx((0, 0, -29.43), abs=0.3)
        assert np.abs(state.tau_ext).max() > 10.0
        with arm.tool(heavy):
            assert np.abs(settled(arm).wrench.array).max() < 0.1
        arm.attach_tool(Tool("light", mass=1.0, com=(0.0, 0.0, 0.1), tcp=Pose.at(0, 0, 0.2)))
        settled(arm)
        at_tip, at_flange = arm.wrench(), arm.wrench("flange")
        assert at_tip.force == pytest.approx((0, 0, -19.62), abs=0.3)
        com = (arm.pose("flange") @ Pose.at(0, 0, 0.1)).xyz
        for frame, seen in (("tool", at_tip), ("flange", at_flange)):
            lever = com - arm.pose(frame).xyz
            assert seen.torque == pytest.approx(np.cross(lever, seen.force), abs=0.1)
        turned = arm.wrench("flange", axes="flange")
        assert turned.force == pytest.approx(arm.pose("flange").rotation.T @ at_flange.force, abs=0.05)


def test_a_servo_motion_under_impedance_needs_the_load_to_be_right() -> None:
    compliant = JointImpedance(500.0)
    with ha.connect("sim://iiwa14?speed=3&payload=5,0,0,0.1", watchdog=PATIENCE) as arm:
        arm.move(ptp(HOME))
        with pytest.raises(ha.NotReady, match="load data"), arm.servo(mode=compliant, watchdog=2.0):
            pass
        with arm.tool(Tool("weight", mass=5.0, com=(0, 0, 0.1))):
            settled(arm)
            with arm.servo(mode=compliant, watchdog=2.0) as sv:
                assert sv.tick()
                sv.set(arm.state.q)


def test_a_servo_motion_moves_the_chosen_frame(bare: Arm) -> None:
    with bare.tool(GRIPPER):
        for moving in ("tool", "pad"):
            with bare.servo("pose", rate=50, moving=moving, watchdog=2.0) as sv:
                target = bare.pose(moving) @ Pose.at(0, 0, 0.01)
                while sv.tick() and sv.t < 20.0 and bare.pose(moving).distance_to(target) > 4e-4:
                    sv.set(target)
            assert bare.wait_for_rest()
            assert bare.pose(moving).distance_to(target) < 5e-4
    bare.move(ptp(HOME))


def test_the_mode_in_force_is_read_back(bare: Arm) -> None:
    compliant = CartesianImpedance(
        (1500, 1500, 800, 100, 100, 100), damping=0.8, nullspace_stiffness=20.0, frame="base"
    )
    assert fresh(bare).mode == Position()
    handle = bare.start(hold(), mode=compliant)
    assert bare.wait_until(lambda s: s.mode != Position(), timeout=10).mode == compliant
    handle.cancel()
    handle.wait(timeout=10)
    with bare.servo(mode=JointImpedance(400.0), watchdog=2.0) as sv:
        sv.tick()
        sv.set(sv.start.q)
        assert bare.wait_until(lambda s: s.mode == JointImpedance(400.0), timeout=10)


def test_nothing_changes_on_the_flange_while_the_arm_moves(bare: Arm) -> None:
    with bare.tool(GRIPPER):
        handle = bare.start(hold())
        with pytest.raises(ModeConflict, match="is running"):
            bare.attach_tool(GRIPPER)
        with pytest.raises(ModeConflict, match="is running"):
            bare.detach_tool()
        with pytest.raises(ModeConflict, match="is running"):
            bare.attach_workpiece(PART)
        handle.cancel()
        handle.wait(timeout=10)
        with bare.attached(PART), pytest.raises(ModeConflict, match="part is attached"):
            bare.attach_workpiece(Workpiece("other"))
    with pytest.raises(CommandRejected, match="workpiece part is not attached"):
        bare.detach_workpiece(PART)


def test_an_error_in_the_block_takes_the_tool_off_and_comes_through(bare: Arm) -> None:
    with pytest.raises(ZeroDivisionError), bare.tool(GRIPPER):
        bare.start(lin_rel(z=0.01))
        bare.stop()
        raise ZeroDivisionError
    assert fresh(bare).tool == ""


def test_tools_and_places_of_the_project(tmp_path: Path) -> None:
    file = tmp_path / "RoboticsAPI.data.xml"
    file.write_text(PROJECT)
    with ha.connect(f"sim://iiwa14?speed=3&project={file}", watchdog=PATIENCE) as arm:
        assert list(arm.tools) == ["Gripper"]
        assert arm.tools["Gripper"].mass == 1.5
        assert arm.frames["/Table/Corner"].xyz == pytest.approx((0.51, 0.02, 0.1))
        arm.move(ptp(HOME))
        with arm.tool("Gripper"):
            assert fresh(arm).pose.distance_to(arm.pose("flange") @ Pose.at(0, 0, 0.12)) < 1e-4
            assert np.abs(settled(arm).tau_ext).max() < 0.05
            before = arm.pose(reference="/Table/Corner")
            arm.move(lin_rel(x=-0.02, frame="/Table/Corner"))
            fresh(arm)
            assert arm.pose(reference="/Table/Corner").x - before.x == pytest.approx(-0.02, abs=2e-4)
            corner = arm.frames["/Table/Corner"]
            there = Pose.of(before.xyz + (0.01, 0.0, 0.02), before.quat)
            arm.move([lin(before, frame="/Table/Corner"), ha.spline([there], frame="/Table/Corner")])
            assert fresh(arm).pose.distance_to(corner @ there) < 2e-4
            arm.move(ptp(before, frame="/Table/Corner", near=HOME))
            assert fresh(arm).pose.angle_to(corner @ before) < 1e-3
            for wrong in ("tool", "Tip", "/Table/Gone"):
                with pytest.raises(
                    CommandRejected, match=f"must be one of base, /Table/Corner, got '{wrong}'"
                ):
                    arm.move(lin(there, frame=wrong))
            assert arm.plan(lin(there, frame="/Table/Corner")).end.distance_to(corner @ there) < 1e-6
            arm.move(hold(0.2), mode=CartesianImpedance(frame="/Table/Corner"))
            arm.move(hold(0.2), mode=CartesianImpedance(frame="Tip"))  # that of the motion frame
            with pytest.raises(CommandRejected, match="got flange"):
                arm.move(hold(0.2), mode=CartesianImpedance(frame="flange"))
        with pytest.raises(CommandRejected, match="Gripper"):
            arm.attach_tool("Cube")  # a workpiece's template
        with pytest.raises(CommandRejected, match="template"):
            arm.attach_tool(Tool("Gripper"))


#: What a client refuses by itself, and the message that bypasses the check.
UNKNOWN: dict[str, Callable[[], Lin | LinRel]] = {
    "moved": lambda: lin_rel(z=0.01, moving="pad"),
    "axes": lambda: lin_rel(z=0.01, frame="nowhere"),
    "target": lambda: lin(Pose.at(0.5, 0, 0.5), moving="pad"),
}


@pytest.mark.parametrize("name", UNKNOWN)
def test_frames_that_nothing_has_are_refused_on_both_sides(
    bare: Arm, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    fresh(bare)
    with pytest.raises(CommandRejected, match="must be one of flange, tool") as here:
        bare.move(UNKNOWN[name]())
    monkeypatch.setattr(Tooling, "check", lambda _self, _motions, _mode: None)
    with pytest.raises(CommandRejected) as there:
        bare.move(UNKNOWN[name]())
    assert here.value.code == there.value.code == Code.UNKNOWN_NAME
    assert here.value is not there.value


def test_a_mode_with_an_unknown_frame_and_an_unknown_tool_are_refused(bare: Arm) -> None:
    fresh(bare)
    with pytest.raises(CommandRejected, match="nowhere") as refused:
        bare.move(hold(0.1), mode=CartesianImpedance(frame="nowhere"))
    assert refused.value.code == 42
    with pytest.raises(CommandRejected, match="no tool hammer"):
        bare.attach_tool("hammer")
    with pytest.raises(CommandRejected, match="'tip'"):
        bare.attach_tool(GRIPPER, frame="tip")
    with pytest.raises(CommandRejected, match="'tip'"):
        bare.pose("tip")


def test_what_hangs_there_outlives_its_client(cabinet: RunningCabinet, bare: Arm) -> None:
    bare.attach_tool(GRIPPER)
    with ha.connect(cabinet.target, control=False) as other:
        state = other.wait_until(lambda s: s.tool == "gripper")
        assert state.tool == "gripper"
        assert other.tools["gripper"].frame_names == ("tcp", "pad")
        assert other.pose("pad").distance_to(other.pose("flange") @ GRIPPER.frame("pad")) < 1e-6


def test_a_load_above_the_rated_one_is_warned_of(bare: Arm, caplog: pytest.LogCaptureFixture) -> None:
    with bare.tool(GRIPPER):
        assert "rated load" not in caplog.text
        with bare.attached(Workpiece("engine", mass=12.5)):
            assert (
                "attached load is 14.5 kg, and the rated load of the LBR iiwa 14 R820 is 14 kg" in caplog.text
            )
    caplog.clear()
    with bare.tool(Tool("drill", mass=15.0)):
        assert "attached load is 15 kg" in caplog.text
