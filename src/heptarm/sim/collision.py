"""Collisions foreseen: which bodies of arm, tool and scene touch at joint positions, or along a joint path.

The shapes and the rules of who can touch whom are those of the simulator: MuJoCo's. It is an aid for programs, not a
safety function: it knows only what its scene contains.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, ShapeError, require
from heptarm.values.checks import Array, array, finite_entries, instance, numbers, shown, within
from heptarm.values.clearance import Clearance, TouchOnPath
from heptarm.values.pose import Pose, check_pose
from heptarm.values.sealed import Sealed
from heptarm.values.tool import KnownTool, Tool, Workpiece

if TYPE_CHECKING:
    from heptarm.sim.plant.carried import CarriedShapes
    from heptarm.sim.plant.scene import Scene
    from heptarm.sim.plant.world import Box

#: Default of the distance below which two bodies count as touching [m].
MARGIN = 0.005
#: Default of the distance up to which clearances are reported [m].
NEAR = 0.1
#: Default of the largest movement of a joint between two checks on a path [rad].
STEP = 0.02
#: Compiled models that are kept, one for each tool and workpiece that was carried lately.
_MOST_KEPT = 8


class CollisionModel(Sealed):
    """The collision model of an arm, its tool and its scene; needs `pip install 'heptarm[sim]'`.

    It reads joint positions and nothing else, so it serves a robot as well as a simulator. Bodies of the scene stay
    where its file has them, unless you `place` or `hold` them.

    A gripper counts as open, as wide as it gets.

    Args:
        robot: name of the robot, such as "iiwa14".
        scene: a ready scene by its name, or a file in MuJoCo's format; "": none. See docs/guide/scenes.md.
        boxes: fixed boxes, each "X,Y,Z,LENGTH,WIDTH,HEIGHT": centre and edges in the base [m].
        margin: bodies nearer than this count as touching [m], 0 to 0.1. A path is checked at points, so let it cover
            what is between them.
        allowed: pairs of names of bodies that may touch, such as ("tool", "table").

    Raises:
        CommandRejected: no such robot or scene, or the file is not in MuJoCo's format.
        MissingExtra: MuJoCo is not installed.
    """

    def __init__(
        self,
        robot: str,
        *,
        scene: str = "",
        boxes: Sequence[str] = (),
        margin: float = MARGIN,
        allowed: Iterable[tuple[str, str]] = (),
    ) -> None:
        instance(robot, str, "robot")
        instance(scene, str, "scene")
        texts = [instance(text, str, "boxes") for text in _listed(boxes, "boxes")]
        pairs = [tuple(_listed(pair, "allowed")) for pair in _listed(allowed, "allowed")]
        if any(len(pair) != 2 or not all(isinstance(name, str) for name in pair) for pair in pairs):
            raise ShapeError(
                f"allowed must be pairs of names of bodies, got {shown(allowed)}",
                parameter="allowed",
                value=allowed,
                hint='for example [("tool", "table")]',
            )
        self._mujoco: Any = require("mujoco", extra="sim")
        from heptarm.sim.plant.scene import Scene
        from heptarm.sim.plant.world import Box
        from heptarm.values.robot import robot as known

        known(robot)
        try:
            made = [Box.of(text) for text in texts]
            self._models = _Models(robot, made, Scene.of(scene) if scene else None)
            self._load(self._models.carrying(()))
        except ValueError as error:
            if isinstance(error, CommandRejected):
                raise
            raise CommandRejected(str(error), parameter="scene" if scene else "boxes") from None
        self._margin = within(margin, "margin", 0.0, 0.1, unit="m")
        self._allowed = {frozenset(pair) for pair in pairs}
        self._held: dict[str, Pose] = {}  # by body: its pose in the flange frame

    def _load(self, model: Any) -> None:
        """Take a model; its positions are the initial ones."""
        from heptarm.sim.plant.gripper import driven_joints, has_gripper

        mujoco = self._mujoco
        self._model, self._data = model, mujoco.MjData(model)
        if has_gripper(model):  # open, which is where it needs most room
            for joint in driven_joints(model):
                self._data.qpos[model.jnt_qposadr[joint]] = model.jnt_range[joint, 1]
        self._flange = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, "flange"))
        root = model.body("link_0").id  # the arm and what is mounted on it are of the tree of the base
        self._is_own = [int(model.body_rootid[body]) == root for body in range(model.nbody)]
        names = [str(model.body(body).name) for body in range(model.nbody)]
        self._names = [_plain(name) for name in names]
        self._is_tool = [name != plain for name, plain in zip(names, self._names, strict=True)]
        self._free_at = {
            self._names[int(model.jnt_bodyid[joint])]: int(model.jnt_qposadr[joint])
            for joint in range(model.njnt)
            if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
        }

    @property
    def margin(self) -> float:
        """Bodies nearer than this count as touching [m]."""
        return self._margin

    @property
    def allowed(self) -> frozenset[frozenset[str]]:
        """Pairs of names of bodies that may touch."""
        return frozenset(self._allowed)

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of all bodies: of the arm, its tool and the scene."""
        return tuple(self._names[1:])

    # --------------------------------------------------------------------------------- the world

    def place(self, body: str, pose: Pose) -> None:
        """Put a free body of the scene somewhere: its pose in the base.

        Raises:
            CommandRejected: the scene has no free body of that name.
        """
        address = self._free(body)
        check_pose(pose)
        self._held.pop(body, None)
        self._put(address, pose)

    def hold(self, body: str, pose: Pose) -> None:
        """Let the arm hold a free body of the scene: from now on it moves with the flange, and may touch the tool.

        Args:
            body: its name.
            pose: of the body in the flange frame, such as `flange.inverse() @ where_it_was_grasped`.

        Raises:
            CommandRejected: the scene has no free body of that name.
        """
        self._free(body)
        check_pose(pose)
        self._held[body] = pose

    def release(self, body: str) -> None:
        """Let the arm hold a body no more; it stays where it was in the last check. See `place`.

        Raises:
            CommandRejected: the scene has no free body of that name.
        """
        self._free(body)
        self._held.pop(body, None)

    def carrying(
        self,
        tool: Tool | KnownTool | None,
        workpiece: Workpiece | KnownTool | None = None,
        *,
        at: Pose | None = None,
    ) -> CollisionModel:
        """The same model, with the scene as it is now, of an arm that carries a tool and a workpiece.

        Their shapes are bodies with their names, mounted on the flange. They, the flange and the link before it count
        as neighbours. Where the scene has a tool of its own, that one is on the flange, and the shapes of `tool` are
        not used. An arm does this by itself with what is attached to it.

        Args:
            tool: the tool; None: none.
            workpiece: what it holds; None: nothing.
            at: pose in the flange frame of the frame that holds the workpiece; None: the tool's tcp.

        Raises:
            ShapeError: wrong types.
        """
        if tool is not None:
            instance(tool, (Tool, KnownTool), "tool")
        if workpiece is not None:
            instance(workpiece, (Workpiece, KnownTool), "workpiece")
        if at is not None:
            check_pose(at, "at")
        view = copy(self)
        view._held = dict(self._held)
        view._load(self._models.carrying(_carried(tool, workpiece, at)))
        for name, address in self._free_at.items():
            pose = self._data.qpos[address : address + 7]
            view._data.qpos[view._free_at[name] : view._free_at[name] + 7] = pose
        return view

    def _free(self, name: str) -> int:
        """Where the pose of a free body is in qpos."""
        instance(name, str, "body")
        if name not in self._free_at:
            listed = ", ".join(self._free_at) or "none"
            raise CommandRejected(
                f"body must be a free body of the scene, one of {listed}; got {shown(name)}",
                parameter="body",
                value=name,
                allowed=listed,
            )
        return self._free_at[name]

    def _put(self, address: int, pose: Pose) -> None:
        self._data.qpos[address : address + 3] = pose.xyz
        self._data.qpos[address + 3 : address + 7] = np.roll(pose.quat, 1)

    # ------------------------------------------------------------------------------------ checks

    def clearances(self, q: npt.ArrayLike, *, below: float = NEAR) -> tuple[Clearance, ...]:
        """Pairs of bodies that are near each other at joint positions, the nearest first.

        At least one body of a pair is of the arm, its tool or what it holds. Neighbouring links, and pairs that cannot
        touch by the rules of the scene, are left out.

        Args:
            q: joint positions, shape (7,) [rad].
            below: largest distance [m], 0 to 1.

        Raises:
            ShapeError: not seven numbers.
        """
        return self._clearances(array(q, 7, "q"), within(below, "below", 0.0, 1.0, unit="m"))

    def touching(self, q: npt.ArrayLike) -> tuple[Clearance, ...]:
        """Pairs of bodies that touch at joint positions: nearer than `margin`, and not allowed to; as `clearances`."""
        return tuple(
            one
            for one in self._clearances(array(q, 7, "q"), self._margin)
            if frozenset((one.first, one.second)) not in self._allowed
        )

    def first_on(self, path: npt.ArrayLike, *, step: float = STEP) -> TouchOnPath | None:
        """The first place on a joint path at which two bodies touch.

        Pairs that touch at its start already do not count while they do not get nearer: so the arm can leave a contact.

        Args:
            path: joint positions, straight from one to the next, shape (n, 7) [rad].
            step: largest movement of a joint between two checks [rad], 1e-4 to 0.5. At 0.8 m from an axis, 0.02 rad are
                16 mm.

        Returns:
            The place and the nearest pair there; None: nothing touches.

        Raises:
            ShapeError: no path.
        """
        points = finite_entries(numbers(path, "path", "joint positions of shape (n, 7)"), "path")
        if points.ndim != 2 or points.shape[1] != 7 or not len(points):
            raise ShapeError(
                f"path must be joint positions of shape (n, 7), got shape {points.shape}",
                parameter="path",
                hint="for example [[0, 0.5, 0, -1.5, 0, 1, 0], [0.3, 0.5, 0, -1.5, 0, 1, 0]]",
            )
        moves = np.abs(np.diff(points, axis=0)).max(axis=1) if len(points) > 1 else np.zeros(0)
        length = float(moves.sum()) or 1.0
        size = within(step, "step", 1e-4, 0.5, unit="rad")
        start = {(one.first, one.second): one.distance for one in self.touching(points[0])}
        done = 0.0
        for first, last, move in zip(points[:-1], points[1:], moves.tolist()):
            count = max(1, int(np.ceil(move / size)))
            for number in range(1, count + 1):
                q = first + number / count * (last - first)
                found = self._new(q, start)
                if found is not None:
                    return TouchOnPath(found, (done + number / count * move) / length, q)
            done += move
        return None

    def _new(self, q: Array, start: dict[tuple[str, str], float]) -> Clearance | None:
        """The nearest pair that touches at joint positions and did not at the start, or is nearer now."""
        now = self.touching(q)
        present = {(one.first, one.second) for one in now}
        for pair in [pair for pair in start if pair not in present]:
            del start[pair]  # it has been left: from now on it counts
        for one in now:
            before = start.get((one.first, one.second))
            if before is None or one.distance < before - _NEARER:
                return one
        return None

    def _clearances(self, q: Array, below: float) -> tuple[Clearance, ...]:
        model, data, mujoco = self._model, self._data, self._mujoco
        model.geom_margin[:] = model.body_margin[:] = below  # of the narrow and of the broad phase
        data.qpos[:7] = q
        mujoco.mj_kinematics(model, data)
        if self._held:
            at = Pose.of(data.site_xpos[self._flange], _quaternion(mujoco, data.site_xmat[self._flange]))
            for name, pose in self._held.items():
                self._put(self._free_at[name], at @ pose)
            mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_collision(model, data)
        nearest: dict[tuple[str, str], float] = {}
        for geom_pair, distance in zip(data.contact.geom[: data.ncon], data.contact.dist[: data.ncon]):
            pair = self._pair(*geom_pair.tolist())
            if pair is not None and distance <= below:
                nearest[pair] = min(nearest.get(pair, np.inf), float(distance))
        found = [Clearance(*pair, distance) for pair, distance in nearest.items()]
        return tuple(sorted(found, key=lambda one: one.distance))

    def _pair(self, first: int, second: int) -> tuple[str, str] | None:
        """Names of two shapes' bodies, that of the arm first; None if none is of the arm, its tool or what it holds."""
        bodies = int(self._model.geom_bodyid[first]), int(self._model.geom_bodyid[second])
        arm = [self._is_own[body] for body in bodies]
        held = [self._names[body] in self._held and not own for own, body in zip(arm, bodies)]
        if not any(arm) and not any(held):
            return None
        if any(held) and any(own and self._is_tool[body] for own, body in zip(arm, bodies)):
            return None  # the gripper touches what it holds
        names = self._name(first), self._name(second)
        if all(arm):
            return (min(names), max(names))
        is_first = arm[0] or (held[0] and not arm[1])
        return names if is_first else (names[1], names[0])

    def _name(self, geom: int) -> str:
        """Name of the body of a shape; of a shape without a body its own."""
        body = int(self._model.geom_bodyid[geom])
        return (self._names[body] if body else _plain(self._model.geom(geom).name)) or "world"


class _Models:
    """MuJoCo's models of one arm in one scene, by what the arm carries.

    Args:
        robot: its name.
        boxes: fixed boxes around it.
        scene: what else is around it; None: nothing.
    """

    def __init__(self, robot: str, boxes: list[Box], scene: Scene | None) -> None:
        self._robot, self._boxes, self._scene = robot, boxes, scene
        self._made: dict[tuple[CarriedShapes, ...], Any] = {}

    def carrying(self, carried: tuple[CarriedShapes, ...]) -> Any:
        """The model of an arm that carries shapes; the last ones are kept."""
        from heptarm.sim.plant.world import compiled

        model = self._made.pop(carried, None)
        if model is None:
            model = compiled(self._robot, self._boxes, self._scene, carried=carried)
        self._made[carried] = model
        for oldest in list(self._made)[:-_MOST_KEPT]:
            del self._made[oldest]
        return model


def _carried(
    tool: Tool | KnownTool | None, workpiece: Workpiece | KnownTool | None, at: Pose | None
) -> tuple[CarriedShapes, ...]:
    """The shapes of a tool and of what it holds, as they are on the flange."""
    from heptarm.sim.plant.carried import CarriedShapes

    origin = Pose.of((0.0, 0.0, 0.0))
    found = [] if tool is None else [CarriedShapes(tool.name, tool.shapes, origin, is_tool=True)]
    if workpiece is not None:
        tip = tool.frames[0][1] if tool is not None and tool.frames else origin
        found.append(CarriedShapes(workpiece.name, workpiece.shapes, tip if at is None else at))
    return tuple(one for one in found if one.shapes)


def _plain(name: str) -> str:
    from heptarm.sim.plant.carried import plain

    return plain(name)


#: A pair that touches at the start of a path may get so much nearer, by rounding [m].
_NEARER = 1e-4


def _listed(values: object, name: str) -> list[Any]:
    """The entries of what is a list, a tuple or another iterable, but no text.

    Raises:
        ShapeError: it is something else.
    """
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise ShapeError(f"{name} must be a list, got {shown(values)}", parameter=name, value=values)
    return list(values)


def _quaternion(mujoco: Any, matrix: Array) -> Array:
    """Quaternion x y z w of MuJoCo's rotation matrix, shape (4,)."""
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, matrix)
    return np.roll(quat, -1)
