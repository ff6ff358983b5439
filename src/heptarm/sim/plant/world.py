"""The simulated world: the arm's model among boxes and in a scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees, isfinite
from pathlib import Path

import mujoco
import numpy as np

from heptarm.sim.plant.appearance import ArmMeshes, undress
from heptarm.sim.plant.carried import NO_TREES, CarriedShapes, make_room
from heptarm.sim.plant.scene import PREFIX, TOOL, Scene
from heptarm.values.camera import Camera
from heptarm.values.pose import Pose
from heptarm.values.robot import robot

MODELS = Path(__file__).parents[1] / "models"
#: Name of the camera of a model.
CAMERA = "heptarm"
#: MuJoCo's cameras look along -z and have y up; ours look along z and have y down.
_UPSIDE_DOWN = Pose.of((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
_NUMBERS = 6
#: Contact type of the world's shapes, as the floor's.
_MEETS_ARM = 2
#: Compliance of boxes, MuJoCo's time constant [s] and damping ratio: about that of a tool's mounting.
COMPLIANCE = (0.05, 1.0)


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
    """MuJoCo's description of a robot: "iiwa7", "iiwa14", "med7" or "med14".

    The Med robots have the shapes of the iiwa ones, and the masses of their own links.

    Args:
        model: name of the robot.
        meshes: in which it is drawn; None: nobody looks, it has the shapes that meet others alone.
    """
    spec = mujoco.MjSpec.from_file(str(MODELS / f"{model.replace('med', 'iiwa')}.xml"))
    if meshes is None:
        undress(spec)
    else:
        meshes.dress(spec)
    if model.startswith("med"):
        links = robot(model).links
        for index in range(7):
            body, inertia = spec.body(f"link_{index + 1}"), links.inertia[index]
            body.mass, body.ipos = links.mass[index], links.com[index]
            body.fullinertia = (*inertia.diagonal(), inertia[0, 1], inertia[0, 2], inertia[1, 2])
    return spec


def compiled(
    model: str,
    boxes: Sequence[Box] = (),
    scene: Scene | None = None,
    meshes: ArmMeshes | None = None,
    carried: Sequence[CarriedShapes] = (),
    *,
    room: bool = False,
    camera: Camera | None = None,
) -> mujoco.MjModel:
    """MuJoCo's model of a robot among boxes and in a scene, see `specification`; its first seven joints are the arm's.

    Args:
        model: name of the robot.
        boxes: fixed boxes around it.
        scene: what else is around it and on its flange; None: nothing.
        meshes: see `specification`.
        carried: what is on the flange. Where a scene has a tool, that one is there: the shapes of another are left out.
        room: whether shapes can be mounted later, see `heptarm.sim.plant.carried.FlangeShapes`.
        camera: from which it is drawn; MuJoCo knows it as `CAMERA`. None: none.

    Raises:
        ValueError: the file of the scene is not in MuJoCo's format.
    """
    spec = specification(model, meshes)
    if scene is not None:
        scene.attach_to(spec)
    has_tool = spec.body(PREFIX + TOOL) is not None
    for one in carried:
        if not (one.is_tool and has_tool):
            one.add_to(spec)
    if room and not has_tool:
        make_room(spec)
    for number, box in enumerate(boxes):
        spec.worldbody.add_geom(
            name=f"box {number}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=box.centre,
            size=[0.5 * edge for edge in box.size],
            contype=_MEETS_ARM,
            conaffinity=1,
            priority=1,
            solref=COMPLIANCE,
            rgba=[0.7, 0.6, 0.45, 1.0],
        )
    if scene is None and not boxes:
        # each link has two shapes: a search by trees takes longer than none
        spec.option.disableflags |= NO_TREES
    if camera is not None:
        _add_camera(spec, camera)
    return spec.compile()


def _add_camera(spec: mujoco.MjSpec, camera: Camera) -> None:
    body, pose = spec.worldbody, camera.pose @ _UPSIDE_DOWN
    if camera.frame == "flange":
        flange = spec.site("flange")
        body, pose = flange.parent, Pose.of(flange.pos, np.roll(flange.quat, -1)) @ pose
    body.add_camera(name=CAMERA, pos=pose.xyz, quat=np.roll(pose.quat, 1), fovy=degrees(camera.fov))
