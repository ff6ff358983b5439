"""Messages about the world, MoveIt's and point clouds: their conversion to bodies, and the topics on which they come.

They have the same fields in both ROS. The pose of a body is in the frame that its header names: the base, a taught
frame, or the flange or tool of an arm at rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from heptarm.errors import CommandRejected, ShapeError
from heptarm.model.kinematics import forward
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.messages import class_of, pose_message
from heptarm.ros.interface.motions import frame_in_base, pose_of
from heptarm.ros.interface.planning.world import Part, SceneBody, WorldDraft
from heptarm.sim.collision import CollisionModel
from heptarm.values import shape as shapes
from heptarm.values.checks import Array, frozen
from heptarm.values.mesh import Mesh
from heptarm.values.pose import Pose
from heptarm.values.shape import ORIGIN
from heptarm.values.world import Color, checked_color

#: Operations of moveit_msgs/CollisionObject.
ADD, REMOVE, APPEND, MOVE = range(4)
#: Types of shape_msgs/SolidPrimitive, and how many dimensions they have.
BOX, SPHERE, CYLINDER = 1, 2, 3
_DIMENSIONS = {BOX: 3, SPHERE: 1, CYLINDER: 2}
#: Datatypes of sensor_msgs/PointField that coordinates have.
_FLOATS = {7: "f4", 8: "f8"}
#: The body that is the newest cloud of points.
POINTS = "points"
#: Links that a held body touches anyway: it is next to them.
_NEIGHBOURS = 6


# -------------------------------------------------------------------------------------------- topics


def collision_object(context: NodeContext, message: Any) -> None:
    """Add, move or remove the body of a moveit_msgs/CollisionObject."""
    with context.world.changing() as draft:
        change_body(context, draft, message)


def attached_collision_object(context: NodeContext, message: Any) -> None:
    """Let the arm hold, or hold no more, the body of a moveit_msgs/AttachedCollisionObject."""
    with context.world.changing() as draft:
        change_attached(context, draft, message)


def planning_scene(context: NodeContext, message: Any) -> None:
    """Change, or replace, the world by a moveit_msgs/PlanningScene."""
    with context.world.changing() as draft:
        replace_scene(context, draft, message)


def points(context: NodeContext, message: Any) -> None:
    """Replace the body "points" by the cloud of a sensor_msgs/PointCloud2; by nothing, where it has no points."""
    cloud, frame = cloud_of(message), _frame_of(context, message.header)
    with context.world.changing() as draft:
        if len(cloud):
            draft.add(POINTS, SceneBody((), frame, cloud=cloud))
        elif POINTS in draft.bodies:
            draft.remove(POINTS)


# ------------------------------------------------------------------------------------------- changes


def replace_scene(context: NodeContext, draft: WorldDraft, message: Any) -> None:
    """Replace a world by a moveit_msgs/PlanningScene, or change it by one that is a difference.

    Raises:
        HeptarmError: refused; the text gives the reason.
    """
    if not message.is_diff:
        for name in tuple(draft.bodies):
            draft.remove(name)
        draft.colors.clear()
    change_scene(context, draft, message)


def change_scene(context: NodeContext, draft: WorldDraft, message: Any) -> None:
    """Change a world by a moveit_msgs/PlanningScene, as a difference.

    Raises:
        HeptarmError: refused; the text gives the reason.
    """
    if len(message.world.octomap.octomap.data):
        raise CommandRejected("an octomap is not supported", parameter="octomap", hint="send boxes or meshes")
    if any(any(row.enabled) for row in message.allowed_collision_matrix.entry_values):
        raise CommandRejected(
            "collisions cannot be allowed by messages",
            parameter="allowed_collision_matrix",
            hint="remove the body, or attach it to the arm",
        )
    for body in message.world.collision_objects:
        change_body(context, draft, body)
    for body in message.robot_state.attached_collision_objects:
        change_attached(context, draft, body)
    for colored in message.object_colors:
        color = colored.color
        draft.paint(
            colored.id, checked_color((color.r, color.g, color.b, color.a), f"color of {colored.id!r}")
        )


def change_body(context: NodeContext, draft: WorldDraft, message: Any) -> None:
    """Change a world by a moveit_msgs/CollisionObject.

    Raises:
        HeptarmError: refused; the text gives the reason.
    """
    operation = _operation(message)
    if operation == REMOVE:
        for name in (message.id,) if message.id else tuple(draft.bodies):
            draft.remove(name)
    elif operation == MOVE:
        draft.move(message.id, _frame_of(context, message.header) @ pose_of(message.pose))
    else:
        draft.add(message.id, _body_of(context, draft, message, ORIGIN))


def change_attached(context: NodeContext, draft: WorldDraft, message: Any) -> None:
    """Change what the arm of a world holds by a moveit_msgs/AttachedCollisionObject.

    Raises:
        HeptarmError: refused; the text gives the reason.
    """
    name, flange = message.object.id, flange_in_base(context)
    if _operation(message.object) == REMOVE:
        held = [body_name for body_name, body in draft.bodies.items() if body.is_held]
        for body_name in (name,) if name else held:
            body = draft.body(body_name)
            if body.is_held:
                draft.move(body_name, flange @ body.pose)
        return
    _check_links(context, message)
    if message.object.primitives or message.object.meshes or message.object.planes:
        draft.add(name, _body_of(context, draft, message.object, link_in_base(context, message.link_name)))
    body = draft.body(name)
    if not body.is_held:
        draft.hold(name, flange.inverse() @ body.pose)


def _operation(message: Any) -> int:
    given = message.operation
    return given[0] if isinstance(given, bytes) else int(given)  # a byte of ROS 2


def _check_links(context: NodeContext, message: Any) -> None:
    """Refuse a link that does not carry, or that would have to be allowed to touch, what is attached."""
    configuration = context.driver.configuration
    prefix = configuration.values["prefix"]
    link_in_base(context, message.link_name)
    for link in message.touch_links:
        if link in {f"{prefix}link_{number}" for number in range(_NEIGHBOURS)}:
            raise CommandRejected(
                f"touch_links must be the flange, the tool, or links beside them, got {link!r}",
                parameter="touch_links",
                value=link,
                hint="attach a body where it touches no other link",
            )


def _body_of(context: NodeContext, draft: WorldDraft, message: Any, frame: Pose) -> SceneBody:
    """The body of a moveit_msgs/CollisionObject, where it is in the base.

    Args:
        context: of the node.
        draft: has the body to which parts are appended.
        message: the object.
        frame: in the base, for a header without a frame.
    """
    if message.planes:
        raise CommandRejected(
            "a plane is not supported: it has no end", parameter="planes", hint="send a box as large as it is"
        )
    parts: tuple[Part, ...] = (
        *(
            _primitive(*pair)
            for pair in _pairs(message.primitives, message.primitive_poses, "primitive_poses")
        ),
        *(_mesh(*pair) for pair in _pairs(message.meshes, message.mesh_poses, "mesh_poses")),
    )
    if not parts:
        raise ShapeError(
            f"{message.id!r} must have primitives or meshes, got none",
            parameter="primitives",
            value=message.id,
        )
    origin = _frame_of(context, message.header) if message.header.frame_id else frame
    body = SceneBody(parts, origin @ pose_of(message.pose))
    if _operation(message) != APPEND or message.id not in draft.bodies:
        return body
    before = draft.bodies[message.id]
    if before.cloud is not None:
        raise CommandRejected(
            f"shapes cannot be appended to {message.id!r}, which is a cloud of points",
            parameter="id",
            value=message.id,
            hint="give them another id",
        )
    place = flange_in_base(context) @ before.pose if before.is_held else before.pose
    shift = place.inverse() @ body.pose
    return SceneBody((*before.parts, *(replace(part, pose=shift @ part.pose) for part in parts)), place)


def _pairs(found: Sequence[Any], poses: Sequence[Any], name: str) -> list[tuple[Any, Pose]]:
    if len(poses) == 0 and len(found) == 1:
        return [(found[0], ORIGIN)]
    if len(poses) != len(found):
        raise ShapeError(f"{name} must have {len(found)} poses, got {len(poses)}", parameter=name)
    return [(shape, pose_of(pose)) for shape, pose in zip(found, poses)]


def _primitive(message: Any, at: Pose) -> shapes.Shape:
    count = _DIMENSIONS.get(message.type)
    if count is None:
        raise CommandRejected(
            f"type of a primitive must be 1 (BOX), 2 (SPHERE) or 3 (CYLINDER), got {message.type}",
            parameter="type",
            value=message.type,
            hint="send another shape as a mesh",
        )
    sizes = [float(value) for value in message.dimensions]
    if len(sizes) != count:
        raise ShapeError(
            f"dimensions of a primitive of type {message.type} must be {count} numbers, got {len(sizes)}",
            parameter="dimensions",
        )
    if message.type == BOX:
        return shapes.box(sizes[0], sizes[1], sizes[2], at=at)
    if message.type == SPHERE:
        return shapes.sphere(sizes[0], at=at)
    return shapes.cylinder(sizes[1], sizes[0], at=at)


def _mesh(message: Any, at: Pose) -> Mesh:
    vertices = np.array([[point.x, point.y, point.z] for point in message.vertices])
    faces = np.array([list(triangle.vertex_indices) for triangle in message.triangles])
    return Mesh(vertices, faces, at)


def cloud_of(message: Any) -> Array:
    """Points of a sensor_msgs/PointCloud2 that are finite, in the frame of its header, shape (n, 3) [m].

    Raises:
        ShapeError: it has no coordinates, or not as many bytes as it should.
    """
    if not message.width * message.height:
        return frozen(np.zeros((0, 3)))  # some drivers leave out the fields, too
    order, fields = ">" if message.is_bigendian else "<", {field.name: field for field in message.fields}
    kinds = [_FLOATS.get(fields[name].datatype) if name in fields else None for name in "xyz"]
    if None in kinds:
        raise ShapeError(
            f"fields must have x, y and z as FLOAT32 or FLOAT64, got {', '.join(fields) or 'none'}",
            parameter="fields",
        )
    width, height, step, row = message.width, message.height, message.point_step, message.row_step
    data = np.frombuffer(bytes(message.data), np.uint8)
    ends = [fields[name].offset + int(kind[1:]) for name, kind in zip("xyz", kinds) if kind is not None]
    if row < width * step or len(data) != row * height or max(ends) > step:
        raise ShapeError(
            f"data must have {height} rows of {width} points with {max(ends)} bytes or more each, got "
            f"{len(data)} bytes, point_step {step} and row_step {row}",
            parameter="data",
        )
    layout = np.dtype(
        {
            "names": list("xyz"),
            "formats": [f"{order}{kind}" for kind in kinds],
            "offsets": [fields[name].offset for name in "xyz"],
            "itemsize": step,
        }
    )
    rows = np.ascontiguousarray(data.reshape(height, row)[:, : width * step]).reshape(-1).view(layout)
    found = np.column_stack([rows[name].astype(float) for name in "xyz"])
    return frozen(found[np.isfinite(found).all(axis=1)])  # a camera has no distance there


# -------------------------------------------------------------------------------------------- frames


def flange_in_base(context: NodeContext) -> Pose:
    """Where the flange is in the base."""
    arm = context.arm
    return Pose.from_matrix(forward(arm.robot, arm.state.q))


def tool_on_flange(context: NodeContext) -> Pose:
    """Where the tool frame is in the flange frame."""
    return flange_in_base(context).inverse() @ context.arm.state.pose


def carried_model(context: NodeContext) -> CollisionModel:
    """The world as it is now, of an arm that carries what is attached to it."""
    arm, mode = context.arm, context.arm.state.groups.mode
    tool = None if mode is None else arm.tools.get(mode.tool)
    held = context.workpiece
    return context.world.model.carrying(tool, arm.tools.get(held) if isinstance(held, str) else held)


def link_in_base(context: NodeContext, name: str) -> Pose:
    """Where a link that carries bodies is in the base: the flange or the tool; "": the flange.

    Raises:
        CommandRejected: another link.
    """
    links = context.driver.configuration.links
    if name not in ("", *links):
        raise CommandRejected(
            f"link must be one of {', '.join(links)}, got {name!r}", parameter="link_name", value=name
        )
    is_tool = name == links[1]
    return context.arm.state.pose if is_tool else flange_in_base(context)


def _frame_of(context: NodeContext, header: Any) -> Pose:
    """Where the frame that a header names is in the base.

    Raises:
        ShapeError: unknown.
    """
    name = header.frame_id.lstrip("/")
    if name in context.driver.configuration.links:
        return link_in_base(context, name)
    frame = frame_in_base(header, context.driver)
    return ORIGIN if frame is None else frame


# ------------------------------------------------------------------------------------------- reports


def scene_fields(context: NodeContext) -> dict[str, Any]:
    """Fields of a moveit_msgs/PlanningScene: the bodies that were added, and the state of the arm."""
    added = context.world.bodies
    bodies = {name: body for name, body in added.items() if body.cloud is None}  # clouds have no such message
    loose = [_object(context, name, body, context.base) for name, body in bodies.items() if not body.is_held]
    flange = context.driver.configuration.links[0]
    held = []
    for name, body in bodies.items():
        if body.is_held:
            attached = class_of("moveit_msgs/AttachedCollisionObject", "msg")()
            attached.link_name, attached.object = flange, _object(context, name, body, flange)
            held.append(attached)
    return {
        "robot_model_name": context.arm.robot.name,
        "robot_state": {
            "joint_state": {"name": context.joints, "position": context.arm.state.q.tolist()},
            "attached_collision_objects": held,
        },
        "world": {"collision_objects": loose},
        "object_colors": [_color(*entry) for entry in context.world.colors.items() if entry[0] in bodies],
    }


def _object(context: NodeContext, name: str, body: SceneBody, frame: str) -> Any:
    message = class_of("moveit_msgs/CollisionObject", "msg")()
    message.header.frame_id, message.id, message.pose = frame, name, pose_message(context.ros, body.pose)
    for part in body.parts:
        pose = pose_message(context.ros, part.pose)
        if isinstance(part, Mesh):
            message.meshes.append(_mesh_message(part))
            message.mesh_poses.append(pose)
        else:
            message.primitives.append(_primitive_message(part))
            message.primitive_poses.append(pose)
    return message


def _color(name: str, color: Color) -> Any:
    message = class_of("moveit_msgs/ObjectColor", "msg")()
    message.id = name
    message.color.r, message.color.g, message.color.b, message.color.a = color
    return message


def _primitive_message(part: shapes.Shape) -> Any:
    message = class_of("shape_msgs/SolidPrimitive", "msg")()
    x, y, z = part.size.tolist()
    kinds = {"box": (BOX, [x, y, z]), "sphere": (SPHERE, [x]), "cylinder": (CYLINDER, [y, x])}
    message.type, message.dimensions = kinds[part.kind]
    return message


def _mesh_message(part: Mesh) -> Any:
    message, point = class_of("shape_msgs/Mesh", "msg")(), class_of("geometry_msgs/Point", "msg")
    triangle = class_of("shape_msgs/MeshTriangle", "msg")
    message.vertices = [point(x=x, y=y, z=z) for x, y, z in part.vertices.tolist()]
    message.triangles = [triangle(vertex_indices=face) for face in part.faces.tolist()]
    return message
