"""Paths around bodies: found, free between their points too, the same for the same seed; and why none was found."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm import model, planning, shapes
from heptarm.planning.constraints import constraint_from_text
from heptarm.values.checks import Array
from heptarm.values.pose import Pose, deg
from heptarm.values.robot import Body, robot

IIWA = robot("iiwa14")
LEFT, RIGHT = deg(-40, 50, 0, -80, 0, 50, 0), deg(40, 50, 0, -80, 0, 50, 0)
DOWN = (0.0, 1.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def wall() -> ha.CollisionModel:
    """A wall of 20 mm between left and right."""
    world = ha.CollisionModel("iiwa14")
    world.add("wall", shapes.box(0.5, 0.02, 0.6), at=Pose.at(0.6, 0.0, 0.3))
    return world


def is_free(world: ha.CollisionModel, path: ha.Path) -> bool:
    """Whether bodies keep apart by the margin at many places of the spline that the controller follows."""
    from heptarm.planning import seam
    from heptarm.planning.spline import plan_joint_spline

    points = tuple(seam.Ptp(q=tuple(one.q.tolist())) for one in path.points)
    planned = plan_joint_spline(IIWA, seam.JointSpline(points=points), path.start, Pose.at())
    assert planned.path is not None
    curve = np.array([planned.path.at(s, path.start) for s in np.linspace(0.0, 1.0, 1500).tolist()])
    return float(world.distances(curve, below=world.margin).min()) >= world.margin - 1e-3


def tool_at(q: Array, tcp: Pose) -> Pose:
    return Pose.from_matrix(model.forward(IIWA, q)) @ tcp


@pytest.mark.parametrize("seed", range(4))
def test_a_path_goes_around_a_wall(wall: ha.CollisionModel, seed: int) -> None:
    assert wall.first_on([LEFT, RIGHT]) is not None
    path = planning.find_path(wall, start=LEFT, goal=RIGHT, seed=seed, timeout=60.0)
    assert (path.start == LEFT).all() and (path.end == RIGHT).all()
    assert is_free(wall, path)
    assert path.clearance is not None and path.clearance.distance > wall.margin - 1e-3
    assert 0.5 < path.duration < 4.0 and len(path.points) < 20
    assert path.stats.planner == "RRT-Connect" and path.stats.seed == seed
    assert path.stats.states > 1 and path.stats.checks > path.stats.states


def test_the_same_seed_finds_the_same_path(wall: ha.CollisionModel) -> None:
    first, second, other = (
        planning.find_path(wall, start=LEFT, goal=RIGHT, seed=seed, timeout=60.0) for seed in (5, 5, 6)
    )
    assert first.points == second.points and first.curve.tobytes() == second.curve.tobytes()
    assert first.points != other.points


def test_a_path_in_one_line(wall: ha.CollisionModel) -> None:
    free = planning.find_path(wall, start=LEFT, goal=LEFT + 0.1)
    assert free.stats.planner == "straight" and len(free.points) == 1
    text = str(free)
    assert text.startswith(f"{free.duration:.2f} s, 1 waypoint, clearance ") and "(straight)" in text
    assert "\n" not in text


def test_a_path_to_where_the_arm_is_takes_no_time(wall: ha.CollisionModel) -> None:
    path = planning.find_path(wall, start=LEFT, goal=LEFT)
    assert path.duration == 0.0 and (path.end == LEFT).all()


@pytest.mark.parametrize(
    "degrees", [(90, 0, 90, -90, 90, 0, 0), (75, 0, -75, 0, 0, 0, -75), (20, 0, 40, -90, 0, 60, 0)]
)
def test_a_path_to_the_pose_of_the_arm_moves_no_joint(degrees: tuple[float, ...]) -> None:
    """The nearest of the sampled postures was up to 115 degrees away."""
    start = deg(*degrees)
    goal = Pose.from_matrix(model.forward(robot("iiwa14"), start))
    path = planning.find_path(ha.CollisionModel("iiwa14"), start=start, goal=goal)
    assert np.abs(path.curve - start).max() < 1e-6


def test_a_slower_path_takes_longer(wall: ha.CollisionModel) -> None:
    fast, slow = (planning.find_path(wall, start=LEFT, goal=RIGHT, speed=speed) for speed in (1.0, 0.2))
    assert slow.duration > 2.0 * fast.duration


@pytest.mark.parametrize("load", [None, Body(14.0, np.array((0.0, 0.0, 0.1)))], ids=["bare", "14 kg"])
def test_a_path_searched_for_a_low_speed_keeps_its_limits_at_full_speed(
    wall: ha.CollisionModel, load: Body | None
) -> None:
    slow, fast = (
        planning.find_path(wall, start=LEFT, goal=RIGHT, speed=speed, tcp_speed=0.25, load=load, timeout=60.0)
        for speed in (0.05, 1.0)
    )
    assert slow.points == fast.points and slow.duration > 1.2 * fast.duration
    limits = fast.dynamics.joint_speed, fast.dynamics.joint_acceleration
    assert limits[0][0] < 0.5
    np.testing.assert_array_equal((slow.dynamics.joint_speed, slow.dynamics.joint_acceleration), limits)


def test_a_pose_is_reached_with_any_elbow(wall: ha.CollisionModel) -> None:
    goal, tcp = Pose.of((0.55, 0.3, 0.3), DOWN), Pose.at(0.0, 0.05, 0.1)
    path = planning.find_path(wall, start=LEFT, goal=goal, tcp=tcp, timeout=60.0)
    reached = tool_at(path.end, tcp)
    assert np.linalg.norm(reached.xyz - goal.xyz) < 1e-6 and reached.angle_to(goal) < 1e-6
    assert is_free(wall, path)
    world = ha.CollisionModel(
        "iiwa14"
    )  # a ball where that elbow would be: another elbow reaches the same pose
    world.add("ball", shapes.sphere(0.06), at=Pose.of(model.forward(IIWA, path.end, link=4)[:3, 3]))
    other = planning.find_path(world, start=LEFT, goal=goal, tcp=tcp, timeout=60.0)
    assert tool_at(other.end, tcp).angle_to(goal) < 1e-6 and np.abs(other.end - path.end).max() > 0.1


def test_one_of_several_goals_is_reached(wall: ha.CollisionModel) -> None:
    inside, near = Pose.of((0.6, 0.0, 0.3), DOWN), Pose.of((0.5, -0.3, 0.4), DOWN)
    goals: list[ha.Pose | np.ndarray] = [inside, near, RIGHT]
    path = planning.find_path(wall, start=LEFT, goal=goals, timeout=60.0)
    assert np.linalg.norm(tool_at(path.end, Pose.at()).xyz - near.xyz) < 1e-6
    both = planning.find_path(wall, start=LEFT, goal=np.array([RIGHT, RIGHT]), timeout=60.0)
    assert (both.end == RIGHT).all()


@pytest.mark.parametrize("kind", [np.float32, np.float64, np.int64])
def test_a_goal_may_be_a_list_of_numbers_of_numpy(wall: ha.CollisionModel, kind: Any) -> None:
    path = planning.find_path(wall, start=np.round(LEFT), goal=[kind(value) for value in np.round(LEFT)])
    assert (path.end == np.round(LEFT)).all()


def test_a_region_leaves_a_choice(wall: ha.CollisionModel) -> None:
    middle = Pose.of((0.5, 0.3, 0.35), DOWN)
    region = ha.Region.of(middle, box=(0.1, 0.2, 0.1), cone=0.3, turn=3.0)
    for seed in range(3):
        path = planning.find_path(wall, start=LEFT, goal=region, seed=seed, timeout=60.0)
        reached = middle.inverse() @ tool_at(path.end, Pose.at())
        assert (np.abs(reached.xyz) <= np.array([0.05, 0.1, 0.05]) + 1e-6).all()
        assert np.arccos(min(1.0, reached.rotation[2, 2])) <= 0.3 + 1e-6


def tilts(path: ha.Path) -> float:
    """Largest angle of the flange's axis from its direction at the start [rad]."""
    up = model.forward(IIWA, path.start)[:3, 2]
    return max(float(np.arccos(min(1.0, float(model.forward(IIWA, q)[:3, 2] @ up)))) for q in path.curve)


def test_a_glass_stays_upright(wall: ha.CollisionModel) -> None:
    keep = ha.Upright("z", within=0.2)
    path = planning.find_path(wall, start=LEFT, goal=RIGHT, keep=keep, timeout=120.0)
    assert tilts(path) <= 0.2 and is_free(wall, path)
    assert (
        tilts(planning.find_path(wall, start=LEFT, goal=RIGHT, timeout=60.0)) > 0.3
    )  # it would tilt otherwise


def test_a_path_that_goes_on_elsewhere_keeps_the_direction_of_the_first_start(
    wall: ha.CollisionModel,
) -> None:
    first = planning.find_path(wall, start=LEFT, goal=RIGHT, keep=ha.Upright("z", within=0.2), timeout=120.0)
    (keep,) = first.keep
    assert isinstance(keep, ha.Upright)
    up = model.forward(IIWA, LEFT)[:3, 2]
    np.testing.assert_allclose(keep.direction, up)  # type: ignore[arg-type]
    tilted = max(first.curve, key=lambda q: -float(model.forward(IIWA, q)[:3, 2] @ up))
    second = planning.find_path(wall, start=tilted, goal=RIGHT, keep=first.keep, timeout=120.0)
    axes = model.forward_batch(IIWA, np.vstack([first.curve, second.curve]))[:, :3, 2]
    assert np.arccos((axes @ up).min()) <= 0.2 * 1.002 and second.keep == first.keep
    with pytest.raises(ha.NoPath, match=r"^start contradicts keep: the z axis .* turned by 0\.3\d\d rad"):
        turned = ha.Upright("z", within=0.2, direction=Pose.from_rotvec((0, 0, 0), (0.3, 0, 0)).rotation @ up)
        planning.find_path(wall, start=LEFT, goal=RIGHT, keep=turned)


@pytest.mark.parametrize(
    ("text", "keep"),
    [
        ("Upright('x', within=0.2)", ha.Upright("x", within=0.2)),
        (" OnPlane((0.5, 0, -0.4), (0, 0, 2)) ", ha.OnPlane((0.5, 0, -0.4))),
        ("OnLine([0, 0, 1], direction=[0, 1, 0])", ha.OnLine((0, 0, 1), (0, 1, 0))),
        ("Workspace(((0, 0, 0), (1, 1, 1)))", ha.Workspace(((0, 0, 0), (1, 1, 1)))),
    ],
)
def test_a_constraint_is_read_from_a_text(text: str, keep: Any) -> None:
    assert constraint_from_text(text) == keep


@pytest.mark.parametrize(
    "text",
    ["", "z", "Upright", "Upright(z)", "Upright('z', size=1)", "OnPlane()", "Upright(*[1])", "Upright(**{})"]
    + [
        "ha.Upright()",
        "open('x')",
        "Upright(",
        "Upright(" * 300,
        "Upright('z', within=0.1 " + " " * 1000 + ")",
    ],
)
def test_a_text_that_is_no_constraint_is_refused(text: str) -> None:
    wanted = r"^keep\[1\] must be Upright, OnPlane, OnLine, Workspace as in Python"
    with pytest.raises(ha.CommandRejected, match=wanted):
        constraint_from_text(text, "keep[1]")


def test_a_text_of_a_constraint_out_of_range_is_refused_as_the_constraint_is() -> None:
    with pytest.raises(ha.LimitError, match="within must be"):
        constraint_from_text("Upright('z', within=9)")


def tips(path: ha.Path) -> Array:
    """Origins of the flange on a path, shape (n, 3) [m]."""
    return model.forward_batch(IIWA, path.curve)[:, :3, 3]


FREE = ha.CollisionModel("iiwa14")
#: Flange at the left and the right; the line between them is along y.
ONE, TWO = (model.forward(IIWA, q)[:3, 3] for q in (LEFT, RIGHT))


@pytest.mark.parametrize(
    ("keep", "distance"),
    [
        (ha.OnPlane(ONE, (2.0, 0.0, 0.0), within=0.02), lambda xyz: np.abs(xyz[:, 0] - ONE[0]).max()),
        (
            ha.OnLine(ONE, TWO - ONE, within=0.005),
            lambda xyz: np.linalg.norm(xyz[:, ::2] - ONE[::2], axis=1).max(),
        ),
    ],
)
def test_the_tool_frame_stays_on_a_plane_or_a_line(keep: Any, distance: Any) -> None:
    path = planning.find_path(FREE, start=LEFT, goal=RIGHT, keep=keep, timeout=120.0)
    assert distance(tips(path)) <= keep.within + 1e-6
    bare = planning.find_path(FREE, start=LEFT, goal=RIGHT)
    assert distance(tips(bare)) > keep.within  # it would leave it otherwise


def test_constraints_are_combined_and_a_workspace_is_one() -> None:
    joints = np.array([IIWA.q_min, IIWA.q_max])
    joints[:, 3] = -1.7, -1.0
    box = ((0.0, -0.6, 0.0), (0.7, 0.6, ONE[2] + 0.02))
    keep: list[ha.Upright | ha.Workspace] = [
        ha.Upright("z", within=0.3),
        ha.Workspace(box=box, joints=joints),
    ]
    path = planning.find_path(FREE, start=LEFT, goal=RIGHT, keep=keep, timeout=120.0)
    assert tilts(path) <= 0.3 and tips(path)[:, 2].max() <= ONE[2] + 0.02
    assert path.curve[:, 3].min() >= -1.7 and path.curve[:, 3].max() <= -1.0


def test_an_axis_may_be_turned_as_far_as_is_allowed_at_the_goal() -> None:
    goal = LEFT + deg(0, 0, 0, 0, 0, 11.4, 0)  # 0.199 rad of 0.2
    path = planning.find_path(FREE, start=LEFT, goal=goal, keep=ha.Upright("z", within=0.2), timeout=120.0)
    assert 0.19 < tilts(path) <= 0.2 + 1e-6


@pytest.mark.parametrize(
    ("keep", "match"),
    [
        (
            ha.OnPlane((0, 0, ONE[2] + 0.1)),
            r"^start contradicts keep: .* 100\.0 mm from the plane, at most 5 mm",
        ),
        (ha.OnLine((0, 0, ONE[2]), (0, 1, 0)), r"^start contradicts keep: .* mm from the line, at most 5 mm"),
        (ha.Workspace(box=((0, 0, 0), (1, 1, 1))), r"^start contradicts keep: .* mm outside of the box"),
        (ha.OnPlane(TWO, (0, 1, 0.2)), r"^start contradicts keep: .* mm from the plane"),
        (
            ha.OnPlane((0, 0, 3.0)),
            r"^keep contradicts itself: no joint positions obey OnPlane\(\(0, 0, 3\)\)$",
        ),
        (
            [ha.OnPlane(ONE), ha.Workspace(box=((-1, -1, 0.5), (1, 1, 1)))],
            r"^keep contradicts itself: no joint positions obey OnPlane\(.*\) and box$",
        ),
        (ha.OnPlane(ONE, (1, -1, 0)), r"^goal contradicts keep: .* mm from the plane"),
    ],
)
def test_constraints_that_cannot_be_kept_are_refused_in_one_sentence(keep: Any, match: str) -> None:
    with pytest.raises(ha.NoPath) as error:
        planning.find_path(FREE, start=LEFT, goal=RIGHT, keep=keep)
    assert error.value.reason == "constraint" and error.value.hint
    assert re.search(match, error.value.text), error.value.text


def test_a_point_is_touched_along_an_axis(wall: ha.CollisionModel) -> None:
    point, axis = np.array((0.5, 0.3, 0.3)), np.array((0.0, 0.6, -0.8))
    goal = ha.Region.touching(point, axis=3.0 * axis, gap=0.02)
    tcp = Pose.at(0.0, 0.0, 0.1)
    path = planning.find_path(wall, start=LEFT, goal=goal, tcp=tcp, timeout=60.0)
    reached = tool_at(path.end, tcp)
    assert reached.xyz == pytest.approx(point - 0.02 * axis, abs=1e-6)
    assert reached.rotation[:, 2] == pytest.approx(axis, abs=1e-6)
    up = ha.Region.touching(point, axis=(0, 0, 1)).pose.rotation[:, 2]
    assert up == pytest.approx((0, 0, 1)) and ha.Region.touching(point).pose.rotation[:, 2] == pytest.approx(
        (0, 0, -1)
    )


def test_a_path_is_improved_by_further_states(wall: ha.CollisionModel) -> None:
    first, more, again = (
        planning.find_path(wall, start=LEFT, goal=RIGHT, seed=3, improve=improve, timeout=120.0)
        for improve in (0, 25, 25)
    )
    assert more.duration <= first.duration and more.stats.states >= first.stats.states + 25
    assert more.points == again.points and is_free(wall, more)
    seen: list[tuple[int, float]] = []
    stopped = planning.find_path(
        wall,
        start=LEFT,
        goal=RIGHT,
        seed=3,
        improve=10**6,
        timeout=600.0,
        progress=lambda states, nearest: seen.append((states, nearest)),
        stop=lambda: seen[-1][0] > first.stats.states + 5,
    )
    assert stopped.duration <= first.duration  # what was found so far
    assert [states for states, _ in seen] == sorted(states for states, _ in seen)


def test_a_start_in_slight_contact_is_left() -> None:
    world = ha.CollisionModel("iiwa14", boxes=["0.6,0,0.1,0.4,0.8,0.2"])
    start = model.solve(IIWA, Pose.of((0.6, 0.0, 0.198), DOWN), near=LEFT.tolist())
    assert world.touching(start)[0].distance < 0.0
    path = planning.find_path(world, start=start, goal=Pose.of((0.5, 0.2, 0.5), DOWN), timeout=60.0)
    assert world.first_on(path.curve) is None
    deep = model.solve(IIWA, Pose.of((0.6, 0.0, 0.15), DOWN), near=LEFT.tolist())
    with pytest.raises(ha.NoPath, match=r"start is in collision: link_\d is \d+ mm inside box 0") as error:
        planning.find_path(world, start=deep, goal=LEFT)
    assert error.value.reason == "start" and error.value.clearance.second == "box 0"


def test_what_is_held_is_carried_around(wall: ha.CollisionModel) -> None:
    world = wall.carrying(None)
    world.add("rod", shapes.cylinder(0.02, 0.1), at=Pose.at(0.0, 0.6, 0.5))
    world.hold("rod", Pose.at(0.0, 0.0, 0.06))
    path = planning.find_path(world, start=LEFT, goal=RIGHT, seed=1, timeout=60.0)
    assert is_free(world, path)


#: The tool's z axis forwards.
FORWARDS = (0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5))


@pytest.mark.parametrize(
    ("scene", "tip", "goals"),
    [
        ("shelf", 0.16, [(0.8, 0.05, 0.4), (0.8, -0.02, 0.74)]),
        ("narrow-slot", 0.0, [(0.65, 0.0, 0.5)]),
    ],
)
def test_paths_into_the_compartments_of_a_shelf_and_through_a_slot(
    scene: str, tip: float, goals: list[tuple[float, float, float]]
) -> None:
    world, tcp = ha.CollisionModel("iiwa14", scene=scene), Pose.at(0, 0, tip)
    here = deg(0, -20, 0, -110, 0, 0, 0)
    for xyz in goals:
        path = planning.find_path(world, start=here, goal=Pose.of(xyz, FORWARDS), tcp=tcp, timeout=120.0)
        assert np.linalg.norm(tool_at(path.end, tcp).xyz - xyz) < 1e-6 and is_free(world, path)
        here = path.end


@pytest.mark.parametrize(
    ("goal", "reason", "match"),
    [
        (Pose.of((0.6, 0.0, 0.3), DOWN), "goal", r"goal is in collision: link_\d is \d+ mm inside wall"),
        (Pose.of((1.6, 0.0, 0.3), DOWN), "inverse kinematics", "out of reach"),
        (deg(0, 60, 0, -80, 0, 50, 0), "goal", "goal is in collision"),
    ],
)
def test_why_there_is_no_path(wall: ha.CollisionModel, goal: Any, reason: str, match: str) -> None:
    with pytest.raises(ha.NoPath, match=match) as error:
        planning.find_path(wall, start=LEFT, goal=goal)
    assert error.value.reason == reason and error.value.hint


def test_a_search_ends_by_its_states_its_time_or_a_call() -> None:
    world = ha.CollisionModel("iiwa14")  # two walls up to a ceiling, with no way around
    world.add("wall", shapes.box(2.4, 0.01, 3.0), at=Pose.at(1.35, 0.0, 1.5))
    world.add("back", shapes.box(2.4, 0.01, 3.0), at=Pose.at(-1.35, 0.0, 1.5))
    world.add("ceiling", shapes.box(2.4, 2.4, 0.01), at=Pose.at(0.0, 0.0, 1.1))
    assert not world.touching(LEFT) and not world.touching(RIGHT)
    nearest = []
    for _ in range(2):
        with pytest.raises(ha.NoPath, match=r"not connected: \d+ states, nearest \d\.\d\d rad") as error:
            planning.find_path(world, start=LEFT, goal=RIGHT, states=60, timeout=600.0)
        assert error.value.states >= 60 and error.value.reason == "not connected"
        nearest.append(error.value.nearest)
    assert nearest[0] == nearest[1] and 0.1 < nearest[0] < 20.0
    with pytest.raises(ha.NoPath, match=r"not found in 0\.001 s"):
        planning.find_path(world, start=LEFT, goal=RIGHT, timeout=0.001)
    calls: list[int] = []
    with pytest.raises(ha.NoPath, match="stopped"):
        planning.find_path(
            world, start=LEFT, goal=RIGHT, timeout=600.0, stop=lambda: bool(calls.append(1)) or len(calls) > 5
        )
    assert len(calls) == 6


def test_a_goal_that_contradicts_the_constraint_is_refused(wall: ha.CollisionModel) -> None:
    tilted = RIGHT + deg(0, 0, 0, 0, 0, 60, 0)
    with pytest.raises(ha.NoPath, match=r"goal contradicts keep: .* turned by 1\.0\d+ rad") as error:
        planning.find_path(wall, start=LEFT, goal=tilted, keep=ha.Upright("z", within=0.2))
    assert error.value.reason == "constraint"


@pytest.mark.parametrize(
    ("keywords", "error", "match"),
    [
        ({"world": 3}, ha.ShapeError, "world must be a model of bodies, got 3"),
        ({"start": [0.0] * 6}, ha.ShapeError, "start"),
        ({"start": deg(0, 150, 0, 0, 0, 0, 0)}, ha.LimitError, "A2 must be in"),
        ({"goal": "home"}, ha.ShapeError, "goal must be joint positions, a Pose, a Region"),
        ({"goal": []}, ha.ShapeError, "goal"),
        ({"goal": np.empty((0, 7))}, ha.ShapeError, r"goal must have shape \(7,\), got \(0, 7\)"),
        ({"goal": [np.empty((0, 7))]}, ha.ShapeError, r"goal must have shape \(7,\), got \(0, 7\)"),
        ({"goal": deg(0, 150, 0, 0, 0, 0, 0)}, ha.LimitError, "A2 must be in"),
        ({"keep": "z"}, ha.ShapeError, "keep must be Upright, OnPlane"),
        ({"keep": [ha.Upright(), None]}, ha.ShapeError, "keep must be Upright, OnPlane"),
        ({"keep": ha.Workspace(box=((0, 0, 0), (1, 1, 1)), frame="cell")}, ha.CommandRejected, "in the base"),
        ({"keep": ha.Workspace(joints=(np.full(7, 5.0), np.full(7, 6.0)))}, ha.LimitError, "for A2"),
        ({"improve": -1}, ha.LimitError, "improve"),
        ({"speed": 0.0}, ha.LimitError, "speed"),
        ({"timeout": 0.0}, ha.LimitError, "timeout"),
        ({"states": 1}, ha.LimitError, "states"),
        ({"seed": -1}, ha.LimitError, "seed"),
        ({"tcp": 1}, ha.ShapeError, "tcp"),
    ],
)
def test_bad_arguments(wall: ha.CollisionModel, keywords: dict[str, Any], error: Any, match: str) -> None:
    given: dict[str, Any] = {"world": wall, "start": LEFT, "goal": RIGHT} | keywords
    with pytest.raises(error, match=match):
        planning.find_path(given.pop("world"), **given)


def test_constraints_and_regions_are_checked() -> None:
    with pytest.raises(ha.ShapeError, match="axis"):
        ha.Upright("w")  # type: ignore[arg-type]
    with pytest.raises(ha.LimitError, match="within"):
        ha.Upright("z", within=0.0)
    with pytest.raises(ha.LimitError, match="normal must have a direction"):
        ha.OnPlane((0.5, 0, 0.5), (0, 0, 0))
    with pytest.raises(ha.LimitError, match="within"):
        ha.OnLine((0.5, 0, 0.5), (1, 0, 0), within=0.0)
    with pytest.raises(ha.LimitError, match="gap"):
        ha.Region.touching((0.5, 0, 0.5), gap=-0.1)
    with pytest.raises(ha.LimitError, match="cone"):
        ha.Region.of(Pose.at(0.5, 0, 0.5), cone=4.0)
    with pytest.raises(ha.LimitError, match=r"box\[1\]"):
        ha.Region.of(Pose.at(0.5, 0, 0.5), box=(0.1, -0.1, 0.1))
    with pytest.raises(ha.ShapeError, match="pose"):
        ha.Region(0.5)  # type: ignore[arg-type]
