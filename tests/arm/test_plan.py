"""Previews: what is planned is what the virtual cabinet then does, and is refused for the same reasons."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm import do, model, modes
from heptarm.io.panel_box import PanelBox
from heptarm.values.checks import Array
from heptarm.values.motion.motion import Motion
from heptarm.values.pose import Pose, deg
from heptarm.values.robot import robot
from heptarm.when import force, io, path
from tests.simulators import FASTER

HOME = deg(0, 30, 0, -90, 0, 60, 0)
TOOL = ha.Tool("long", mass=2.0, com=(0, 0, 0.1), tcp=Pose.xyz_abc(0.03, 0, 0.15, 0, 0.3, 0))


@pytest.fixture(scope="module")
def arm() -> Iterator[ha.Arm]:
    target = f"sim://iiwa14?speed={FASTER:g}"
    with ha.connect(target, watchdog=5.0, timeout=30.0, state_rate=250) as arm:
        arm.attach_tool(TOOL)
        arm.move(ha.ptp(HOME))
        yield arm


@pytest.fixture(autouse=True)
def at_home(arm: ha.Arm) -> Iterator[None]:
    yield
    arm.speed, arm.collision_check = 1.0, None
    arm.move(ha.ptp(HOME))


START = Pose.from_matrix(model.forward(robot("iiwa14"), HOME)) @ TOOL.tcp


def moved(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Pose:
    return Pose(START.xyz + [x, y, z], START.quat)


PROGRAMS: dict[str, Motion | Sequence[Motion]] = {
    "ptp": ha.ptp(deg(40, 50, 20, -70, 10, 40, -30), speed=0.6),
    "ptp_pose": ha.ptp(moved(x=-0.1, y=0.2), acceleration=0.4),
    "lin": ha.lin(moved(x=-0.1, y=0.15, z=0.05), speed_mps=0.2),
    "lin_rel": ha.lin_rel(y=0.1, z=-0.1, a=0.4, frame="base", speed_mps=0.15),
    "lin_rel_flange": ha.lin_rel(z=-0.1, b=0.2, frame="flange", speed_mps=0.2),
    "circ": ha.circ(moved(y=0.1, z=0.1), moved(y=0.2), speed_mps=0.2),
    "spline": ha.spline(
        [moved(y=0.1), ha.circ(moved(x=-0.05, y=0.15), moved(x=-0.1, y=0.1)), ha.spl(moved(x=-0.1))],
        speed_mps=0.2,
    ),
    "spline_joints": ha.spline_joints(
        [deg(20, 40, 0, -80, 0, 60, 0), deg(30, 30, 0, -70, 0, 50, 0)], speed=0.4
    ),
    "blended": [
        ha.lin(moved(y=0.12), speed_mps=0.2, blend_m=0.03),
        ha.lin(moved(x=-0.1, y=0.12), speed_mps=0.2, blend_rel=0.3),
        ha.ptp(HOME, speed=0.3),
    ],
}


def along(path: Array, times: Array, q: Array) -> tuple[float, float]:
    """How far joint positions are from a path, shape (n, 7), at most [rad], and the time of the nearest place."""
    begin, step = path[:-1], np.diff(path, axis=0)
    fraction = np.clip(((q - begin) * step).sum(axis=1) / np.maximum((step**2).sum(axis=1), 1e-18), 0.0, 1.0)
    off = np.abs(begin + fraction[:, None] * step - q).max(axis=1)
    k = int(off.argmin())
    return float(off[k]), float(times[k] + fraction[k] * (times[k + 1] - times[k]))


@pytest.mark.parametrize("name", PROGRAMS)
def test_the_cabinet_does_what_was_planned(arm: ha.Arm, name: str) -> None:
    arm.wait_for_rest()
    preview = arm.plan(PROGRAMS[name])
    handle = arm.start(PROGRAMS[name])
    seen = [(state.groups.joints.stamp, state.q_cmd) for state in handle.states() if state.groups.joints]
    result = handle.wait()
    assert result.arrived and len(seen) > 20
    offsets, speeds = [], np.abs(preview.dq).max(axis=1)
    for stamp, q in seen:
        off, time = along(preview.q, preview.t, q)
        assert off < 1e-3
        pose = Pose.from_matrix(model.forward(arm.robot, q)) @ TOOL.tcp
        assert np.linalg.norm(preview.tcp[:, :3] - pose.xyz, axis=1).min() < 1e-3 + 0.5 * 0.01
        if (
            speeds[np.searchsorted(preview.t, time) - 1] > 0.2 * speeds.max()
        ):  # else a place has no sharp time
            offsets.append(stamp * 1e-9 - time)
    assert max(offsets) - min(offsets) < 0.01 * preview.duration
    end = arm.wait_for_rest()
    assert end.groups.joints is not None
    seen.append((end.groups.joints.stamp, end.q_cmd))
    # It arrives between two states: 4 ms apart, or more where the machine is busy.
    before = max(k for k, (_, q) in enumerate(seen) if np.abs(q - preview.q[-1]).max() >= 1e-6)
    earliest, latest = (seen[k][0] * 1e-9 - offsets[0] for k in (before, before + 1))
    within = 0.01 * preview.duration + 0.01
    assert earliest - within < preview.duration < latest + within
    # until the arm has settled; a busy cabinet notices the begin late
    assert result.duration > 0.99 * preview.duration - 0.1
    assert end.q == pytest.approx(preview.q[-1], abs=1e-3)
    assert end.pose.distance_to(preview.end) < 1e-3 and end.pose.angle_to(preview.end) < 1e-3


def test_nothing_moves_and_nothing_is_sent(arm: ha.Arm) -> None:
    before = arm.wait_for_rest()
    queue = arm.connection.journal.open()
    preview = arm.plan([ha.lin_rel(z=0.05), ha.lin_rel(z=-0.05)])
    assert not [entry for entry in queue if entry[1] == "request"]
    arm.connection.journal.close(queue)
    assert arm.state.q == pytest.approx(before.q, abs=1e-6)
    assert [one.name for one in preview.motions] == ["LinRel", "LinRel"]
    assert preview.motions[1].begin == pytest.approx(preview.motions[0].duration)


@pytest.mark.parametrize(
    ("motion", "text"),
    [
        (ha.lin(moved(x=0.6)), "not reachable at"),
        (ha.lin_rel(x=-0.3, z=-0.45, frame="base"), "violates limit"),
        (ha.circ(moved(x=0.05), moved(x=0.1)), "lie on a line"),
        (ha.lin_rel(x=0.1, moving="nowhere"), "nowhere"),
        (ha.ptp(deg(0, 130, 0, 0, 0, 0, 0)), "A2 must be in"),
    ],
)
def test_it_is_refused_for_the_reasons_of_the_cabinet(arm: ha.Arm, motion: Motion, text: str) -> None:
    arm.wait_for_rest()
    with pytest.raises(ha.CommandRejected, match=text):
        arm.plan(motion)
    with pytest.raises(ha.HeptarmError, match=text):
        arm.move(motion)


COMPLIANT = modes.CartesianImpedance(stiffness=(2000, 2000, 2000, 200, 200, 200))
ELSEWHERE = modes.CartesianImpedance(stiffness=(500,) * 3 + (50,) * 3, frame="nowhere")


@pytest.mark.parametrize(
    ("keywords", "text"),
    [
        ({"mode": ELSEWHERE}, "nowhere"),
        ({"until": force(frame="nowhere") > 10}, "nowhere"),
        ({"until": io["DI9"]}, "no signal 'DI9'"),
        ({"then": "relax"}, "reaction to a break condition"),
        ({"until": force > 10, "then": "fly"}, "then must be"),
        ({"mode": "soft"}, "mode must be a control mode"),
    ],
)
def test_it_takes_what_move_takes_and_refuses_it_alike(
    arm: ha.Arm, keywords: dict[str, Any], text: str
) -> None:
    down = ha.lin_rel(z=0.05, frame="base")
    for verb in (arm.plan, arm.move):
        with pytest.raises(ha.CommandRejected, match=text):
            verb(down, **keywords)
    bad = down.trigger(path.after(0.01), do.set_output("DO9", True))
    for verb in (arm.plan, arm.move):
        with pytest.raises(ha.CommandRejected, match="no signal 'DO9'"):
            verb(bad)


def test_modes_and_conditions_leave_the_planned_path(arm: ha.Arm) -> None:
    down = ha.lin_rel(z=-0.05, frame="base", speed_mps=0.1)
    stiff = arm.plan(down)
    touched = arm.plan(down, mode=COMPLIANT, until=force > 10, then="relax")
    assert touched.duration == stiff.duration and (touched.q == stiff.q).all()
    assert stiff.until is None and touched.until == (force > 10)
    assert "force > 10" in str(touched) and "end earlier" in str(touched) and "until" not in str(stiff)
    with arm.using(ELSEWHERE), pytest.raises(ha.CommandRejected, match="nowhere"):
        arm.plan(down)
    with arm.breaking_on(force > 20):
        assert arm.plan(down).until == (force > 20)


def test_limits_and_their_places(arm: ha.Arm) -> None:
    arm.speed = 0.4
    preview = arm.plan(ha.ptp(deg(90, 30, 0, -90, 0, 60, 0)))
    fastest = preview.closest("velocity")
    assert fastest.axis == 1 and fastest.fraction == pytest.approx(0.4, abs=0.01)
    assert fastest.value == pytest.approx(0.4 * arm.robot.dq_max[0], rel=0.02)
    assert 0.0 < fastest.t < preview.duration and str(fastest).startswith("A1 at 40 % of its speed, ")
    assert arm.plan(ha.ptp(HOME + 0.1), speed=0.2).closest().fraction == pytest.approx(0.2, abs=0.01)
    assert arm.plan(ha.ptp(deg(0, 118, 0, -20, 0, 0, 0))).closest("position").axis == 2
    with pytest.raises(ha.ShapeError, match="one of 'position'"):
        preview.closest("jerk")


def test_torques_are_those_that_the_arm_then_has(arm: ha.Arm) -> None:
    arm.move(ha.hold(0.3))
    still = arm.plan(ha.hold(0.2))
    assert still.tau[0] == pytest.approx(arm.state.tau, abs=0.5)
    bare = model.gravity(arm.robot, HOME)
    assert abs(still.tau[0, 1] - bare[1]) > 5.0  # 2 kg, half a metre away
    moving = arm.plan(ha.ptp(deg(0, 60, 0, -60, 0, 60, 0)))
    assert moving.closest("torque").axis == 2 and np.ptp(moving.tau[:, 1]) > 40.0


def test_a_start_of_its_own_and_a_running_motion(arm: ha.Arm) -> None:
    handle = arm.start([ha.ptp(HOME + 0.2, speed=0.05), ha.hold(20.0)])
    arm.wait_until(lambda state: state.motion.active)
    with pytest.raises(ha.ModeConflict, match=r"a motion runs.*give start"):
        arm.plan(ha.lin_rel(z=0.05))
    there = arm.plan(ha.lin_rel(z=0.05), start=HOME + 0.2)
    assert there.q[0] == pytest.approx(HOME + 0.2, abs=1e-6)
    handle.wait()
    assert arm.plan(ha.lin_rel(z=0.05)).duration == pytest.approx(there.duration, rel=1e-3)
    with pytest.raises(ha.LimitError, match="A2 must be in"):
        arm.plan(ha.hold(1.0), start=deg(0, 150, 0, 0, 0, 0, 0))


def test_collisions_are_found_where_they_happen(arm: ha.Arm) -> None:
    table = ha.CollisionModel("iiwa14", boxes=["0.6,0,0.1,0.6,0.8,0.2"])
    program = [ha.lin_rel(z=0.05, frame="base"), ha.ptp(deg(0, 90, 0, -30, 0, 60, 0))]
    assert arm.plan(program).collisions == () and not arm.plan(program).is_checked
    preview = arm.plan(program, collision_check=table)
    (found,) = preview.collisions
    assert found.motion == 1 and preview.motions[1].begin < found.t < preview.duration
    assert table.touching(preview.q_at(found.t)) and found.clearance.second == "box 0"
    assert "box 0 after" in str(preview)
    arm.collision_check = table
    assert arm.plan(program).collisions == preview.collisions
    with pytest.raises(ha.CollisionForeseen, match=r"^motions\[1\]: .*box 0"):
        arm.move(program)
    # with the check, a motion that cannot be planned is not sent either
    with pytest.raises(ha.Unreachable, match="not reachable"):
        arm.move(ha.lin(moved(x=0.6)))
    with pytest.raises(ha.ShapeError, match="first_on"):
        arm.plan(program, collision_check=3)  # type: ignore[arg-type]


def test_the_attached_tool_and_workpiece_collide(arm: ha.Arm) -> None:
    table = ha.CollisionModel("iiwa14", boxes=["0.6,0,0.1,0.6,0.8,0.2"])
    down = ha.lin_rel(z=0.21 - START.z, frame="base", speed_mps=0.1)  # the tip ends 10 mm above the table
    pen = ha.Tool("pen", tcp=TOOL.tcp, shapes=[ha.shapes.sphere(0.02, at=TOOL.tcp)])
    part = ha.Workpiece("part", shapes=[ha.shapes.sphere(0.005, at=Pose.at(0, 0, 0.025))])
    arm.collision_check = table
    assert arm.plan(down).collisions == ()  # the tool of the module has no shapes
    with arm.tool(pen):
        (found,) = arm.plan(down).collisions
        assert (found.clearance.first, found.clearance.second) == ("pen", "box 0")
        with pytest.raises(ha.CollisionForeseen, match=r"pen is \d mm from box 0"):
            arm.move(down)
        with arm.attached(part):
            (sooner,) = arm.plan(down).collisions
            assert sooner.clearance.first == "part" and sooner.t < found.t
        assert arm.plan(down).collisions == (found,)
    assert arm.plan(down).collisions == ()


def test_as_text_and_as_a_figure(arm: ha.Arm, tmp_path: Path) -> None:
    preview = arm.plan(PROGRAMS["blended"])
    lines = str(preview).splitlines()
    assert lines[0] == "Preview of 3 motions; nothing was moved"
    assert {line[2:12].strip() for line in lines[1:]} >= {
        "duration",
        "motions",
        "velocity",
        "torque",
        "collisions",
    }
    assert sum("blended" in line for line in lines) == 2 and lines[-1].endswith("not checked")
    assert "Preview of 3 motions" in preview._repr_html_() and "<table" in preview._repr_html_()
    figure = preview.plot()
    assert len(figure.axes) == 4
    figure.savefig(tmp_path / "plan.png", dpi=40)


def test_it_is_shown_in_an_open_panel_or_in_the_browser(
    arm: ha.Arm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    preview = arm.plan(PROGRAMS["blended"])
    page = preview.show()
    assert page is not None and "Plotly.newPlot" in page.read_text() and opened == [page.as_uri()]
    box = PanelBox(["iiwa14"])
    box.take()
    assert preview.show() is None and len(opened) == 1
    found = box.take()
    assert found is not None and found == preview.outline()
    np.testing.assert_array_equal(found.path, preview.tcp[:, :3])
    box.close()
