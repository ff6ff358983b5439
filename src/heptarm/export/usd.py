"""Writer of USD, as text (.usda): bodies, joints and shapes by the schema UsdPhysics."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from math import degrees, isfinite, radians

import numpy as np

from heptarm.export.tree import BASE, TreeBody, TreeJoint, TreeShape, poses_in_base
from heptarm.export.xml_formats import number
from heptarm.values.checks import Array
from heptarm.values.pose import Pose
from heptarm.values.shape import ORIGIN

_HEAD = """#usda 1.0
(
    defaultPrim = "{name}"
    metersPerUnit = 1
    kilogramsPerUnit = 1
    upAxis = "Z"
)

"""


def prim(name: str) -> str:
    """A name as USD allows it: letters, digits and underscores."""
    made = re.sub(r"\W", "_", name, flags=re.ASCII)
    return f"_{made}" if made[:1].isdigit() else made


def usd(name: str, bodies: Sequence[TreeBody]) -> str:
    """A tree as a stage of USD, with all meshes inside.

    Bodies are side by side below the root, each with its pose in the base at joint position 0 (double precision); a
    frame is below its body. The schema of UsdPhysics has masses and the frames of joints in single precision.

    Args:
        name: of the model.
        bodies: the tree.
    """
    root = prim(name)
    places = poses_in_base(bodies)
    frames = [body for body in bodies if body.is_frame]
    out = [_HEAD.format(name=root)]
    out.append(f'def Xform "{root}" (\n    prepend apiSchemas = ["PhysicsArticulationRootAPI"]\n)\n{{')
    for body in bodies:
        if not body.is_frame:
            out += _lines(_body(body, places[body.name], frames))
    for body in bodies:
        if not body.is_frame:
            out += _lines(_joint(root, body, {frame.name: frame for frame in frames}))
    out.append("}\n")
    return "\n".join(out)


def _lines(lines: list[str]) -> list[str]:
    return [f"    {line}" if line else "" for line in lines]


def _vector(values: Array) -> str:
    return f"({', '.join(map(number, np.asarray(values).ravel().tolist()))})"


def _place(pose: Pose) -> list[str]:
    return [
        f"double3 xformOp:translate = {_vector(pose.xyz)}",
        f"quatd xformOp:orient = {_vector(np.roll(pose.quat, 1))}",
        'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient"]',
    ]


def _body(body: TreeBody, place: Pose, frames: Sequence[TreeBody]) -> list[str]:
    schemas = []
    if body.name != BASE and not body.is_frame:
        schemas.append('"PhysicsRigidBodyAPI"')
    if body.mass > 0.0:
        schemas.append('"PhysicsMassAPI"')
    head = f'def Xform "{prim(body.name)}"'
    lines = (
        [f"{head} (", f"    prepend apiSchemas = [{', '.join(schemas)}]", ")", "{"]
        if schemas
        else [head, "{"]
    )
    lines += _lines(_place(place))
    if body.mass > 0.0:
        moments, axes = np.linalg.eigh(body.inertia)
        if np.linalg.det(axes) < 0.0:
            axes[:, 0] = -axes[:, 0]
        turn = Pose.from_matrix(np.block([[axes, np.zeros((3, 1))], [np.array([0.0, 0.0, 0.0, 1.0])]]))
        lines += _lines(
            [
                f"float physics:mass = {number(body.mass)}",
                f"point3f physics:centerOfMass = {_vector(body.com)}",
                f"float3 physics:diagonalInertia = {_vector(moments)}",
                f"quatf physics:principalAxes = {_vector(np.roll(turn.quat, 1))}",
            ]
        )
    for index, shape in enumerate(body.shapes):
        lines += _lines(_shape(f"shape_{index}", shape))
    for frame in frames:
        if frame.parent == body.name:
            lines += _lines(_body(frame, frame.pose, frames))
    return [*lines, "}"]


def _shape(name: str, shape: TreeShape) -> list[str]:
    radius, half, _ = shape.size.tolist()
    kinds = {"box": "Cube", "sphere": "Sphere", "ellipsoid": "Sphere", "mesh": "Mesh"}
    kind = kinds.get(shape.kind, shape.kind.capitalize())
    schema = ' (\n    prepend apiSchemas = ["PhysicsCollisionAPI"]\n)' if shape.collides else ""
    lines = [*f'def {kind} "{name}"{schema}'.split("\n"), "{"]
    inner = _place(shape.pose)
    scale = shape.size if shape.kind in ("box", "ellipsoid") else None
    if scale is not None:
        inner[-1:] = [
            f"double3 xformOp:scale = {_vector(scale)}",
            'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient", "xformOp:scale"]',
        ]
    if shape.kind == "box":
        inner.append("double size = 2")
    elif shape.kind == "mesh":
        counts = ", ".join(["3"] * len(shape.faces))
        inner += [
            f"int[] faceVertexCounts = [{counts}]",
            f"int[] faceVertexIndices = [{', '.join(map(str, shape.faces.ravel().tolist()))}]",
            f"point3f[] points = [{', '.join(_vector(vertex) for vertex in shape.vertices)}]",
            'uniform token subdivisionScheme = "none"',
        ]
    else:
        inner.append(f"double radius = {number(1.0 if shape.kind == 'ellipsoid' else radius)}")
        if shape.kind in ("cylinder", "capsule"):
            inner += [f"double height = {number(2.0 * half)}", 'uniform token axis = "Z"']
    red, green, blue, opacity = shape.colour.tolist()
    inner += [
        f"color3f[] primvars:displayColor = [{_vector(np.array([red, green, blue]))}]",
        f"float[] primvars:displayOpacity = [{number(opacity)}]",
    ]
    if not shape.is_drawn:
        inner.append('uniform token purpose = "guide"')
    return [*lines, *_lines(inner), "}"]


def _joint(root: str, body: TreeBody, frames: Mapping[str, TreeBody]) -> list[str]:
    """The joint of a body; those of USD move about an axis of their own frame, so that this is turned."""
    joint, parent, pose = body.joint, body.parent, body.pose
    if not parent or (joint is not None and joint.kind == "free"):
        return []
    while parent in frames:  # a joint is between bodies
        pose, parent = frames[parent].pose @ pose, frames[parent].parent
    if joint is None:
        kind, name, own = "PhysicsFixedJoint", f"{body.name}_joint", ORIGIN
    else:
        kind = "PhysicsPrismaticJoint" if joint.kind == "slide" else "PhysicsRevoluteJoint"
        name, own = joint.name, _along(joint.axis, joint.anchor)
    in_parent = pose @ own
    drive = "linear" if joint is not None and joint.kind == "slide" else "angular"
    schemas = f'"PhysicsDriveAPI:{drive}", "PhysxJointAPI"'
    head = f'def {kind} "{prim(name if joint is None else f"joint_{name}")}"'
    lines = [head, "{"] if joint is None else [f"{head} (", f"    prepend apiSchemas = [{schemas}]", ")", "{"]
    inner = [
        f"rel physics:body0 = </{root}/{prim(parent)}>",
        f"rel physics:body1 = </{root}/{prim(body.name)}>",
        f"point3f physics:localPos0 = {_vector(in_parent.xyz)}",
        f"quatf physics:localRot0 = {_vector(np.roll(in_parent.quat, 1))}",
        f"point3f physics:localPos1 = {_vector(own.xyz)}",
        f"quatf physics:localRot1 = {_vector(np.roll(own.quat, 1))}",
    ]
    if joint is not None:
        inner.append('uniform token physics:axis = "Z"')
        if isfinite(joint.low):
            unit = degrees if joint.kind == "hinge" else float
            inner += [
                f"float physics:lowerLimit = {number(unit(joint.low))}",
                f"float physics:upperLimit = {number(unit(joint.high))}",
            ]
        inner += _resistance(joint)
    return [*lines, *_lines(inner), "}"]


def _resistance(joint: TreeJoint) -> list[str]:
    """Damping by UsdPhysics, Coulomb friction and the drive's inertia by PhysX; angles are in degrees."""
    kind, per = ("angular", radians(1.0)) if joint.kind == "hinge" else ("linear", 1.0)
    lines = [
        f"float drive:{kind}:physics:damping = {number(joint.damping * per)}",
        f"float drive:{kind}:physics:stiffness = 0",
        f"float physxJoint:armature = {number(joint.armature)}",
        f"float physxJoint:jointFriction = {number(joint.friction)}",
    ]
    if isfinite(joint.effort):
        lines.append(f"float drive:{kind}:physics:maxForce = {number(joint.effort)}")
    return lines


def _along(axis: Array, anchor: Array) -> Pose:
    """A frame at a point whose z axis is along an axis."""
    z = axis / np.linalg.norm(axis)
    x = np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.9 else [1.0, 0.0, 0.0], z)
    x /= np.linalg.norm(x)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    matrix[:3, 3] = anchor
    return Pose.from_matrix(matrix)
