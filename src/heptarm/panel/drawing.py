"""What is drawn in three dimensions: arm, scene, a program's world, a plan, the path driven, forces, frames, points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from heptarm.io.panel_box import PlanOutline
from heptarm.sim.plant.appearance import ArmMeshes
from heptarm.sim.plant.carried import GEOMS, mujoco_size
from heptarm.sim.plant.scene import PREFIX, Scene, is_mounted, plain
from heptarm.sim.plant.shapes import DrawnShape, drawn_shapes, solid
from heptarm.sim.plant.shared_state import PositionsFile
from heptarm.sim.plant.world import compiled
from heptarm.values.checks import Array
from heptarm.values.mesh import Mesh
from heptarm.values.pose import Pose
from heptarm.values.shape import Shape
from heptarm.values.world import WorldArm, WorldBody, WorldOutline

_GHOST, _TOUCH = (90, 170, 255), (224, 49, 49)
_ACCENT, _TRAIL, _TOOL = (255, 107, 10), (64, 160, 255), (150, 152, 158)
#: Length of the arrow of a contact [m/N], its longest [m], and the force that is not drawn [N].
_ARROW_SCALE, _LONGEST_ARROW, _LEAST_FORCE = 0.01, 0.6, 2.0
#: A flange and a motion frame closer than this have no line between them [m].
_NO_TOOL = 0.005
#: The segments that an empty trail is drawn with.
_NOTHING = np.zeros((1, 2, 3), np.float32)


def wxyz(pose: Pose) -> tuple[float, float, float, float]:
    """The rotation of a pose as viser has it, w x y z."""
    x, y, z, w = pose.quat.tolist()
    return w, x, y, z


class DrawnWorld:
    """The shapes of arm and scene in viser, moved by joint positions.

    Args:
        server: a viser server.
        model: "iiwa7", "iiwa14", "med7" or "med14".
        scene: what is around the arm and on its flange; None: nothing.
        positions: file in which the simulator writes all positions; None: only the arm moves, and bodies that a
            program adds.
        meshes: of the arm; None: heptarm's own.
        root: node of viser's scene that is the base of the arm; empty: the world.
    """

    def __init__(
        self,
        server: Any,
        model: str,
        scene: Scene | None = None,
        positions: Path | None = None,
        meshes: ArmMeshes | None = None,
        *,
        root: str = "",
    ) -> None:
        self._server, self._robot, self._meshes, self._root = server, model, meshes or ArmMeshes(), root
        self._is_own = scene is not None
        self._positions = positions
        self._scene = server.scene
        self._handles: list[tuple[int, Any]] = []
        self._names: list[tuple[int, Any]] = []
        self._held: dict[int, Pose] = {}  # by address of a free body: its pose in the flange frame
        self._base = self._scene.add_frame(f"{root}/base", axes_length=0.15, axes_radius=0.004)
        self._flange = self._scene.add_frame(f"{root}/flange", axes_length=0.06, axes_radius=0.002)
        self._carried: tuple[tuple[Shape, Pose], ...] = ()
        self._carried_handles: list[Any] = []
        self._text, self._has_tool = "", False
        self._draw(scene)

    def _draw(self, scene: Scene | None) -> None:
        """Draw arm and scene, in place of those before."""
        self.erase()
        self._model = compiled(self._robot, (), scene, self._meshes)
        self._data = mujoco.MjData(self._model)
        self._read = None if self._positions is None else PositionsFile(self._positions, self._model.nq)
        self._has_tool = is_mounted(self._model)
        self._handles = [
            (
                shape.index,
                self._scene.add_mesh_simple(
                    f"{self._root}/world/{shape.index}", shape.vertices, shape.faces, color=shape.colour
                ),
            )
            for shape in drawn_shapes(self._model)
        ]

    def erase(self) -> None:
        """Draw arm and scene no more."""
        for _, handle in (*self._handles, *self._names):
            handle.remove()
        self._handles, self._names, self._held = [], [], {}
        self.carry(())

    def have(self, scene: str, placed: tuple[WorldBody, ...]) -> None:
        """Draw the scene of a program, if there is none of its own, and put its free bodies where the program has them.

        Nothing is put where a simulator reports where it is.

        Args:
            scene: its file; "": none.
            placed: free bodies of that scene.
        """
        if not self._is_own and scene != self._text:
            self._text = scene
            is_named = bool(self._names)
            self._draw(Scene.of(scene) if scene else None)
            self.name_bodies(visible=is_named)
        self._held = {}
        names = {plain(str(self._model.body(body).name)): body for body in self._standing}
        for body in placed:
            joint = int(self._model.body_jntadr[names[body.name]]) if body.name in names else -1
            if joint < 0 or self._model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_FREE:
                continue
            address = int(self._model.jnt_qposadr[joint])
            if body.is_held:
                self._held[address] = body.pose
            else:
                self._put(address, body.pose)

    def _put(self, address: int, pose: Pose) -> None:
        self._data.qpos[address : address + 3] = pose.xyz
        self._data.qpos[address + 3 : address + 7] = wxyz(pose)

    def carry(self, shapes: tuple[tuple[Shape, Pose], ...]) -> None:
        """Draw shapes on the flange, each at its pose in the flange frame, in place of those before.

        Where the scene has a tool on the flange, that one is drawn alone.
        """
        if self._has_tool or shapes == self._carried:
            return
        for handle in self._carried_handles:
            handle.remove()
        self._carried = shapes
        self._carried_handles = [
            self._scene.add_mesh_simple(
                f"{self._root}/flange/carried/{number}",
                *solid(int(GEOMS[shape.kind]), mujoco_size(shape.kind, shape.size)),
                color=_TOOL,
                position=pose.xyz,
                wxyz=wxyz(pose),
            )
            for number, (shape, pose) in enumerate(shapes)
        ]

    def show(self, q: Array) -> None:
        """Move the shapes to joint positions, shape (7,) [rad]; those of the scene to the simulator's."""
        everything = None if self._read is None else self._read.read()
        if everything is not None:
            self._data.qpos[:] = everything
        self._data.qpos[:7] = q
        mujoco.mj_kinematics(self._model, self._data)
        quat = np.zeros(4)
        if self._held and everything is None:
            at = self.flange
            mujoco.mju_mat2Quat(quat, at.xmat)
            carrier = Pose.of(at.xpos.copy(), np.roll(quat, -1))
            for address, pose in self._held.items():
                self._put(address, carrier @ pose)
            mujoco.mj_kinematics(self._model, self._data)
        for index, handle in self._handles:
            mujoco.mju_mat2Quat(quat, self._data.geom_xmat[index])
            handle.position, handle.wxyz = self._data.geom_xpos[index].copy(), quat.copy()
        for body, handle in self._names:
            handle.position = self._data.xpos[body].copy()
        flange = self.flange
        mujoco.mju_mat2Quat(quat, flange.xmat)
        self._flange.position, self._flange.wxyz = flange.xpos.copy(), quat.copy()

    @property
    def places(self) -> dict[str, Pose]:
        """Where the free bodies of the scene were shown last, in the base, by their names in the scene."""
        found = {}
        for body in self._standing:
            if self._model.body_jntnum[body]:
                w, x, y, z = self._data.xquat[body].tolist()
                name = plain(str(self._model.body(body).name))
                found[name] = Pose.of(self._data.xpos[body].copy(), (x, y, z, w))
        return found

    def name_bodies(self, *, visible: bool) -> None:
        """Draw the names of the bodies of the scene, or draw them no more."""
        for _, handle in self._names:
            handle.remove()
        self._names = []
        if visible:
            self._names = [
                (
                    body,
                    self._scene.add_label(
                        f"{self._root}/name/{body}",
                        plain(str(self._model.body(body).name)),
                        position=self._data.xpos[body].copy(),
                    ),
                )
                for body in self._standing
            ]

    @property
    def _standing(self) -> list[int]:
        """The bodies of the scene that stand by themselves, not on the arm."""
        model = self._model
        bases = [body for body in range(1, model.nbody) if not model.body_parentid[body]]
        return [body for body in bases if model.body(body).name.startswith(PREFIX)]

    @property
    def flange(self) -> Any:
        """MuJoCo's view of the flange, as it was shown last: `xpos` is its position in the base, shape (3,) [m]."""
        return self._data.site("flange")


class DrawnBodies:
    """What a program shows of its world, besides the scene: bodies with their names, and other arms.

    Args:
        server: a viser server.
        meshes: of the arms.
        root: node of viser's scene that is the base of the arm; it has a node `flange`.
    """

    def __init__(self, server: Any, meshes: ArmMeshes, root: str) -> None:
        self._server, self._meshes, self._root = server, meshes, root
        self._shown: WorldOutline | None = None
        self._bodies: dict[str, tuple[WorldBody, list[Any]]] = {}
        self._arms: dict[str, tuple[WorldArm, Any, DrawnWorld]] = {}
        self._drawn = 0

    def show(self, outline: WorldOutline | None) -> None:
        """Draw a world, in place of the one before; None: nothing."""
        if outline is self._shown:
            return
        self._shown = outline
        bodies = {} if outline is None else {body.name: body for body in outline.bodies}
        arms = {} if outline is None else {arm.name: arm for arm in outline.arms}
        for name in [
            name for name, (body, _) in self._bodies.items() if not _is_same(body, bodies.get(name))
        ]:
            for handle in reversed(self._bodies.pop(name)[1]):  # viser removes what is below a node with it
                handle.remove()
        for name, body in bodies.items():
            handles = self._bodies[name][1] if name in self._bodies else self._draw(body)
            handles[0].position, handles[0].wxyz = body.pose.xyz, wxyz(body.pose)
            self._bodies[name] = body, handles
        for name in [name for name, (arm, _, _) in self._arms.items() if not _is_same(arm, arms.get(name))]:
            _, node, drawn = self._arms.pop(name)
            drawn.erase()
            node.remove()
        for name, arm in arms.items():
            node, drawn = self._arms[name][1:] if name in self._arms else self._draw_arm(arm)
            node.position, node.wxyz = arm.pose.xyz, wxyz(arm.pose)
            drawn.show(arm.q)
            self._arms[name] = arm, node, drawn

    def _node(self, kind: str) -> str:
        self._drawn += 1  # a name may have characters that viser's paths have not
        return f"{self._root}/{kind}/{self._drawn}"

    def _draw(self, body: WorldBody) -> list[Any]:
        """The handles of a body, its frame first."""
        scene, node = self._server.scene, self._node("flange/held" if body.is_held else "added")
        red, green, blue, opacity = body.color
        colour = (round(255 * red), round(255 * green), round(255 * blue))
        handles = [scene.add_frame(node, show_axes=False)]
        for number, shape in enumerate(body.shapes):
            if isinstance(shape, Mesh):
                vertices, faces = shape.vertices, shape.faces
            else:
                vertices, faces = solid(int(GEOMS[shape.kind]), mujoco_size(shape.kind, shape.size))
            handles.append(
                scene.add_mesh_simple(
                    f"{node}/{number}",
                    vertices,
                    faces,
                    color=colour,
                    opacity=None if opacity == 1.0 else opacity,
                    position=shape.pose.xyz,
                    wxyz=wxyz(shape.pose),
                )
            )
        if len(body.points):
            handles.append(
                scene.add_point_cloud(
                    f"{node}/points",
                    body.points.astype(np.float32),
                    colour,
                    point_size=2.0 * body.radius,
                    point_shape="circle",
                )
            )
        middle = body.points.mean(axis=0) if len(body.points) else (0.0, 0.0, 0.0)
        handles.append(scene.add_label(f"{node}/name", body.name, position=middle))
        return handles

    def _draw_arm(self, arm: WorldArm) -> tuple[Any, DrawnWorld]:
        root = self._node("arm")
        node = self._server.scene.add_frame(root, show_axes=False)
        drawn = DrawnWorld(self._server, arm.robot, meshes=self._meshes, root=root)
        drawn.carry(tuple((shape, shape.pose) for shape in arm.shapes))
        self._server.scene.add_label(f"{root}/name", arm.name)
        return node, drawn


def _is_same(before: WorldBody | WorldArm, now: WorldBody | WorldArm | None) -> bool:
    """Whether something is what it was, but for its place."""
    if isinstance(before, WorldArm):
        return isinstance(now, WorldArm) and replace(now, pose=before.pose, q=before.q) == before
    return isinstance(now, WorldBody) and replace(now, pose=before.pose) == before


class DrawnGhost:
    """A plan in viser: a translucent arm that moves along it, its path, and where bodies would touch.

    Args:
        server: a viser server.
        model: "iiwa7", "iiwa14", "med7" or "med14".
        meshes: of the arm.
        root: node of viser's scene that is the base of the arm.
    """

    def __init__(self, server: Any, model: str, meshes: ArmMeshes, root: str) -> None:
        self._scene, self._root = server.scene, f"{root}/plan"
        self._model = compiled(model, (), None, meshes)
        self._data = mujoco.MjData(self._model)
        self._plan: PlanOutline | None = None
        self._shapes: list[tuple[int, Any]] = []
        self._lines: list[Any] = []

    def show(self, plan: PlanOutline | None, t: float) -> None:
        """Move the ghost to a time of a plan [s]; None: hide it."""
        if plan is not self._plan:
            self._plan = plan
            self._draw_path(plan)
            for _, handle in self._shapes:
                handle.visible = plan is not None
        if plan is None:
            return
        if not self._shapes:
            self._shapes = [(shape.index, self._translucent(shape)) for shape in drawn_shapes(self._model)]
        self._data.qpos[:7] = [np.interp(t, plan.t, column) for column in plan.q.T]
        mujoco.mj_kinematics(self._model, self._data)
        quat = np.zeros(4)
        for index, handle in self._shapes:
            mujoco.mju_mat2Quat(quat, self._data.geom_xmat[index])
            handle.position, handle.wxyz = self._data.geom_xpos[index].copy(), quat.copy()

    def _translucent(self, shape: DrawnShape) -> Any:
        node = f"{self._root}/{shape.index}"
        return self._scene.add_mesh_simple(node, shape.vertices, shape.faces, color=_GHOST, opacity=0.35)

    def _draw_path(self, plan: PlanOutline | None) -> None:
        for handle in self._lines:
            handle.remove()
        self._lines = []
        if plan is None or len(plan.path) < 2:
            return
        segments = np.stack([plan.path[:-1], plan.path[1:]], axis=1).astype(np.float32)
        self._lines.append(
            self._scene.add_line_segments(
                f"{self._root}/path", segments, _GHOST, thickness=3.0, thickness_units="screen"
            )
        )
        for number, t in enumerate(plan.touches):
            place = np.array([np.interp(t, plan.t, column) for column in plan.path.T])
            node = f"{self._root}/touch{number}"
            self._lines.append(self._scene.add_icosphere(node, radius=0.02, color=_TOUCH, position=place))


class DrawnMarks:
    """What is drawn besides the bodies of one arm, in viser, in the base frame.

    Args:
        server: a viser server.
        root: node of viser's scene that is the base of the arm; empty: the world.
    """

    def __init__(self, server: Any, root: str = "") -> None:
        self._scene, self._root = server.scene, root
        self._tcp = self._scene.add_frame(f"{root}/tcp", axes_length=0.10, axes_radius=0.003)
        self._target = self._scene.add_frame(
            f"{root}/target", axes_length=0.08, axes_radius=0.002, visible=False
        )
        self._trail = self._scene.add_line_segments(
            f"{root}/trail", _NOTHING, _TRAIL, thickness=2.5, thickness_units="screen"
        )
        self._tool = self._scene.add_line_segments(
            f"{root}/tool", _NOTHING, _TOOL, thickness=0.012, visible=False
        )
        self._force = self._scene.add_arrows(
            f"{root}/force",
            _NOTHING,
            _ACCENT,
            shaft_radius=0.006,
            head_radius=0.016,
            head_length=0.04,
            visible=False,
        )
        self._named: dict[str, tuple[Any, ...]] = {}
        self._places: dict[str, Pose] = {}
        self._drawn = 0

    def show(self, tcp: Pose, flange: Array, force: Array | None) -> None:
        """Move the motion frame, the line to it from the flange, and the arrow of the contact.

        Args:
            tcp: pose of the motion frame in the base.
            flange: position of the flange in the base, shape (3,) [m].
            force: external force on the robot in the base axes, shape (3,) [N]; None: it is not known.
        """
        self._tcp.position, self._tcp.wxyz = tcp.xyz, wxyz(tcp)
        has_tool = float(np.linalg.norm(tcp.xyz - flange)) > _NO_TOOL
        if has_tool:
            self._tool.points = np.array([[flange, tcp.xyz]], np.float32)
        self._tool.visible = has_tool
        size = 0.0 if force is None else float(np.linalg.norm(force))
        is_felt = size > _LEAST_FORCE
        if force is not None and is_felt:
            along = force / size * min(_ARROW_SCALE * size, _LONGEST_ARROW)
            self._force.points = np.array([[tcp.xyz, tcp.xyz + along]], np.float32)
        self._force.visible = is_felt

    def show_target(self, pose: Pose | None) -> None:
        """Show where the arm is going; None: nowhere."""
        if pose is not None:
            self._target.position, self._target.wxyz = pose.xyz, wxyz(pose)
        self._target.visible = pose is not None

    def show_trail(self, path: Array) -> None:
        """Draw the path driven: positions in the base, shape (n, 3) [m]."""
        self._trail.points = (
            _NOTHING if len(path) < 2 else np.stack([path[:-1], path[1:]], axis=1).astype(np.float32)
        )

    def show_places(self, kind: str, places: Mapping[str, Pose]) -> None:
        """Draw named frames, such as "frames" or "points", in place of those of the same kind."""
        wanted = {f"{kind}/{name}": pose for name, pose in places.items()}
        for name in [place for place in self._places if place.startswith(f"{kind}/") and place not in wanted]:
            self._erase(name)
            del self._places[name]
        for name, pose in wanted.items():
            if self._places.get(name) == pose:
                continue
            self._erase(name)
            self._drawn += 1
            node = (
                f"{self._root}/{kind}/{self._drawn}"  # a name may have characters that viser's paths have not
            )
            self._places[name] = pose
            self._named[name] = (
                self._scene.add_frame(
                    node, axes_length=0.05, axes_radius=0.0018, position=pose.xyz, wxyz=wxyz(pose)
                ),
                self._scene.add_label(f"{node}/label", name.partition("/")[2], anchor="bottom-left"),
            )

    def _erase(self, name: str) -> None:
        """Remove a named frame, its label first: viser removes what is below a node with it."""
        for handle in reversed(self._named.pop(name, ())):
            handle.remove()
