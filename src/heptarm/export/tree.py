"""The model of an arm, a tool and a scene as a tree of bodies, whatever the format in which it is written."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, require
from heptarm.values.checks import Array, Value
from heptarm.values.fitted_arm import FittedArm
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel, symmetric
from heptarm.values.shape import ORIGIN
from heptarm.values.tool import Tool

if TYPE_CHECKING:
    import mujoco

#: Name of the frame in which the arm stands, as in recordings: it holds what is fixed in the world.
BASE, FLANGE = "base", "flange"
#: A plane is a box as thick as this [m], and as wide as this at most [m].
_THICKNESS, _WIDEST = 0.02, 20.0


@dataclass(frozen=True, slots=True, eq=False)
class TreeShape(Value):
    """A shape of a body.

    Attributes:
        kind: "box", "cylinder", "sphere", "capsule", "ellipsoid" or "mesh".
        size: half edges of a box, radii of an ellipsoid; otherwise radius and half length along z, shape (3,) [m].
        pose: in the frame of its body.
        colour: red, green, blue, opacity, shape (4,), 0 to 1.
        collides: whether it meets other bodies; otherwise it is for the eye alone.
        is_drawn: whether it is for the eye.
        name: of a mesh.
        vertices: of a mesh, shape (n, 3) [m].
        faces: of a mesh: indices of vertices, shape (m, 3).
    """

    kind: str
    size: Array
    pose: Pose
    colour: Array
    collides: bool
    is_drawn: bool
    name: str = ""
    vertices: Array = field(default_factory=lambda: np.zeros((0, 3)))
    faces: npt.NDArray[np.int64] = field(default_factory=lambda: np.zeros((0, 3), np.int64))


@dataclass(frozen=True, slots=True, eq=False)
class TreeJoint(Value):
    """How a body moves in the one before.

    Attributes:
        name: of the joint.
        kind: "hinge", "slide" or "free".
        axis: in the frame of the body, shape (3,).
        anchor: a point on the axis in the frame of the body, shape (3,) [m].
        low: lowest position [rad or m]; -inf: none.
        high: highest position.
        speed: largest [rad/s or m/s]; inf: none.
        effort: largest torque or force [Nm or N]; inf: none.
        damping: viscous [Nms/rad or Ns/m].
        armature: inertia of the drive about the axis [kg m² or kg].
        friction: Coulomb friction [Nm or N].
    """

    name: str
    kind: str
    axis: Array
    anchor: Array
    low: float = -inf
    high: float = inf
    speed: float = inf
    effort: float = inf
    damping: float = 0.0
    armature: float = 0.0
    friction: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class TreeBody(Value):
    """A body, or a frame without mass.

    Attributes:
        name: unique in the tree.
        parent: name of the body before; empty: it is the root.
        pose: in the frame of the parent, at joint position 0.
        mass: [kg].
        com: centre of mass, shape (3,) [m].
        inertia: about the centre of mass, axes of the body, shape (3, 3) [kg m²].
        joint: None: it is fixed.
        shapes: of it.
    """

    name: str
    parent: str
    pose: Pose
    mass: float = 0.0
    com: Array = field(default_factory=lambda: np.zeros(3))
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))
    joint: TreeJoint | None = None
    shapes: tuple[TreeShape, ...] = ()

    @property
    def is_frame(self) -> bool:
        """Whether it is a frame alone: fixed, without mass and shapes."""
        return bool(self.parent) and self.mass == 0.0 and not self.shapes and self.joint is None


def tree_of(
    robot: RobotModel, *, tool: Tool | None, scene: str, fitted: FittedArm | None = None
) -> tuple[TreeBody, ...]:
    """The bodies of an arm, a tool and a scene, each behind the one that it is fixed to.

    Args:
        robot: the robot, with its media flange.
        tool: on the flange; None: none.
        scene: name of a ready scene, or a file (MJCF); empty: none.
        fitted: whose friction and rotors the joints of the arm have; None: those of the simulator.

    Raises:
        CommandRejected: there is no such scene, or it has what no format but MuJoCo's knows; or a scene and the tool
            both have something on the flange.
        MissingExtra: MuJoCo is not installed.
    """
    require("mujoco", extra="sim")
    from heptarm.sim.plant.appearance import ArmMeshes
    from heptarm.sim.plant.scene import Scene, is_mounted
    from heptarm.sim.plant.world import compiled

    try:
        around = Scene.of(scene) if scene else None
        model = compiled(robot.name, scene=around, meshes=ArmMeshes())
    except ValueError as error:
        raise CommandRejected(str(error), parameter="scene", value=scene) from None
    if tool is not None and is_mounted(model):
        raise CommandRejected(
            f"the scene {scene} has a tool on the flange already, so that {tool.name!r} has no place there",
            parameter="tool",
            value=tool.name,
            hint="leave out the tool, or choose a scene without one",
        )
    bodies = [TreeBody(BASE, "", ORIGIN, shapes=tuple(_shapes(model, 0)))]
    found = [_body(model, index, robot) for index in range(1, model.nbody)]
    bodies += found if fitted is None else _measured(found, fitted)
    site = model.site(FLANGE)
    last = _name(model, int(site.bodyid[0]))
    bodies.append(TreeBody(FLANGE, last, Pose.of(site.pos, np.roll(site.quat, -1))))
    bodies += _tool(tool) if tool is not None else []
    names = [body.name for body in bodies]
    doubled = next((name for name in names if names.count(name) > 1), "")
    if doubled:
        raise CommandRejected(
            f"two bodies of the model would be named {doubled!r}",
            parameter="tool",
            value=doubled,
            hint="rename the tool or its frame",
        )
    return tuple(bodies)


def _measured(bodies: Sequence[TreeBody], fitted: FittedArm) -> Iterator[TreeBody]:
    """Bodies whose arm has the friction and the rotors that were identified, as far as they are known."""
    known = {"damping": "viscous", "friction": "coulomb", "armature": "rotor"}
    names = [f"A{axis + 1}" for axis in range(7)]
    for body in bodies:
        if body.joint is None or body.joint.name not in names:
            yield body
            continue
        axis = names.index(body.joint.name)
        values: dict[str, Any] = {
            one: float(fitted[name].value[axis]) for one, name in known.items() if name in fitted
        }
        yield replace(body, joint=replace(body.joint, **values))


def poses_in_base(bodies: Sequence[TreeBody]) -> dict[str, Pose]:
    """Poses of all bodies in the base at joint position 0, by name."""
    found: dict[str, Pose] = {}
    for body in bodies:
        found[body.name] = found.get(body.parent, ORIGIN) @ body.pose
    return found


def _name(model: mujoco.MjModel, body: int) -> str:
    """Name of a body; the scene's without their prefix, as far as that is unique."""
    if body == 0:
        return BASE
    return model.body(body).name.replace("/", "_") or f"body_{body}"


def _body(model: mujoco.MjModel, index: int, robot: RobotModel) -> TreeBody:
    turn = Pose.of((0.0, 0.0, 0.0), np.roll(model.body_iquat[index], -1)).rotation
    name = _name(model, index)
    joints = [int(model.body_jntadr[index]) + offset for offset in range(int(model.body_jntnum[index]))]
    if len(joints) > 1:
        raise CommandRejected(
            f"the body {name!r} of the scene has {len(joints)} joints, and other formats know one for each body",
            parameter="scene",
            value=name,
            hint="put a light body between the joints",
        )
    return TreeBody(
        name,
        _name(model, int(model.body_parentid[index])),
        Pose.of(model.body_pos[index], np.roll(model.body_quat[index], -1)),
        float(model.body_mass[index]),
        np.array(model.body_ipos[index]),
        turn @ np.diag(model.body_inertia[index]) @ turn.T,
        _joint(model, joints[0], robot) if joints else None,
        tuple(_shapes(model, index)),
    )


def _joint(model: mujoco.MjModel, index: int, robot: RobotModel) -> TreeJoint:
    kind = ("free", "ball", "slide", "hinge")[int(model.jnt_type[index])]
    name = model.joint(index).name.replace("/", "_") or f"joint_{index}"
    if kind == "ball":
        raise CommandRejected(
            f"the joint {name!r} of the scene is a ball joint, which URDF and SDF do not know",
            parameter="scene",
            value=name,
            hint="use three hinges",
        )
    if kind == "free":
        return TreeJoint(name, kind, np.array([0.0, 0.0, 1.0]), np.zeros(3))
    dof = int(model.jnt_dofadr[index])
    low, high = model.jnt_range[index].tolist() if model.jnt_limited[index] else (-inf, inf)
    made = TreeJoint(
        name,
        kind,
        np.array(model.jnt_axis[index]),
        np.array(model.jnt_pos[index]),
        low,
        high,
        damping=float(model.dof_damping[dof]),
        armature=float(model.dof_armature[dof]),
        friction=float(model.dof_frictionloss[dof]),
    )
    if index >= len(robot.dq_max):  # the arm's joints come first
        return made
    return replace(
        made,
        low=float(robot.q_min[index]),
        high=float(robot.q_max[index]),
        speed=float(robot.dq_max[index]),
        effort=float(robot.tau_max[index]),
    )


def _shapes(model: mujoco.MjModel, body: int) -> Iterator[TreeShape]:
    from heptarm.sim.plant.appearance import HIDDEN_GROUP

    first = int(model.body_geomadr[body])
    for index in range(first, first + int(model.body_geomnum[body])) if first >= 0 else ():
        kind = model.geom(index).type.item()
        names = {0: "plane", 2: "sphere", 3: "capsule", 4: "ellipsoid", 5: "cylinder", 6: "box", 7: "mesh"}
        if kind not in names:  # a height field
            continue
        pose = Pose.of(model.geom_pos[index], np.roll(model.geom_quat[index], -1))
        material = int(model.geom_matid[index])
        made = TreeShape(
            names[kind],
            np.array(model.geom_size[index]),
            pose,
            np.array(model.mat_rgba[material] if material >= 0 else model.geom_rgba[index], float),
            collides=bool(model.geom_contype[index] or model.geom_conaffinity[index]),
            is_drawn=int(model.geom_group[index]) < HIDDEN_GROUP,
        )
        if made.kind == "plane":
            x, y, _ = made.size.tolist()
            size = np.array([min(x or _WIDEST, _WIDEST), min(y or _WIDEST, _WIDEST), 0.5 * _THICKNESS])
            made = replace(made, kind="box", size=size, pose=pose @ Pose.of((0.0, 0.0, -0.5 * _THICKNESS)))
        elif made.kind == "mesh":
            mesh = int(model.geom_dataid[index])
            vertex, face = int(model.mesh_vertadr[mesh]), int(model.mesh_faceadr[mesh])
            made = replace(
                made,
                name=model.mesh(mesh).name.replace("/", "_").replace(" ", "_"),
                vertices=np.array(model.mesh_vert[vertex : vertex + int(model.mesh_vertnum[mesh])], float),
                faces=np.array(model.mesh_face[face : face + int(model.mesh_facenum[mesh])], np.int64),
            )
        yield made


def _tool(tool: Tool) -> list[TreeBody]:
    """A tool as a body on the flange, and its frames."""
    colour = np.array([0.45, 0.47, 0.5, 1.0])
    shapes = []
    for shape in tool.shapes:
        radius, length, _ = shape.size.tolist()
        size = 0.5 * shape.size if shape.kind == "box" else np.array([radius, 0.5 * length, 0.0])
        shapes.append(TreeShape(shape.kind, size, shape.pose, colour, collides=True, is_drawn=True))
    name = tool.name.replace("/", "_").replace(" ", "_")
    body = TreeBody(name, FLANGE, ORIGIN, tool.mass, tool.com, symmetric(tool.inertia), None, tuple(shapes))
    frames = [TreeBody(f"{name}_{frame}".replace(" ", "_"), name, pose) for frame, pose in tool.frames]
    return [body, *frames]
