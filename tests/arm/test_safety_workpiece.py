"""The safety workpiece through the whole stack, on a virtual cabinet whose safety functions monitor torques."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm import Arm, Tool, Workpiece
from heptarm.errors import CommandRejected, ShapeError
from heptarm.model import dynamics
from heptarm.values.motion.line import lin_rel
from heptarm.values.motion.motion import hold
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import Pose, deg
from heptarm.values.robot import robot as find_robot
from tests.arm.test_tools import fresh
from tests.doubles.test_tools import PROJECT
from tests.simulators import FASTER

HOME = deg(0, 30, 0, -90, 0, 60, 0)
#: With little leverage for a load.
UPRIGHT = deg(0, 0, 0, -10, 0, 0, 0)
GRIPPER = Tool("gripper", mass=2.0, com=(0.0, 0.0, 0.08), tcp=Pose.at(0.0, 0.0, 0.15))
CASTING = Workpiece("casting", mass=4.0, com=(0.0, 0.0, 0.05))
#: Limits of the simulator's safety functions [Nm], [kg].
TORQUE, HEAVIEST = 15.0, 5.0
DOWN = lin_rel(z=-0.04, frame="base", speed_mps=0.2)
UP = lin_rel(z=0.04, frame="base", speed_mps=0.2)


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Arm]:
    """A virtual cabinet with such functions, and with templates of workpieces."""
    file: Path = tmp_path_factory.mktemp("project") / "RoboticsAPI.data.xml"
    cube = '<frames><frame name="Top"><transformation z="80.0"/></frame></frames><loadData cogZ="40.0" mass="4.0"/>'
    file.write_text(PROJECT.replace('<loadData mass="0.2"/>', cube))
    target = f"sim://iiwa14?speed={FASTER}&safety={TORQUE},{HEAVIEST}&project={file}"
    with ha.connect(target, watchdog=10.0, timeout=30.0, black_box=False) as arm:
        yield arm


@pytest.fixture
def lifting(cell: Arm) -> Iterator[Arm]:
    """At home, nothing attached, nothing stopped; before and after."""
    cell.detach_tool()
    cell.move(ptp(HOME))
    yield cell
    cell.operator.clear()
    cell.wait_until(lambda s: not s.safety.protective_stop, timeout=20.0)
    cell.recover(timeout=20.0)
    cell.wait_for_rest(timeout=20.0)
    cell.detach_tool()


def test_the_loads_decide_as_the_limit_is_chosen() -> None:
    """The casting alone is beyond the limit."""
    robot = find_robot("iiwa14")
    bare = dynamics.gravity(robot, HOME)
    casting = np.abs(dynamics.gravity(robot, HOME, load=CASTING.body) - bare).max()
    assert casting > 1.2 * TORQUE


def test_a_wrong_limit_is_the_targets_fault() -> None:
    with pytest.raises(ha.HeptarmError, match="safety must be TORQUE") as error:
        ha.connect("sim://iiwa14?safety=heavy")
    assert 'correct the target "sim://iiwa14?safety=heavy"' in str(error.value)


def test_a_safety_workpiece_is_lifted_and_the_state_names_it(lifting: Arm) -> None:
    with lifting.tool(GRIPPER):
        assert fresh(lifting).safety_workpiece == ""
        with lifting.attached(CASTING, safety=True):
            state = fresh(lifting)
            assert (state.workpiece, state.safety_workpiece) == ("casting", "casting")
            assert "gripper, casting (safety workpiece)" in str(state)
            assert lifting.move([DOWN, UP]).arrived
        assert fresh(lifting).safety_workpiece == ""
        assert lifting.move([DOWN, UP]).arrived  # its weight is not missing either


def test_an_ordinary_workpiece_looks_like_a_collision(lifting: Arm) -> None:
    lifting.move(
        ptp(UPRIGHT)
    )  # here the casting is not beyond the limit, so that the arm is stopped in mid-motion
    lifting.attach_tool(GRIPPER)
    lifting.attach_workpiece(CASTING)
    assert fresh(lifting).safety_workpiece == ""
    assert np.abs(fresh(lifting).tau_ext).max() < 1.0  # the motion controller knows its load
    with pytest.raises(ha.MotionAborted) as stopped:
        lifting.move(ptp(HOME, speed=0.1, acceleration=0.1))
    assert stopped.value.cause is ha.Cause.SAFETY
    assert lifting.wait_until(lambda s: s.safety.protective_stop, timeout=20.0).workpiece == "casting"
    lifting.operator.clear()
    lifting.wait_until(lambda s: not s.safety.protective_stop, timeout=20.0)
    assert lifting.recover(timeout=20.0).done
    assert np.abs(fresh(lifting).q - UPRIGHT).max() > 0.1
    lifting.detach_workpiece(CASTING)
    with lifting.attached(CASTING, safety=True):  # the remedy
        assert lifting.move(ptp(HOME)).arrived
        assert lifting.move(DOWN).arrived


def test_it_goes_with_its_tool(lifting: Arm) -> None:
    lifting.attach_tool(GRIPPER)
    lifting.attach_workpiece(CASTING, safety=True)
    lifting.attach_tool(GRIPPER)
    state = fresh(lifting)
    assert (state.tool, state.workpiece, state.safety_workpiece) == ("gripper", "", "")
    assert lifting.move(hold(0.2)).arrived


def test_what_the_safety_configuration_does_not_allow_is_not_attached(lifting: Arm) -> None:
    anvil = Workpiece("anvil", mass=6.0)
    with pytest.raises(
        CommandRejected, match=r"refuses anvil as the safety workpiece: .*6 kg.*allows 5 kg"
    ) as error:
        lifting.attach_workpiece(anvil, safety=True)
    assert error.value.parameter == "safety"
    state = fresh(lifting)
    assert (state.workpiece, state.safety_workpiece) == ("", "")
    assert lifting.move([DOWN, UP]).arrived
    with lifting.attached(anvil):  # as an ordinary one it may be
        assert fresh(lifting).workpiece == "anvil"


def test_the_workpiece_of_a_template(lifting: Arm) -> None:
    with lifting.tool("Gripper"), lifting.attached("Cube", safety=True):
        state = fresh(lifting)
        assert (state.tool, state.workpiece, state.safety_workpiece) == ("Gripper", "Cube", "Cube")
        top = lifting.pose("Cube/Top", reference="flange")
        assert top.distance_to(Pose.at(0.0, 0.0, 0.2)) < 1e-4  # of the gripper's tip, 120 mm
        lifting.move(hold(0.2))
        assert np.abs(fresh(lifting).tau_ext).max() < 0.1
        assert lifting.move([DOWN, UP]).arrived
    with pytest.raises(CommandRejected, match="no workpiece template Sphere"):
        lifting.attach_workpiece("Sphere")
    with pytest.raises(CommandRejected, match="no workpiece template Gripper"):
        lifting.attach_workpiece("Gripper")  # a tool's
    with pytest.raises(ShapeError, match="workpiece must be a Workpiece or str"):
        lifting.attach_workpiece(GRIPPER)  # type: ignore[arg-type]
    with pytest.raises(ShapeError, match="safety must be a bool"):
        lifting.attach_workpiece("Cube", safety=1)  # type: ignore[arg-type]


def test_another_client_sees_it(lifting: Arm) -> None:
    with (
        lifting.attached("Cube", safety=True),
        ha.connect(lifting.connection.link.peer, control=False, timeout=30.0, watchdog=10.0) as observer,
    ):
        assert observer.wait_until(lambda s: s.safety_workpiece == "Cube", timeout=20.0).workpiece == "Cube"
    assert "safety_workpieces" in lifting.capabilities
