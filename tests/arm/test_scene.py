"""Scenes through the whole stack: insertion that fails, collisions foreseen, and the bodies of the world."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm.modes import pressing
from heptarm.skills import insert
from tests.retry import busy, retry
from tests.simulators import PATIENT_AND_FASTER

GRIPPER = ha.Tool("two-finger", mass=1.0, com=(0, 0, 0.05), tcp=ha.Pose.at(0, 0, 0.16))
START = ha.deg(0, 25, 0, -90, 0, 65, 0)
DOWN = (0.0, 1.0, 0.0, 0.0)
EXAMPLE = Path(__file__).parents[2] / "examples" / "16_insertion.py"


@pytest.fixture(scope="module")
def arm() -> Iterator[ha.Arm]:
    with ha.connect("sim://iiwa14?scene=table&speed=3", watchdog=5.0, timeout=30.0) as arm:
        arm.attach_tool(GRIPPER)
        arm.move(ha.ptp(START))
        yield arm


@pytest.fixture(autouse=True)
def at_start(arm: ha.Arm) -> Iterator[None]:
    yield
    arm.collision_check = None
    arm.move([ha.lin_rel(z=0.03, frame="base"), ha.ptp(START)])


def test_bodies_of_the_scene_are_known(arm: ha.Arm) -> None:
    cube = arm.operator.where("cube")
    assert cube.xyz == pytest.approx((0.55, 0.0, 0.22), abs=1e-3)
    with pytest.raises(ha.CommandRejected, match="one of .*cube.*; got 'sphere'"):
        arm.operator.where("sphere")


def test_the_weight_of_the_gripper_is_compensated_by_its_load_data(arm: ha.Arm) -> None:
    arm.move(ha.hold(0.3))
    assert np.abs(arm.state.wrench.force).max() < 0.3
    arm.detach_tool()
    arm.move(ha.hold(0.3))
    assert arm.state.wrench.force[2] == pytest.approx(-9.81, abs=0.3)
    arm.attach_tool(GRIPPER)


def test_where_there_is_no_hole_insertion_fails(arm: ha.Arm) -> None:
    before = ha.Pose.of((0.7, 0.0, 0.24), DOWN)  # the fingertips 20 mm above the table
    world = ha.CollisionModel("iiwa14", scene="table")
    with pytest.raises(ha.ShapeError, match="world is that around which the arm moves to `before`"):
        insert(arm, "z", depth=0.02, world=world)
    with pytest.raises(ha.NoPath, match="goal is in collision"):
        insert(arm, "z", depth=0.02, before=before.shifted(z=-0.05), world=world)
    assert np.abs(arm.state.q_cmd - START).max() < 1e-6  # nothing moved
    with pytest.raises(ha.InsertionFailed, match="no hole within 1 mm") as failure:
        insert(arm, "z", depth=0.02, search=ha.spiral(0.001), distance=0.03, before=before, world=world)
    assert abs(failure.value.depth) < 1.5e-3


def test_a_press_exerts_its_force(arm: ha.Arm) -> None:
    arm.move(ha.ptp(ha.Pose.of((0.7, 0.0, 0.225), DOWN)))
    pressed = arm.start(ha.hold(3.0), mode=pressing("z", 12.0))
    arm.wait_until(lambda s: s.wrench.force[2] > 8.0, timeout=30.0)
    arm.wait_until(lambda s: abs(s.wrench.force[2] - 11.0) < 1.5 and np.abs(s.dq).max() < 0.01, timeout=30.0)
    pressed.cancel()
    pressed.wait()


def test_a_motion_into_the_table_is_refused_before_it_is_sent(arm: ha.Arm) -> None:
    arm.collision_check = ha.CollisionModel("iiwa14", scene="table")
    before = arm.wait_for_rest()
    with pytest.raises(ha.CollisionForeseen, match="finger .*table after") as refused:
        arm.move(ha.lin_rel(z=-0.25, frame="base"))
    assert refused.value.touch.clearance.second == "table" and 0.2 < refused.value.touch.at < 1.0
    with pytest.raises(ha.CollisionForeseen, match=r"^motions\[1\]: ") as refused:
        arm.move([ha.lin_rel(z=0.05, frame="base"), ha.ptp(ha.deg(0, 80, 0, -60, 0, 60, 0))])
    assert refused.value.motion == 1
    assert arm.wait_for_rest().pose.distance_to(before.pose) < 1e-4  # nothing moved
    assert arm.move(ha.lin_rel(z=0.05, frame="base")).arrived
    handle = arm.start(ha.ptp(START))  # while it runs, the next one starts at its end
    with pytest.raises(ha.CollisionForeseen):
        arm.start(ha.lin_rel(z=-0.25, frame="base"))
    handle.wait()
    arm.collision_check = None
    assert arm.collision_check is None


def test_something_that_checks_nothing_is_refused(arm: ha.Arm) -> None:
    with pytest.raises(ha.ShapeError, match="collision_check"):
        arm.collision_check = "table"  # type: ignore[assignment]


@pytest.mark.long
@pytest.mark.parametrize("seed", ["7", "8"])
def test_the_peg_is_in_the_hole_twenty_times_out_of_twenty(seed: str) -> None:
    """Ten times per process, which a slow machine finishes in time."""

    def run() -> subprocess.CompletedProcess[str]:
        program = PATIENT_AND_FASTER + "import runpy, sys\nrunpy.run_path(sys.argv[1], run_name='__main__')"
        return subprocess.run(
            [sys.executable, "-c", program.replace("sys.argv[1]", repr(str(EXAMPLE))), "10", seed],
            capture_output=True,
            text=True,
            timeout=280,
            env=os.environ,
            check=False,
        )

    done = retry(run, busy)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("inserted") == 10
