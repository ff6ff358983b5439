"""Shapes of tools on the simulated flange: they meet the table, and the force is felt at the tip."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import heptarm as ha
from heptarm import shapes
from heptarm.when import force
from tests.simulators import FASTER

pytestmark = pytest.mark.slow
HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
#: Height of the table [m].
TABLE = 0.2
TIP = ha.Pose.at(0.0, 0.0, 0.15)
PEN = ha.Tool("pen", tcp=TIP, shapes=[shapes.capsule(0.01, 0.13, at=ha.Pose.at(0, 0, 0.075))])
CUBE = ha.Workpiece("cube", shapes=[shapes.box(0.02, 0.02, 0.02, at=ha.Pose.at(0, 0, 0.01))])


@pytest.fixture(scope="module")
def arm() -> Iterator[ha.Arm]:
    target = f"sim://iiwa14?speed={FASTER:g}&box=0.6,0,{TABLE / 2},0.4,0.8,{TABLE}"
    with ha.connect(target, watchdog=5.0, timeout=30.0) as arm:
        yield arm


@pytest.fixture(autouse=True)
def at_home(arm: ha.Arm) -> None:
    arm.detach_tool()
    arm.move(ha.ptp(HOME))


def pressed(arm: ha.Arm) -> ha.Result:
    """Go down until 8 N, at most to where the flange would be 0.1 m above the table."""
    down = ha.lin_rel(z=-0.1, frame="base", speed_mps=0.02)
    return arm.move(down, until=force > 8.0, then="stay")


def test_the_tip_of_a_tool_meets_the_table(arm: ha.Arm) -> None:
    assert pressed(arm).arrived  # the flange alone meets nothing
    arm.move(ha.ptp(HOME))
    with arm.tool(PEN):
        result = pressed(arm)
        assert not result.arrived
        state = arm.wait_for_rest()
        assert state.pose.z == pytest.approx(TABLE, abs=0.005)
        up = arm.wrench("tool")
        assert up.force[2] > 5.0 and np.abs(up.torque).max() < 0.15
        level = arm.wrench("flange")  # the same force 0.15 m above has a moment only if it is not straight up
        assert np.abs(level.torque - np.cross([0, 0, -TIP.z], up.force)).max() < 0.15
        arm.move(ha.lin_rel(z=0.03, frame="base"))
        arm.attach_workpiece(CUBE)
        assert not pressed(arm).arrived
        assert arm.wait_for_rest().pose.z == pytest.approx(TABLE + 0.02, abs=0.005)
        arm.move(ha.lin_rel(z=0.03, frame="base"))
    assert pressed(arm).arrived  # it is off


def test_the_tool_is_felt_where_it_is_hit(arm: ha.Arm) -> None:
    beam = shapes.box(0.03, 0.3, 0.03, at=ha.Pose.at(0, 0.135, 0.135))
    hook = ha.Tool("hook", tcp=ha.Pose.at(0, 0.285, 0.15), shapes=[beam])
    with arm.tool(hook):
        arm.move(ha.lin(arm.pose() @ ha.Pose.xyz_abc(0, 0, 0, 0, 0, 0.15)))  # the end of the beam is lowest
        assert not pressed(arm).arrived
        state = arm.wait_for_rest()
        assert state.pose.z == pytest.approx(TABLE, abs=0.006)
        arms = arm.pose("tool").xyz - arm.pose("flange").xyz
        moment = np.cross(arms, state.wrench.force)
        assert np.linalg.norm(moment) > 0.8
        assert arm.wrench("flange").torque == pytest.approx(moment, abs=0.2 * float(np.linalg.norm(moment)))


def test_other_clients_know_the_shapes_as_soon_as_they_are_there(arm: ha.Arm) -> None:
    assert arm.connection.cabinet is not None
    with ha.connect(f"sim://127.0.0.1:{arm.connection.cabinet.port}", control=False) as other:
        assert other.shapes == arm.shapes == ()
        with arm.tool(PEN):
            other.wait_until(lambda _: bool(other.shapes))
            assert other.shapes == arm.shapes == tuple((one, one.pose) for one in PEN.shapes)
            arm.attach_workpiece(CUBE)
            other.wait_until(lambda _: len(other.shapes) > 1)
            assert other.shapes == arm.shapes and other.shapes[1][1] == TIP @ CUBE.shapes[0].pose  # type: ignore[misc]
        other.wait_until(lambda _: not other.shapes)


def test_a_client_that_comes_later_knows_the_shapes(arm: ha.Arm) -> None:
    assert arm.connection.cabinet is not None
    port = arm.connection.cabinet.port
    with arm.tool(PEN), ha.connect(f"sim://127.0.0.1:{port}", control=False) as other:
        assert other.tools["pen"].shapes == PEN.shapes
        table = ha.CollisionModel("iiwa14", boxes=[f"0.6,0,{TABLE / 2},0.4,0.8,{TABLE}"])
        down = ha.lin_rel(z=-0.1, frame="base")
        (found,) = other.plan(down, collision_check=table).collisions
        assert found.clearance.first == "pen"
