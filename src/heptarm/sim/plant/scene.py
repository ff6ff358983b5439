"""Scenes: what is around the arm and on its flange, in MuJoCo's own format (MJCF).

A scene is attached to the model of the arm: its bodies to the world, and the body `tool`, if there is one, to the
flange. Free bodies move, collide, and can be grasped. A scene with an actuator `gripper` has a gripper, which signals
of the cabinet drive; see `heptarm.sim.plant.gripper`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco

FOLDER = Path(__file__).parents[1] / "scenes"
#: Put before all names of a scene, so that they differ from those of the arm.
PREFIX = "scene/"
#: Body of a scene that is mounted on the flange; its frame is the flange's.
TOOL = "tool"
#: Actuator of a scene that is a gripper, and text that names its signals.
GRIPPER = "gripper"
#: What a scene decides in `<option>`: how contacts are solved. All else is the arm's.
_CONTACT_OPTIONS = ("cone", "impratio", "noslip_iterations", "noslip_tolerance", "iterations", "tolerance")
_SUFFIX = ".xml"
#: Parts of scenes, which are no scene by themselves.
_PARTS = ("two-finger-gripper",)


@dataclass(frozen=True, slots=True)
class Wiring:
    """Signals of a gripper by their names in the IO image, "Group.Name".

    Attributes:
        open: output that opens it.
        close: output that closes it.
        is_open: input of the switch at the open end.
        is_closed: input of the switch at the closed end: it is closed, with nothing between the fingers.
    """

    open: str = "MediaFlange.OutputX3Pin1"
    close: str = "MediaFlange.OutputX3Pin2"
    is_open: str = "MediaFlange.InputX3Pin3"
    is_closed: str = "MediaFlange.InputX3Pin4"

    @staticmethod
    def of(text: str) -> Wiring:
        """A wiring from "open=Group.Name close=Group.Name ..."; signals that are not named keep their default.

        Raises:
            ValueError: the text names something else.
        """
        pairs = [part.partition("=") for part in text.split()]
        if not all(name in Wiring.__slots__ and signal for name, _, signal in pairs):
            raise ValueError(
                f"signals of a gripper must be NAME=Group.Signal with the names {', '.join(Wiring.__slots__)}, "
                f"got {text!r}"
            )
        return Wiring(**{name: signal for name, _, signal in pairs})


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
        path = Path(text).expanduser()
        if not path.is_file():
            raise ValueError(
                f"scene must be a file in MuJoCo's format or one of {', '.join(names())}; got {text!r}"
            )
        return Scene(path)

    def read(self) -> mujoco.MjSpec:
        """The scene as MuJoCo reads it; it may include ready scenes and the ready gripper by their file names.

        Raises:
            ValueError: the file is not in MuJoCo's format.
        """
        if self.path.parent == FOLDER:
            return mujoco.MjSpec.from_file(str(self.path))
        text = read_text(self.path, name="scene")
        if (wrong := _NOT_FINITE.search(text)) is not None:
            line = text.count("\n", 0, wrong.start()) + 1
            raise unreadable(
                self.path,
                f"line {line}: {wrong[1]} has {wrong[2]}, which is no finite number",
                what=_WHAT,
                name="scene",
                hint="correct the number",
            )
        ready = {path.name: path.read_bytes() for path in FOLDER.glob(f"*{_SUFFIX}")}
        try:
            return mujoco.MjSpec.from_file(str(self.path), include=ready)
        except (ValueError, mujoco.FatalError) as error:
            why = " ".join(str(error).removeprefix("Error: ").split())
            raise unreadable(self.path, why, what=_WHAT, name="scene") from None

    def attach_to(self, arm: mujoco.MjSpec) -> None:
        """Add the scene to the description of an arm: the tool to its flange, all else to the world.

        Raises:
            ValueError: the file is not in MuJoCo's format.
        """
        world = self.read()
        for one in (*world.texts, *world.keys):  # of the file as a whole, and of no meaning for the arm
            world.delete(one)
        for name in _CONTACT_OPTIONS:
            setattr(arm.option, name, getattr(world.option, name))
        tool = _top_level(world, TOOL)
        if tool is not None:
            alone = world.copy()
            _adopt(alone, arm)
            world.delete(tool)
            arm.site("flange").attach_body(alone.body(TOOL), PREFIX, "")
        _adopt(world, arm)
        arm.attach(world, frame=arm.worldbody.add_frame(), prefix=PREFIX)

    @property
    def wiring(self) -> Wiring:
        """Signals of its gripper.

        Raises:
            ValueError: the text `gripper` of the scene names something else.
        """
        return Wiring.of(" ".join(one.data for one in self.read().texts if one.name == GRIPPER))


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
        listed = ", ".join(plain(one) for one in known if one.startswith(PREFIX)) or "none: there is no scene"
        raise ValueError(f"body must be one of {listed}; got {name!r}")
    return int(index)


def plain(name: str) -> str:
    """A name as the scene's file has it."""
    return name.removeprefix(PREFIX)


def _top_level(spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody | None:
    return next((body for body in spec.worldbody.bodies if body.name == name), None)


def _adopt(scene: mujoco.MjSpec, arm: mujoco.MjSpec) -> None:
    """Give a scene the options of the arm, so that nothing conflicts when it is attached."""
    for name in dir(scene.option):
        value = getattr(scene.option, name)
        if not name.startswith("_") and not callable(value):
            setattr(scene.option, name, getattr(arm.option, name))
