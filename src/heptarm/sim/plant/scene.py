"""Scenes: what is around the arm and on its flange, in MuJoCo's own format (MJCF).

A scene is attached to the model of the arm: its bodies to the world, and the body `tool`, if there is one, to the
flange. Free bodies move, collide, and can be grasped. A scene with an actuator `gripper` has a gripper, which signals
of the cabinet drive; see `heptarm.sim.plant.gripper`.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import mujoco
import numpy as np

from heptarm.errors import CommandRejected
from heptarm.values.checks import shown
from heptarm.values.files import read_xml, unreadable
from heptarm.values.io import GripperWiring
from heptarm.values.pose import Pose
from heptarm.values.robot import Body
from heptarm.values.shape import ORIGIN

FOLDER = Path(__file__).parents[1] / "scenes"
#: Put before all names of a scene, so that they differ from those of the arm.
PREFIX = "scene/"
#: Body of a scene that is mounted on the flange; its frame is the flange's.
TOOL = "tool"
#: Put before the names of meshes and the like of what is around the arm, where the tool has some of the same names.
_AROUND = "around/"
#: Actuator of a scene that is a gripper, and text that names its signals.
GRIPPER = "gripper"
#: What a scene decides in `<option>`: how contacts are solved. All else is the arm's.
_CONTACT_OPTIONS = ("cone", "impratio", "noslip_iterations", "noslip_tolerance", "iterations", "tolerance")
_SUFFIX = ".xml"
#: Attributes that are names, whatever they look like.
_NAMES = (
    "name",
    "class",
    "childclass",
    "mesh",
    "material",
    "texture",
    "file",
    "body",
    "joint",
    "geom",
    "site",
    "target",
)
#: Largest mesh [m]; a part in millimetres is larger, a hall is not.
_LARGEST_MESH = 30.0
#: Parts of scenes, which are no scene by themselves.
_PARTS = ("two-finger-gripper",)


@dataclass(frozen=True, slots=True)
class Scene:
    """A scene.

    Attributes:
        path: its file in MuJoCo's format.
    """

    path: Path

    @staticmethod
    def of(text: str) -> Scene:
        """A ready scene by its name, or a file by its path.

        Raises:
            ValueError: there is neither.
        """
        ready = FOLDER / f"{text}{_SUFFIX}"
        if text in names():
            return Scene(ready)
        path = Path(os.path.expanduser(text))
        if not os.path.isfile(path):  # False, too, for names that no file can have
            raise ValueError(
                f"scene must be a file in MuJoCo's format or one of {', '.join(names())}; got {text!r}"
            )
        return Scene(path)

    def read(self) -> mujoco.MjSpec:
        """The scene as MuJoCo reads it; it may include ready scenes and the ready gripper by their file names.

        Raises:
            CommandRejected: the file cannot be read, is not in MuJoCo's format, or has a number that is not finite.
        """
        if self.path.parent == FOLDER:
            return mujoco.MjSpec.from_file(str(self.path))
        _check_numbers(self.path)
        try:
            return mujoco.MjSpec.from_file(str(self.path), include=_ready())
        except (ValueError, mujoco.FatalError) as error:
            raise self.unreadable(error) from None

    def unreadable(self, error: Exception | str) -> CommandRejected:
        """The error of a scene that MuJoCo cannot read or compile."""
        why = " ".join(str(error).removeprefix("Error: ").split())
        return unreadable(self.path, why, what="a scene", name="scene")

    def compile(self, spec: mujoco.MjSpec) -> mujoco.MjModel:
        """Compile a description to which this scene was attached.

        Raises:
            CommandRejected: MuJoCo cannot compile it, a number in it is not finite, or a mesh is not in metres.
        """
        try:
            model = spec.compile()
        except (ValueError, mujoco.FatalError) as error:
            raise self.unreadable(error) from None
        for kind, count, arrays in (
            ("body", model.nbody, ("body_pos", "body_quat", "body_mass", "body_inertia", "body_ipos")),
            ("joint", model.njnt, ("jnt_pos", "jnt_axis", "jnt_range", "jnt_stiffness")),
            ("geom", model.ngeom, ("geom_pos", "geom_quat", "geom_size", "geom_friction", "geom_solref")),
            ("site", model.nsite, ("site_pos", "site_quat")),
        ):
            for array in arrays if count else ():
                rows = np.isfinite(getattr(model, array).reshape(count, -1)).all(axis=1)
                if not rows.all():
                    name = plain(getattr(model, kind)(int(np.argmin(rows))).name)
                    what = array.partition("_")[2]
                    raise self.unreadable(f"{what} of the {kind} {name!r} is not finite")
        for index in range(model.nmesh):
            first, count = int(model.mesh_vertadr[index]), int(model.mesh_vertnum[index])
            size = float(np.ptp(model.mesh_vert[first : first + count], axis=0).max())
            if size > _LARGEST_MESH:
                raise unreadable(
                    self.path,
                    f"the mesh {plain(model.mesh(index).name)!r} is {size:.3g} m large, at most {_LARGEST_MESH:g} m "
                    "are allowed: millimetres?",
                    what="a scene",
                    name="scene",
                    hint='a mesh in millimetres needs scale="0.001 0.001 0.001" in the scene',
                )
        return model

    def attach_to(self, arm: mujoco.MjSpec, *, at: Pose = ORIGIN, flange: str = "flange") -> None:
        """Add the scene to the description of an arm: the tool to its flange, all else to the world.

        Args:
            arm: the description.
            at: pose of the scene in the base of the arm.
            flange: site to which the tool is mounted.

        Raises:
            ValueError: the file is not in MuJoCo's format.
        """
        attach(self.read(), arm, at=at, flange=flange)

    def place_of(self, name: str) -> Pose | None:
        """Where the scene has a site of that name, such as the base of another arm; None: it has none."""
        found = next((site for site in self.read().worldbody.sites if site.name == name), None)
        return None if found is None else Pose.of(found.pos, np.roll(found.quat, -1))

    @property
    def load(self) -> Body | None:
        """Mass and centre of what the scene mounts on the flange; None: it mounts nothing.

        Raises:
            CommandRejected: MuJoCo cannot compile the scene.
        """
        if _top_level(self.read(), TOOL) is None:
            return None
        flange = mujoco.MjSpec()
        flange.worldbody.add_body(name="flange").add_site(name="flange")
        self.attach_to(flange)
        model = self.compile(flange)
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        tool = find_body(model, TOOL)
        return Body(float(model.body_subtreemass[tool]), data.subtree_com[tool])

    @property
    def wiring(self) -> GripperWiring:
        """Signals of its gripper.

        Raises:
            ValueError: the text `gripper` of the scene names something else.
        """
        return GripperWiring.of(" ".join(text.data for text in self.read().texts if text.name == GRIPPER))


def _check_numbers(file: Path) -> None:
    """Refuse numbers that are not finite, which MuJoCo takes as they are.

    Raises:
        CommandRejected: there is one; the text names the element and its attribute. Or it is no XML.
    """
    for element in read_xml(file, "a scene", name="scene").iter():
        for attribute, text in element.attrib.items():
            if attribute not in _NAMES and _has_no_number(text):
                named = f" {element.get('name')!r}" if element.get("name") else ""
                raise unreadable(
                    file,
                    f"{attribute} of the {element.tag}{named} must be finite numbers, got {shown(text)}",
                    what="a scene",
                    name="scene",
                )


def _has_no_number(text: str) -> bool:
    """Whether a text is numbers of which one is not finite."""
    try:
        return not all(isfinite(float(part)) for part in text.split())
    except ValueError:  # a word
        return False


def attach(world: mujoco.MjSpec, arm: mujoco.MjSpec, *, at: Pose = ORIGIN, flange: str = "flange") -> None:
    """Add what a scene describes to the description of an arm, see `Scene.attach_to`."""
    for element in (*world.texts, *world.keys):  # of the file as a whole, and of no meaning for the arm
        world.delete(element)
    for name in _CONTACT_OPTIONS:
        setattr(arm.option, name, getattr(world.option, name))
    tool = _top_level(world, TOOL)
    if tool is not None:
        alone = world.copy()
        adopt(alone, arm)
        world.delete(tool)
        arm.site(flange).attach_body(alone.body(TOOL), PREFIX, "")
        _rename_assets(world)  # the tool has brought its copies
    adopt(world, arm)
    frame = arm.worldbody.add_frame(pos=at.xyz, quat=np.roll(at.quat, 1))
    arm.attach(world, frame=frame, prefix=PREFIX)


def attach_text(arm: mujoco.MjSpec, text: str, *, what: str) -> None:
    """Add a scene that is a text in MuJoCo's format to the description of an arm.

    Args:
        arm: the description.
        text: the scene; it may include ready scenes and the ready gripper by their file names.
        what: its name in errors.

    Raises:
        CommandRejected: it is not in MuJoCo's format.
    """
    try:
        attach(mujoco.MjSpec.from_string(text, include=_ready()), arm)
    except (ValueError, mujoco.FatalError) as error:
        why = " ".join(str(error).removeprefix("Error: ").split())
        raise CommandRejected(f"{what} cannot be read: {why}", parameter="scene") from None


def _ready() -> dict[str, bytes]:
    """Ready scenes and parts of them by their file names."""
    return {path.name: path.read_bytes() for path in FOLDER.glob(f"*{_SUFFIX}")}


def names() -> tuple[str, ...]:
    """Names of the ready scenes."""
    return tuple(sorted(path.stem for path in FOLDER.glob(f"*{_SUFFIX}") if path.stem not in _PARTS))


def is_mounted(model: mujoco.MjModel) -> bool:
    """Whether the scene of a model has a tool on the flange."""
    return bool(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, PREFIX + TOOL) >= 0)


def find_body(model: mujoco.MjModel, name: str) -> int:
    """Index of a body of the scene.

    Raises:
        ValueError: there is none of that name; the text lists them.
    """
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, PREFIX + name)
    if index < 0:
        known = [model.body(body).name for body in range(model.nbody)]
        listed = (
            ", ".join(plain(name) for name in known if name.startswith(PREFIX)) or "none: there is no scene"
        )
        raise ValueError(f"body must be one of {listed}; got {name!r}")
    return int(index)


def plain(name: str) -> str:
    """A name as the scene's file has it."""
    return name.removeprefix(PREFIX)


def _rename_assets(spec: mujoco.MjSpec) -> None:
    """Give meshes, materials and textures of a description other names, and those to what refers to them."""
    for asset in (*spec.meshes, *spec.hfields, *spec.textures):
        asset.name = _AROUND + (
            asset.name or Path(asset.file).stem
        )  # which MuJoCo names by its file otherwise
    for asset in spec.materials:
        asset.name = _AROUND + asset.name
    for geom in spec.geoms:
        geom.hfieldname = geom.hfieldname and _AROUND + geom.hfieldname
        geom.meshname = geom.meshname and _AROUND + geom.meshname
        geom.material = geom.material and _AROUND + geom.material
    for material in spec.materials:
        material.textures = [name and _AROUND + name for name in material.textures]


def _top_level(spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody | None:
    return next((body for body in spec.worldbody.bodies if body.name == name), None)


def adopt(scene: mujoco.MjSpec, arm: mujoco.MjSpec) -> None:
    """Give a scene the options of the arm, so that nothing conflicts when it is attached."""
    for name in dir(scene.option):
        value = getattr(scene.option, name)
        if not name.startswith("_") and not callable(value):
            setattr(scene.option, name, getattr(arm.option, name))
