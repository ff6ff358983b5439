"""The simulated world: the arm's model among boxes and in a scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees, isfinite
from pathlib import Path

import mujoco
import numpy as np

from heptarm.sim.plant.appearance import DRAWN_GROUP, HIDDEN_GROUP, ArmMeshes, undress
from heptarm.sim.plant.carried import NO_TREES, CarriedShapes, make_room, plain
from heptarm.sim.plant.obstacles import add_body
from heptarm.sim.plant.other_arm import OtherArm
from heptarm.sim.plant.scene import PREFIX, TOOL, Scene, adopt
from heptarm.values.camera import Camera
from heptarm.values.pose import Pose
from heptarm.values.robot import FLANGE_RADIUS, RobotModel, robot
from heptarm.values.shape import ORIGIN
from heptarm.values.world import WorldBody

MODELS = Path(__file__).parents[1] / "models"
#: Name of the camera of a model.
CAMERA = "heptarm"
#: MuJoCo's cameras look along -z and have y up; ours look along z and have y down.
_UPSIDE_DOWN = Pose.of((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
_NUMBERS = 6
#: Contact type of the world's shapes, as the floor's.
_MEETS_ARM = 2
#: Compliance of boxes, MuJoCo's time constant [s] and damping ratio.
COMPLIANCE = (0.03, 1.0)
#: How a contact grows harder with its depth, MuJoCo's `solimp`: 15 N of a tool go 0.1 to 0.2 mm deep, as its mounting
#: is about that compliant. With MuJoCo's own, 0.9 at depth 0, it is micrometres, and what slides under a force hops.
ONSET = (0.0, 0.95, 0.0005, 0.5, 2.0)


@dataclass(frozen=True, slots=True)
class Box:
    """A fixed box, its edges along the base's axes.

    Attributes:
        centre: in the base [m].
        size: edges along x, y, z [m].
    """

    centre: tuple[float, float, float]
    size: tuple[float, float, float]

    @staticmethod
    def of(text: str) -> Box:
        """A box from "X,Y,Z,LENGTH,WIDTH,HEIGHT": its centre and its edges [m].

        Raises:
            ValueError: the text describes no box.
        """
        try:
            numbers = [float(part) for part in text.split(",")]
        except ValueError:
            numbers = []
        if len(numbers) != _NUMBERS or not all(map(isfinite, numbers)) or min(numbers[3:]) <= 0:
            raise ValueError(
                f"box must be X,Y,Z,LENGTH,WIDTH,HEIGHT in metres with edges above 0, got {text!r}"
            )
        x, y, z, length, width, height = numbers
        return Box((x, y, z), (length, width, height))


def specification(model: str, meshes: ArmMeshes | None = None) -> mujoco.MjSpec:
    """MuJoCo's description of a robot: "iiwa7", "iiwa14", "med7" or "med14", with a media flange "iiwa14+touch".

    The Med robots have the shapes of the iiwa ones, and the masses of their own links. A media flange belongs to the
    last link.

    Args:
        model: name of the robot.
        meshes: in which it is drawn; None: nobody looks, it has the shapes that meet others alone.
    """
    arm = robot(model)
    spec = mujoco.MjSpec.from_file(str(MODELS / f"{arm.base_name.replace('med', 'iiwa')}.xml"))
    if meshes is None:
        undress(spec)
    else:
        meshes.dress(spec)
    is_mounted = arm.flange.height > 0
    # the file has the masses of an iiwa with a plain flange
    for index in range(7) if arm.base_name.startswith("med") else (6,) if is_mounted else ():
        body, inertia = spec.body(f"link_{index + 1}"), arm.links.inertia[index]
        body.mass, body.ipos = arm.links.mass[index], arm.links.com[index]
        body.fullinertia = (*inertia.diagonal(), inertia[0, 1], inertia[0, 2], inertia[1, 2])
    if is_mounted:
        _mount_flange(spec, arm, is_drawn=meshes is not None)
    return spec


def _mount_flange(spec: mujoco.MjSpec, arm: RobotModel, *, is_drawn: bool) -> None:
    """Give the last link its media flange: the site, a shape that meets others, and a mesh for the eye."""
    site = spec.site("flange")
    bottom, top = float(site.pos[2]), float(arm.links.flange[2])
    site.pos = arm.links.flange
    site.parent.add_geom(
        spec.find_default("arm"),
        name="media flange",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        fromto=[0.0, 0.0, bottom, 0.0, 0.0, top],
        size=[FLANGE_RADIUS, 0.0, 0.0],
        material="dark",
        group=HIDDEN_GROUP if is_drawn else 0,
    )
    if is_drawn:
        turns = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
        circle = FLANGE_RADIUS * np.stack([np.cos(turns), np.sin(turns)], axis=1)
        rims = [np.column_stack([circle, np.full(len(circle), z)]) for z in (bottom, top)]
        spec.add_mesh(name="media flange", uservert=np.concatenate(rims).ravel())
        site.parent.add_geom(
            spec.find_default("shown"), meshname="media flange", material="dark", group=DRAWN_GROUP
        )


def compiled(
    model: str,
    boxes: Sequence[Box] = (),
    scene: Scene | None = None,
    meshes: ArmMeshes | None = None,
    carried: Sequence[CarriedShapes] = (),
    *,
    obstacles: Sequence[WorldBody] = (),
    arms: Sequence[OtherArm] = (),
    room: bool = False,
    camera: Camera | None = None,
    origin: Pose = ORIGIN,
    tool_of: str = "",
) -> mujoco.MjModel:
    """MuJoCo's model of a robot among boxes and in a scene, see `specification`; its first seven joints are the arm's.

    Args:
        model: name of the robot.
        boxes: fixed boxes around it.
        scene: what else is around it and on its flange; None: nothing.
        meshes: see `specification`.
        carried: what is on the flange. Where a scene has a tool, that one is there: the shapes of another are left out.
        obstacles: free bodies that are added to the world.
        arms: other arms in it.
        room: whether shapes can be mounted later, see `heptarm.sim.plant.carried.FlangeShapes`.
        camera: from which it is drawn; MuJoCo knows it as `CAMERA`. None: none.
        origin: pose of floor, boxes and scene in the base of the robot.
        tool_of: the other arm that has the tool of the scene; "": the robot itself.

    Raises:
        ValueError: the file of the scene is not in MuJoCo's format.
    """
    spec = specification(model, meshes)
    if origin != ORIGIN:
        _place_floor(spec, origin)
    for arm in arms:
        _add_arm(spec, arm, meshes)
    if scene is not None:
        scene.attach_to(spec, at=origin, flange=f"{tool_of}/flange" if tool_of else "flange")
    has_tool = spec.body(PREFIX + TOOL) is not None and not tool_of
    for mounted in carried:
        if not (mounted.is_tool and has_tool):
            mounted.add_to(spec)
    if room and not has_tool:
        make_room(spec)
    for number, box in enumerate(boxes):
        spec.worldbody.add_geom(
            name=f"box {number}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=(origin @ Pose.of(box.centre)).xyz,
            quat=np.roll(origin.quat, 1),
            size=[0.5 * edge for edge in box.size],
            contype=_MEETS_ARM,
            conaffinity=1,
            priority=1,
            solref=COMPLIANCE,
            rgba=[0.7, 0.6, 0.45, 1.0],
        )
    for body in obstacles:
        add_body(spec, body)
    if scene is None and not (boxes or obstacles or arms):
        # each link has two shapes: a search by trees takes longer than none
        spec.option.disableflags |= NO_TREES
    if camera is not None:
        add_camera(spec, camera)
    _soften(spec)
    return spec.compile() if scene is None else scene.compile(spec)


def _soften(spec: mujoco.MjSpec) -> None:
    """Let contacts of shapes for which nobody has chosen a hardness begin without one."""
    own = mujoco.MjSpec().worldbody.add_geom().solimp
    for geom in spec.geoms:
        if np.array_equal(geom.solimp, own):
            geom.solimp = ONSET


def add_camera(spec: mujoco.MjSpec, camera: Camera) -> None:
    """Add a camera to the description of an arm, as `CAMERA`."""
    body, pose = spec.worldbody, camera.pose @ _UPSIDE_DOWN
    if camera.frame == "flange":
        flange = spec.site("flange")
        body, pose = flange.parent, Pose.of(flange.pos, np.roll(flange.quat, -1)) @ pose
    added = body.add_camera(name=CAMERA, pos=pose.xyz, quat=np.roll(pose.quat, 1), fovy=degrees(camera.fov))
    if camera.principal is not None:
        focal, size, matrix = camera.matrix[0, 0], np.array(camera.size), camera.matrix
        added.resolution, added.sensor_size = size, size / focal
        added.focal_pixel = (focal, focal)
        added.principal_pixel = 0.5 * (size - 1.0) - matrix[:2, 2]


def _add_arm(spec: mujoco.MjSpec, arm: OtherArm, meshes: ArmMeshes | None) -> None:
    """Add another arm to the world; its bodies, joints and sites are named "NAME/...", its joints come behind."""
    other = specification(arm.robot, meshes)
    for mounted in arm.carried:
        mounted.add_to(other)
    for body in other.bodies[1:]:
        body.name = plain(body.name)
    adopt(other, spec)
    frame = spec.worldbody.add_frame(pos=arm.pose.xyz, quat=np.roll(arm.pose.quat, 1))
    frame.attach_body(other.body("link_0"), f"{arm.name}/", "")


def _place_floor(spec: mujoco.MjSpec, origin: Pose) -> None:
    floor = spec.geom("floor")
    floor.pos, floor.quat = origin.xyz, np.roll(origin.quat, 1)
