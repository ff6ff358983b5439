"""The world of a node, and MoveIt's requests: messages become bodies and goals; the nodes' own tests move the arm."""

from __future__ import annotations

from math import pi, sqrt
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from heptarm.errors import CommandRejected, HeptarmError, NoPath, ShapeError
from heptarm.model.kinematics import forward
from heptarm.ros.interface.offered import offered, offered_actions
from heptarm.ros.interface.planning import constraints, scene
from heptarm.ros.interface.planning.constraints import MoveItCode, RequestRefused
from heptarm.ros.interface.planning.world import NodeWorld
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.values.motion.planned_path import Region
from heptarm.values.pose import Pose
from heptarm.values.robot import robot

HOME = np.radians([0, 30, 0, -90, 0, 60, 0])
FLANGE = Pose.from_matrix(forward(robot("iiwa14"), HOME))
TCP = Pose.at(0.0, 0.0, 0.1)


def message(**fields: Any) -> SimpleNamespace:
    return SimpleNamespace(**fields)


def header(frame: str = "") -> SimpleNamespace:
    return message(frame_id=frame)


def pose(
    xyz: tuple[float, ...] = (0.0, 0.0, 0.0), quat: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)
) -> SimpleNamespace:
    return message(position=message(**dict(zip("xyz", xyz))), orientation=message(**dict(zip("xyzw", quat))))


def body(name: str, *, operation: Any = 0, frame: str = "", **fields: Any) -> SimpleNamespace:
    """A moveit_msgs/CollisionObject: by default a box of 10 cm."""
    empty: dict[str, Any] = {
        "header": header(frame),
        "id": name,
        "pose": pose(),
        "primitives": [message(type=1, dimensions=[0.1, 0.1, 0.1])],
        "primitive_poses": [pose()],
        "meshes": [],
        "mesh_poses": [],
        "planes": [],
        "operation": operation,
    }
    return message(**(empty | fields))


def attached(name: str, link: str = "", **fields: Any) -> SimpleNamespace:
    """A moveit_msgs/AttachedCollisionObject; by default of a body that is in the world."""
    nothing: dict[str, Any] = {"primitives": [], "primitive_poses": []}
    return message(link_name=link, touch_links=[], object=body(name, **(nothing | fields)))


@pytest.fixture
def context() -> Any:
    """As that of a node whose arm rests at HOME with a tool frame 10 cm before the flange."""
    configuration = NodeConfiguration.of({})
    state = message(q=HOME, q_cmd=HOME, pose=FLANGE @ TCP, groups=message(mode=None))
    fixture = Pose.at(0.5, 0.1, 0.2)
    arm = message(robot=robot("iiwa14"), state=state, frames={"/Fixture": fixture}, tools={})
    driver = message(configuration=configuration, arm=arm, transforms=None)
    world = NodeWorld(cast(Any, driver))
    ros = message(pose=pose)
    return cast(
        Any,
        message(
            world=world,
            driver=driver,
            arm=arm,
            ros=ros,
            workpiece=None,
            joints=list(configuration.joints),
            base="link_0",
        ),
    )


# -------------------------------------------------------------------------------------------- world


def test_bodies_come_go_and_move_in_the_frames_that_their_headers_name(context: Any) -> None:
    scene.collision_object(context, body("wall", pose=pose((0.5, 0.2, 0.3))))
    scene.collision_object(
        context, body("jig", operation=b"\x00", frame="Fixture", pose=pose((0.0, 0.0, 0.1)))
    )
    scene.collision_object(context, body("tag", frame="tool"))
    found = context.world.bodies
    np.testing.assert_allclose(found["wall"].pose.xyz, [0.5, 0.2, 0.3])
    np.testing.assert_allclose(found["jig"].pose.xyz, [0.5, 0.1, 0.3])
    np.testing.assert_allclose(found["tag"].pose.xyz, (FLANGE @ TCP).xyz)
    scene.collision_object(context, body("wall", operation=3, pose=pose((0.0, 0.6, 0.1))))
    np.testing.assert_allclose(context.world.bodies["wall"].pose.xyz, [0.0, 0.6, 0.1])
    scene.collision_object(context, body("wall", operation=2, pose=pose((0.0, 0.6, 0.4))))
    parts = context.world.bodies["wall"].parts
    assert len(parts) == 2 and parts[1].pose.xyz[2] == pytest.approx(0.3)
    scene.collision_object(context, body("jig", operation=1))
    assert set(context.world.bodies) == {"wall", "tag"} and "jig" not in context.world.model.bodies
    scene.collision_object(context, body("", operation=1))
    assert not context.world.bodies and "wall" not in context.world.model.bodies


def test_shapes_have_their_sizes(context: Any) -> None:
    primitives = [message(type=2, dimensions=[0.05]), message(type=3, dimensions=[0.4, 0.03])]
    corners = [(0, 0, 0), (0.2, 0, 0), (0, 0.2, 0), (0, 0, 0.2)]
    mesh = message(
        vertices=[message(x=x, y=y, z=z) for x, y, z in corners],
        triangles=[message(vertex_indices=face) for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))],
    )
    at = [pose((0.0, 0.0, 0.2)), pose()]
    scene.collision_object(
        context,
        body(
            "post",
            pose=pose((0.5, 0.3, 0.2)),
            primitives=primitives,
            primitive_poses=at,
            meshes=[mesh],
            mesh_poses=[pose()],
        ),
    )
    ball, rod, wedge = context.world.bodies["post"].parts
    assert ball.kind == "sphere" and ball.size[0] == 0.05 and ball.pose.xyz[2] == 0.2
    assert rod.kind == "cylinder" and rod.size.tolist() == [0.03, 0.4, 0.0], "MoveIt's have the height first"
    assert len(wedge.faces) == 4


def cloud(
    points: Any, *, frame: str = "", datatype: int = 7, big: bool = False, rows: int = 1
) -> SimpleNamespace:
    """A sensor_msgs/PointCloud2 with a color between y and z, and four bytes behind each row."""
    size = 4 if datatype == 7 else 8
    order, kind = ">" if big else "<", f"f{size}"
    layout = np.dtype([("x", order + kind), ("y", order + kind), ("rgb", "u4"), ("z", order + kind)])
    given = np.asarray(points, float).reshape(-1, 3)
    packed = np.zeros(len(given), layout)
    packed["x"], packed["y"], packed["z"] = given.T
    each = len(given) // rows
    lines = [packed[each * row : each * (row + 1)].tobytes() + b"\0" * 4 for row in range(rows)]
    offsets = {"x": 0, "y": size, "rgb": 2 * size, "z": 2 * size + 4}
    return message(
        header=header(frame),
        fields=[
            message(name=one, offset=offsets[one], datatype=6 if one == "rgb" else datatype)
            for one in offsets
        ],
        is_bigendian=big,
        width=each,
        height=rows,
        point_step=layout.itemsize,
        row_step=each * layout.itemsize + 4,
        data=b"".join(lines),
    )


POINTS = [[0.5, 0.2, 0.3], [np.nan, 0.0, 0.0], [0.5, 0.25, 0.3], [0.6, 0.2, 0.3]]


@pytest.mark.parametrize(("datatype", "big", "rows"), [(7, False, 1), (8, False, 2), (7, True, 4)])
def test_a_cloud_of_points_is_a_body_that_the_next_one_replaces(
    context: Any, datatype: int, big: bool, rows: int
) -> None:
    scene.points(context, cloud(POINTS, datatype=datatype, big=big, rows=rows))
    found = context.world.bodies["points"]
    np.testing.assert_allclose(found.cloud, [POINTS[0], *POINTS[2:]], atol=1e-6)
    assert "points" in context.world.model.bodies
    scene.collision_object(context, body("wall", pose=pose((0.0, 0.6, 0.3))))
    scene.points(context, cloud([[0.0, 0.0, 0.005]], frame="flange"))
    model = context.world.model
    assert {one.second for one in model.touching(HOME)} == {"points"} and "wall" in model.bodies
    nothing = cloud(np.zeros((0, 3)))
    nothing.fields, nothing.point_step = [], 0  # as some drivers send it
    scene.points(context, nothing)
    scene.points(context, nothing)
    assert set(context.world.bodies) == {"wall"} and not context.world.model.touching(HOME)


def test_clouds_that_make_no_sense_change_nothing(context: Any) -> None:
    scene.points(context, cloud(POINTS))
    before = context.world.model.revision
    short, flat, many = (
        cloud(POINTS),
        cloud(POINTS),
        cloud(np.random.default_rng(1).uniform(0.3, 3.0, (9000, 3))),
    )
    short.data = short.data[:-1]
    flat.fields = flat.fields[:3]
    for wrong, text in (
        (short, "4 points"),
        (flat, "x, y and z"),
        (many, "at most 5000"),
        (cloud(POINTS, frame="lens"), "lens"),
    ):
        with pytest.raises(HeptarmError, match=text):
            scene.points(context, wrong)
    with pytest.raises(CommandRejected, match="cloud of points"):
        scene.collision_object(context, body("points", operation=2))
    assert context.world.model.revision == before and len(context.world.bodies["points"].cloud) == 3
    assert not scene.scene_fields(context)["world"]["collision_objects"]


def test_a_world_is_one_object_that_changes_once_for_each_message(context: Any) -> None:
    model = context.world.model
    scene.collision_object(context, body("wall", pose=pose((0.5, 0.2, 0.3))))
    assert context.world.model is model and model.revision == 1 and "wall" in model.bodies
    with pytest.raises(HeptarmError), context.world.changing() as draft:
        draft.remove("wall")
        draft.remove("nothing")
    assert model.revision == 1 and "wall" in model.bodies


def test_the_arm_carries_what_is_attached_and_leaves_it_where_it_is(context: Any) -> None:
    place = (FLANGE @ Pose.at(0.0, 0.0, 0.2)).xyz
    scene.collision_object(context, body("part", pose=pose(tuple(place))))
    assert not context.world.model.touching(HOME)
    scene.attached_collision_object(context, attached("part", "flange"))
    held = context.world.bodies["part"]
    assert held.is_held and np.linalg.norm(held.pose.xyz) == pytest.approx(0.2)
    turned = HOME.copy()
    turned[0] = 1.0
    scene.collision_object(
        context,
        body("post", pose=pose(tuple(Pose.from_matrix(forward(robot("iiwa14"), turned)).xyz + [0, 0, -0.2]))),
    )
    touched = {frozenset((one.first, one.second)) for one in context.world.model.touching(turned)}
    assert frozenset(("part", "post")) in touched
    context.arm.state.q, there = turned, Pose.from_matrix(forward(robot("iiwa14"), turned))
    scene.attached_collision_object(context, attached("part", operation=1))
    left = context.world.bodies["part"]
    assert not left.is_held
    np.testing.assert_allclose(left.pose.xyz, (there @ held.pose).xyz, atol=1e-9)
    own = attached("grip", "tool", primitives=[message(type=2, dimensions=[0.02])], primitive_poses=[pose()])
    context.arm.state.pose = there @ TCP
    scene.attached_collision_object(context, own)
    np.testing.assert_allclose(context.world.bodies["grip"].pose.xyz, TCP.xyz, atol=1e-9)


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        (body("link_3"), "name must be a new name"),
        (body("wall", frame="camera"), "frame of the pose"),
        (body("wall", primitives=[message(type=4, dimensions=[0.1, 0.1])]), "type of a primitive"),
        (body("wall", primitives=[message(type=1, dimensions=[0.1])]), "must be 3 numbers"),
        (body("wall", primitives=[message(type=1, dimensions=[0.1, 0.1, -1.0])]), "must be in"),
        (body("wall", primitive_poses=[pose(), pose()]), "must have 1 poses"),
        (body("wall", primitives=[], primitive_poses=[]), "must have primitives or meshes"),
        (body("wall", planes=[message()]), "no end"),
        (body("wall", operation=3), "body that was added"),
        (body("wall", operation=1), "body that was added"),
        (body("wall", pose=pose((0.0, 0.0, 0.1))), "inside link_0"),
    ],
)
def test_a_refused_message_changes_nothing(context: Any, wrong: Any, text: str) -> None:
    scene.collision_object(context, body("post", pose=pose((0.5, 0.3, 0.2))))
    before = context.world.model
    world = message(
        collision_objects=[body("crate", pose=pose((0.0, 0.6, 0.2))), wrong],
        octomap=message(octomap=message(data=[])),
    )
    both = message(
        is_diff=False,
        world=world,
        robot_state=message(attached_collision_objects=[]),
        allowed_collision_matrix=message(entry_values=[]),
        object_colors=[],
    )
    for handler, one in ((scene.collision_object, wrong), (scene.planning_scene, both)):
        with pytest.raises(HeptarmError, match=text):
            handler(context, one)
        assert set(context.world.bodies) == {"post"} and context.world.model is before


def test_bodies_have_the_colours_of_a_scene_also_those_that_come_later(
    context: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        scene, "class_of", lambda *_: lambda **fields: message(header=header(), color=message(), **fields)
    )
    monkeypatch.setattr(scene, "_object", lambda *_: message())

    def send(*, is_diff: bool = True, **colors: tuple[float, ...]) -> None:
        named = [
            message(id=name, color=message(**dict(zip("rgba", color)))) for name, color in colors.items()
        ]
        scene.planning_scene(
            context,
            message(
                is_diff=is_diff,
                world=message(collision_objects=[], octomap=message(octomap=message(data=[]))),
                robot_state=message(attached_collision_objects=[]),
                allowed_collision_matrix=message(entry_values=[]),
                object_colors=named,
            ),
        )

    scene.collision_object(context, body("post", pose=pose((0.5, 0.3, 0.2))))
    red, blue = (1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 0.5)
    send(post=red, later=blue)
    assert context.world.model.color("post") == red
    scene.collision_object(context, body("later", pose=pose((0.0, 0.6, 0.2))))
    assert context.world.model.color("later") == blue
    reported = scene.scene_fields(context)["object_colors"]
    assert {entry.id: tuple(vars(entry.color).values()) for entry in reported} == {"post": red, "later": blue}
    with pytest.raises(HeptarmError, match=r"color of 'post' \(red\) must be in \[0, 1\], got 255"):
        send(later=red, post=(255.0, 0.0, 0.0, 255.0))
    assert context.world.model.color("later") == blue, "a refused message changes nothing"
    send(is_diff=False)
    assert not context.world.bodies and not context.world.colors


def test_what_cannot_be_attached_is_refused(context: Any) -> None:
    for wrong, text in (
        (attached("part", "flange"), "body that was added"),
        (attached("part", "link_2"), "link must be one of"),
        (message(link_name="", touch_links=["link_3"], object=body("part")), "touch_links"),
    ):
        with pytest.raises(CommandRejected, match=text):
            scene.attached_collision_object(context, wrong)
    assert not context.world.bodies


# --------------------------------------------------------------------------------- MoveIt's requests


def position(link: str, xyz: tuple[float, ...], size: list[float], kind: int = 2) -> Any:
    region = message(primitives=[message(type=kind, dimensions=size)], primitive_poses=[pose(xyz)], meshes=[])
    return message(
        header=header("link_0"),
        link_name=link,
        target_point_offset=message(x=0.0, y=0.0, z=0.0),
        constraint_region=region,
    )


def orientation(link: str, quat: tuple[float, ...], tolerances: tuple[float, float, float]) -> Any:
    names = ("absolute_x_axis_tolerance", "absolute_y_axis_tolerance", "absolute_z_axis_tolerance")
    turn = message(**dict(zip("xyzw", quat)))
    return message(header=header(), link_name=link, orientation=turn, **dict(zip(names, tolerances)))


def wanted(**fields: Any) -> Any:
    names = ("joint_constraints", "position_constraints", "orientation_constraints", "visibility_constraints")
    return message(**(dict.fromkeys(names, ()) | fields))


def test_constraints_become_goals_of_the_tool_frame(context: Any) -> None:
    place, down = (0.5, 0.1, 0.4), (0.0, 1.0, 0.0, 0.0)
    joints = [message(joint_name=name, position=value) for name, value in (("A2", 0.3), ("A1", 0.1))]
    goals = constraints.goals_of(
        context,
        [
            wanted(joint_constraints=joints),
            wanted(
                position_constraints=[position("flange", place, [0.001])],
                orientation_constraints=[orientation("flange", down, (0.001, 0.001, 0.001))],
            ),
            wanted(
                position_constraints=[position("tool", place, [0.1])],
                orientation_constraints=[orientation("tool", down, (0.3, 0.2, pi))],
            ),
            wanted(position_constraints=[position("tool", place, [0.2, 0.4, 0.6], kind=1)]),
        ],
    )
    joint, exact, near, anywhere = goals
    np.testing.assert_allclose(joint, [0.1, 0.3, *HOME[2:]])  # type: ignore[arg-type]
    assert isinstance(exact, Pose)
    np.testing.assert_allclose(exact.xyz, [0.5, 0.1, 0.3], atol=1e-9)  # the tool is 10 cm below the flange
    assert isinstance(near, Region) and (near.cone, near.turn) == (0.2, pi)
    np.testing.assert_allclose(near.box, [0.2 / sqrt(3.0)] * 3)
    assert isinstance(anywhere, Region) and (anywhere.cone, anywhere.turn) == (pi, pi)


@pytest.mark.parametrize(
    ("goal", "code"),
    [
        (wanted(), MoveItCode.INVALID_GOAL_CONSTRAINTS),
        (wanted(visibility_constraints=[message()]), MoveItCode.INVALID_GOAL_CONSTRAINTS),
        (wanted(position_constraints=[position("hand", (0, 0, 0), [0.1])]), MoveItCode.INVALID_LINK_NAME),
        (
            wanted(position_constraints=[position("flange", (0, 0, 0), [0.1])]),
            MoveItCode.INVALID_GOAL_CONSTRAINTS,
        ),
        (
            wanted(position_constraints=[position("tool", (0, 0, 0), [0.1, 0.1], kind=3)]),
            MoveItCode.INVALID_GOAL_CONSTRAINTS,
        ),
    ],
)
def test_a_goal_that_cannot_be_understood_is_refused_with_moveits_code(
    context: Any, goal: Any, code: MoveItCode
) -> None:
    with pytest.raises(RequestRefused) as error:
        constraints.goals_of(context, [goal])
    assert constraints.code_of(error.value) is code


def test_what_holds_along_a_path_is_that_of_the_tool_frame_and_never_loosened(context: Any) -> None:
    turned = tuple(
        (Pose.from_rotvec(np.zeros(3), np.array([0.1, 0.0, 0.0])) @ Pose.of(np.zeros(3), FLANGE.quat)).quat
    )

    def kept(**constraints_of_a_kind: Any) -> Any:
        return constraints.keep_of(context, wanted(**constraints_of_a_kind))

    (upright,) = kept(orientation_constraints=[orientation("flange", turned, (0.5, 0.4, 2 * pi))])
    assert (upright.axis, upright.within) == ("z", 0.4)
    np.testing.assert_allclose(upright.direction, Pose.of(np.zeros(3), turned).rotation[:, 2], atol=1e-12)
    leaning = tuple(Pose.from_rotvec(np.zeros(3), np.array([0.0, 0.0, 0.5])).quat.tolist())
    slab = position("tool", (0.5, 0.0, 0.4), [3.0, 0.2, 0.01], kind=1)
    slab.constraint_region.primitive_poses[0].orientation = message(**dict(zip("xyzw", leaning)))
    long, side, height = kept(position_constraints=[slab])
    assert (long.within, side.within, height.within) == (1.0, 0.1, 0.005)
    np.testing.assert_allclose(side.normal, [-np.sin(0.5), np.cos(0.5), 0.0], atol=1e-12)
    np.testing.assert_allclose(height.point, [0.5, 0.0, 0.4])
    bent = message(joint_name="A4", position=-1.4, tolerance_below=0.1, tolerance_above=9.0)
    (ranges,) = kept(joint_constraints=[bent])
    robot = context.arm.robot
    np.testing.assert_allclose(ranges.joints[:, 3], [-1.5, robot.q_max[3]])
    np.testing.assert_allclose(ranges.joints[:, 0], [robot.q_min[0], robot.q_max[0]])
    assert kept() == []
    for wrong, text in (
        (
            {"orientation_constraints": [orientation("flange", turned, (0.5, 0.4, 0.3))]},
            "leave free one axis",
        ),
        (
            {"position_constraints": [position("flange", (0.5, 0, 0.4), [1, 1, 1], kind=1)]},
            "tool frame itself",
        ),
        ({"position_constraints": [position("tool", (0.5, 0, 0.4), [0.1])]}, "must be a box"),
        ({"joint_constraints": [message(joint_name="finger", position=0.0)]}, "joint must be one of"),
        ({"visibility_constraints": [message()]}, "got one of visibility"),
    ):
        with pytest.raises(RequestRefused, match=text) as error:
            kept(**wrong)
        assert error.value.moveit is MoveItCode.INVALID_GOAL_CONSTRAINTS


def test_errors_have_moveits_codes() -> None:
    assert constraints.code_of(NoPath("", reason="goal")) is MoveItCode.GOAL_IN_COLLISION
    assert constraints.code_of(NoPath("", reason="time")) is MoveItCode.TIMED_OUT
    for name, code in (
        ("start", MoveItCode.START_STATE_VIOLATES_PATH_CONSTRAINTS),
        ("goal", MoveItCode.GOAL_VIOLATES_PATH_CONSTRAINTS),
    ):
        assert constraints.code_of(NoPath("", reason="constraint", parameter=name)) is code
    assert constraints.code_of(ShapeError("")) is MoveItCode.FAILURE


def test_the_group_and_the_start_state(context: Any) -> None:
    constraints.check_group(context, "arm")
    with pytest.raises(RequestRefused, match="group_name must be 'arm', got 'hand'"):
        constraints.check_group(context, "hand")
    none = message(joint_state=message(name=["finger"], position=[1.0]), attached_collision_objects=[])
    assert constraints.start_of(context, none) is None
    some = message(
        joint_state=message(name=["A2", "finger"], position=[0.4, 1.0]), attached_collision_objects=[]
    )
    start = constraints.start_of(context, some)
    assert start is not None and start[1] == 0.4 and start[3] == HOME[3]


@pytest.mark.parametrize("is_there", [True, False])
def test_moveits_names_are_offered_on_request_where_its_types_are_installed(
    is_there: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("offered", "topics"):
        monkeypatch.setattr(f"heptarm.ros.interface.{module}.is_installed", lambda _: is_there)
    for wanted_too in (True, False):
        table = offered(NodeConfiguration.of({"moveit": wanted_too}).values)
        names = {row.name for row in table.topics} | {row.name for row in table.services}
        names |= {row.name for row in offered_actions("heptarm", with_moveit=wanted_too)}
        assert ("collision_object" in names) is is_there
        for name in ("compute_ik", "move_action", "trajectory_execution_event"):
            assert (name in names) is (is_there and wanted_too)
        assert table.missing == (("moveit_msgs",) if wanted_too and not is_there else ())
