"""Writers of the formats that are XML: URDF, SDF and MJCF."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from math import atan2, hypot, isfinite

import numpy as np

from heptarm.export.tree import BASE, TreeBody, TreeJoint, TreeShape
from heptarm.values.checks import Array
from heptarm.values.pose import Pose

#: Largest speed and effort in formats that ask for one, where the model has none.
_MUCH = 1e3
_SDF_VERSION = "1.8"


def number(value: float) -> str:
    """A number that is read back as it is."""
    return repr(float(value) + 0.0)


def numbers(values: Array) -> str:
    """Numbers between blanks, likewise."""
    return " ".join(map(number, np.asarray(values).ravel().tolist()))


def roll_pitch_yaw(pose: Pose) -> Array:
    """Rotations about the fixed axes x, y, z, in this order [rad], shape (3,)."""
    r = pose.rotation
    pitch = atan2(-r[2, 0], hypot(r[0, 0], r[1, 0]))
    if hypot(r[0, 0], r[1, 0]) < 1e-12:  # x looks along z: only a sum or a difference of the others matters
        return np.array([atan2(-r[1, 2], r[1, 1]), pitch, 0.0])
    return np.array([atan2(r[2, 1], r[2, 2]), pitch, atan2(r[1, 0], r[0, 0])])


def _text(root: ET.Element) -> str:
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _add(parent: ET.Element, tag: str, text: str = "", **attributes: str) -> ET.Element:
    element = ET.SubElement(parent, tag, attributes)
    element.text = text or None
    return element


def _pieces(shape: TreeShape) -> Iterator[TreeShape]:
    """A capsule as a cylinder and two spheres, for formats that have none."""
    if shape.kind != "capsule":
        yield shape
        return
    half = float(shape.size[1])
    parts = [("cylinder", 0.0), ("sphere", half), ("sphere", -half)]
    for kind, z in parts:
        pose = shape.pose @ Pose.of((0.0, 0.0, z))
        yield TreeShape(kind, shape.size, pose, shape.colour, shape.collides, shape.is_drawn)


def _joint_type(joint: TreeJoint) -> str:
    """What URDF and SDF call a joint with one axis."""
    return "prismatic" if joint.kind == "slide" else "revolute" if isfinite(joint.low) else "continuous"


def _purposes(shape: TreeShape) -> list[str]:
    return ["visual"] * shape.is_drawn + ["collision"] * shape.collides


# ----------------------------------------------------------------------------------------------------- URDF


def urdf(name: str, bodies: Sequence[TreeBody], meshes: str) -> str:
    """A tree in the Unified Robot Description Format; the root is `base`.

    Args:
        name: of the model.
        bodies: the tree.
        meshes: folder of the meshes, seen from the file.
    """
    root = ET.Element("robot", name=name)
    for body in bodies:
        link = _add(root, "link", name=body.name)
        if body.mass > 0.0:
            inertial = _add(link, "inertial")
            _add(inertial, "origin", xyz=numbers(body.com), rpy="0 0 0")
            _add(inertial, "mass", value=number(body.mass))
            _add(inertial, "inertia", **_six(body.inertia))
        for shape in body.shapes:
            for piece in _pieces(shape):
                for purpose in _purposes(piece):
                    _urdf_shape(_add(link, purpose), piece, meshes, is_visual=purpose == "visual")
        if body.parent:
            _urdf_joint(root, body)
    return _text(root)


def _six(inertia: Array) -> dict[str, str]:
    axes = "xyz"
    return {f"i{axes[i]}{axes[j]}": number(inertia[i, j]) for i in range(3) for j in range(i, 3)}


def _urdf_origin(parent: ET.Element, pose: Pose) -> None:
    _add(parent, "origin", xyz=numbers(pose.xyz), rpy=numbers(roll_pitch_yaw(pose)))


def _urdf_shape(parent: ET.Element, shape: TreeShape, meshes: str, *, is_visual: bool) -> None:
    _urdf_origin(parent, shape.pose)
    geometry = _add(parent, "geometry")
    radius, half, _ = shape.size.tolist()
    if shape.kind == "mesh":
        _add(geometry, "mesh", filename=f"{meshes}/{shape.name}.obj")
    elif shape.kind == "box":
        _add(geometry, "box", size=numbers(2.0 * shape.size))
    elif shape.kind == "cylinder":
        _add(geometry, "cylinder", radius=number(radius), length=number(2.0 * half))
    else:  # of an ellipsoid the sphere around it
        _add(geometry, "sphere", radius=number(shape.size.max() if shape.kind == "ellipsoid" else radius))
    if is_visual:
        colour = numbers(shape.colour)
        _add(_add(parent, "material", name="rgba_" + colour.replace(" ", "_")), "color", rgba=colour)


def _urdf_joint(root: ET.Element, body: TreeBody) -> None:
    """The joint of a body; where its axis does not pass the body's origin, a link without mass is between."""
    joint = body.joint
    if joint is None or joint.kind == "free":
        kind = "fixed" if joint is None else "floating"
        name = f"{body.name}_joint" if joint is None else joint.name
        _urdf_link(root, name, kind, body.parent, body.name, body.pose)
        return
    child, pose = body.name, body.pose
    if joint.anchor.any():
        child, pose = f"{body.name}_axis", body.pose @ Pose.of(joint.anchor)
        _add(root, "link", name=child)
        _urdf_link(root, f"{body.name}_joint", "fixed", child, body.name, Pose.of(-joint.anchor))
    kind = _joint_type(joint)
    made = _urdf_link(root, joint.name, kind, body.parent, child, pose)
    _add(made, "axis", xyz=numbers(joint.axis))
    limits = {"lower": joint.low, "upper": joint.high} if kind != "continuous" else {}
    limits |= {"velocity": joint.speed, "effort": joint.effort}
    _add(made, "limit", **{key: number(np.clip(value, -_MUCH, _MUCH)) for key, value in limits.items()})
    _add(made, "dynamics", damping=number(joint.damping), friction=number(joint.friction))


def _urdf_link(root: ET.Element, name: str, kind: str, parent: str, child: str, pose: Pose) -> ET.Element:
    joint = _add(root, "joint", name=name, type=kind)
    _add(joint, "parent", link=parent)
    _add(joint, "child", link=child)
    _urdf_origin(joint, pose)
    return joint


# ------------------------------------------------------------------------------------------------------ SDF


def sdf(name: str, bodies: Sequence[TreeBody], meshes: str) -> str:
    """A tree in the Simulation Description Format 1.8, as one model; bodies without mass and shapes are its frames.

    Args:
        name: of the model.
        bodies: the tree.
        meshes: folder of the meshes, seen from the file.
    """
    root = ET.Element("sdf", version=_SDF_VERSION)
    model = _add(root, "model", name=name)
    for body in bodies:
        if body.is_frame:
            _sdf_pose(_add(model, "frame", name=body.name, attached_to=body.parent), body.pose)
            continue
        link = _add(model, "link", name=body.name)
        _sdf_pose(link, body.pose, relative_to=body.parent)
        if body.mass > 0.0:
            inertial = _add(link, "inertial")
            _sdf_pose(inertial, Pose.of(body.com))
            _add(inertial, "mass", number(body.mass))
            inertia = _add(inertial, "inertia")
            for key, value in _six(body.inertia).items():
                _add(inertia, key, value)
        for index, shape in enumerate(body.shapes):
            for purpose in _purposes(shape):
                element = _add(link, purpose, name=f"{purpose}_{index}")
                _sdf_pose(element, shape.pose)
                _sdf_geometry(_add(element, "geometry"), shape, meshes)
                if purpose == "visual":
                    material = _add(element, "material")
                    _add(material, "ambient", numbers(shape.colour))
                    _add(material, "diffuse", numbers(shape.colour))
        _sdf_joint(model, body)
    return _text(root)


def _sdf_pose(parent: ET.Element, pose: Pose, *, relative_to: str = "") -> None:
    text = f"{numbers(pose.xyz)} {numbers(roll_pitch_yaw(pose))}"
    _add(parent, "pose", text, **({"relative_to": relative_to} if relative_to else {}))


def _sdf_geometry(geometry: ET.Element, shape: TreeShape, meshes: str) -> None:
    radius, half, _ = shape.size.tolist()
    if shape.kind == "mesh":
        _add(_add(geometry, "mesh"), "uri", f"{meshes}/{shape.name}.obj")
    elif shape.kind == "box":
        _add(_add(geometry, "box"), "size", numbers(2.0 * shape.size))
    elif shape.kind == "ellipsoid":
        _add(_add(geometry, "ellipsoid"), "radii", numbers(shape.size))
    else:
        element = _add(geometry, shape.kind)
        _add(element, "radius", number(radius))
        if shape.kind != "sphere":
            _add(element, "length", number(2.0 * half))


def _sdf_joint(model: ET.Element, body: TreeBody) -> None:
    joint = body.joint
    if joint is not None and joint.kind == "free":
        return
    if joint is None:
        fixed = _add(model, "joint", name=f"{body.name}_joint", type="fixed")
        _add(fixed, "parent", body.parent or "world")
        _add(fixed, "child", body.name)
        return
    made = _add(model, "joint", name=joint.name, type=_joint_type(joint))
    if joint.anchor.any():
        _sdf_pose(made, Pose.of(joint.anchor))
    _add(made, "parent", body.parent)
    _add(made, "child", body.name)
    axis = _add(made, "axis")
    _add(axis, "xyz", numbers(joint.axis))
    limit = _add(axis, "limit")
    for key, value in (
        ("lower", joint.low), ("upper", joint.high), ("effort", joint.effort), ("velocity", joint.speed)
    ):  # fmt: skip
        if isfinite(value):
            _add(limit, key, number(value))
    dynamics = _add(axis, "dynamics")
    _add(dynamics, "damping", number(joint.damping))
    _add(dynamics, "friction", number(joint.friction))


# ----------------------------------------------------------------------------------------------------- MJCF


def mjcf(name: str, bodies: Sequence[TreeBody], meshes: str) -> str:
    """A tree in MuJoCo's format: bodies, joints and shapes; actuators and solver options are left to its reader.

    Args:
        name: of the model.
        bodies: the tree.
        meshes: folder of the meshes, seen from the file.
    """
    root = ET.Element("mujoco", model=name)
    _add(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false", meshdir=meshes)
    used = {shape.name: shape for body in bodies for shape in body.shapes if shape.kind == "mesh"}
    if used:
        asset = _add(root, "asset")
        for mesh in used:
            # its surface need not enclose a volume
            _add(asset, "mesh", name=mesh, file=f"{mesh}.obj", inertia="shell")
    made = {BASE: _add(root, "worldbody")}
    for body in bodies:
        if body.parent:
            made[body.name] = element = _add(
                made[body.parent], "body", name=body.name, **_mjcf_place(body.pose)
            )
            if body.mass > 0.0:
                entries = body.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
                _add(
                    element,
                    "inertial",
                    pos=numbers(body.com),
                    mass=number(body.mass),
                    fullinertia=numbers(entries),
                )
            _mjcf_joint(element, body.joint)
        for shape in body.shapes:
            _mjcf_shape(made[body.name], shape)
    return _text(root)


def _mjcf_place(pose: Pose) -> dict[str, str]:
    return {"pos": numbers(pose.xyz), "quat": numbers(np.roll(pose.quat, 1))}


def _mjcf_joint(body: ET.Element, joint: TreeJoint | None) -> None:
    if joint is None:
        return
    if joint.kind == "free":
        _add(body, "freejoint", name=joint.name)
        return
    limits = {"range": f"{number(joint.low)} {number(joint.high)}"} if isfinite(joint.low) else {}
    if isfinite(joint.effort):
        limits["actuatorfrcrange"] = f"{number(-joint.effort)} {number(joint.effort)}"
    _add(
        body, "joint", name=joint.name, type=joint.kind, axis=numbers(joint.axis), pos=numbers(joint.anchor),
        damping=number(joint.damping), armature=number(joint.armature), frictionloss=number(joint.friction),
        **limits,
    )  # fmt: skip


def _mjcf_shape(body: ET.Element, shape: TreeShape) -> None:
    contact = {} if shape.collides else {"contype": "0", "conaffinity": "0"}
    group = "2" if shape.is_drawn else "3"
    common = {"rgba": numbers(shape.colour), "group": group, "mass": "0", **contact}
    if shape.kind == "mesh":
        # MuJoCo centres and turns a mesh when it compiles, and adds that to the pose: these are centred already
        _add(body, "geom", type="mesh", mesh=shape.name, **_mjcf_place(shape.pose), **common)
        return
    size = {"sphere": shape.size[:1], "capsule": shape.size[:2], "cylinder": shape.size[:2]}
    _add(
        body, "geom", type=shape.kind, size=numbers(size.get(shape.kind, shape.size)),
        **_mjcf_place(shape.pose), **common,
    )  # fmt: skip
