"""Collisions foreseen: which bodies of arm, tool and scene touch at joint positions, or along a joint path.

The shapes and the rules of who can touch whom are those of the simulator: MuJoCo's. It is an aid for programs, not a
safety function: it knows only what its scene contains.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError, ShapeError, require
from heptarm.values.checks import Array, array, finite_entries, instance, numbers, shown, within
from heptarm.values.clearance import Clearance, TouchOnPath
from heptarm.values.mesh import Mesh
from heptarm.values.pose import Pose, check_pose
from heptarm.values.robot import RobotModel
from heptarm.values.robot import robot as known
from heptarm.values.sealed import Sealed
from heptarm.values.shape import ORIGIN, Shape
from heptarm.values.tool import KnownTool, Tool, Workpiece

if TYPE_CHECKING:
    from heptarm.sim.distances import Distances
    from heptarm.sim.plant.carried import CarriedShapes
    from heptarm.sim.plant.obstacles import Obstacle
    from heptarm.sim.plant.scene import Scene
    from heptarm.sim.plant.world import Box

#: Default of the distance below which two bodies count as touching [m].
MARGIN = 0.005
#: Default of the distance up to which clearances are reported [m].
NEAR = 0.1
#: Default of what counts as occupied around a point of a cloud [m].
POINT_RADIUS = 0.01
#: Bodies on a path may be nearer than a margin of 0 between two checks, by half of this [m].
_LEAST_MARGIN = 1e-3
#: Farther bodies are not looked for on a path: that takes longer than shorter steps [m].
_FAR = 0.05
#: Most spheres of a cloud.
_MOST_SPHERES = 5000
#: Compiled models that are kept, one for each tool and workpiece that was carried lately.
_MOST_KEPT = 8


class CollisionModel(Sealed):
    """The collision model of an arm, its tool and its scene; needs `pip install 'heptarm[sim]'`.

    It reads joint positions and nothing else, so it serves a robot as well as a simulator. Bodies of the scene stay
    where its file has them, unless you `place` or `hold` them; others can be added and removed while a program runs.

    A gripper counts as open, as wide as it gets.

    Args:
        robot: name of the robot, such as "iiwa14".
        scene: a ready scene by its name, or a file in MuJoCo's format; "": none. See docs/guide/scenes.md.
        boxes: fixed boxes, each "X,Y,Z,LENGTH,WIDTH,HEIGHT": centre and edges in the base [m].
        margin: bodies nearer than this count as touching [m], 0 to 0.1.
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
        require("mujoco", extra="sim")
        from heptarm.sim.plant.scene import Scene
        from heptarm.sim.plant.world import Box

        self._robot = known(robot)
        self._margin = within(margin, "margin", 0.0, 0.1, unit="m")
        self._allowed = frozenset(frozenset(pair) for pair in pairs)
        self._held: dict[str, Pose] = {}  # by body: its pose in the flange frame
        self._added: dict[str, Obstacle] = {}
        self._carried: tuple[CarriedShapes, ...] = ()
        try:
            made = [Box.of(text) for text in texts]
            self._models = _Models(robot, made, Scene.of(scene) if scene else None)
            self._distances = self._compiled()
        except ValueError as error:
            if isinstance(error, CommandRejected):
                raise
            raise CommandRejected(str(error), parameter="scene" if scene else "boxes") from None

    def _compiled(self, before: Distances | None = None) -> Distances:
        """The distances of the present world; free bodies are where they were before."""
        from heptarm.sim.distances import Distances

        model = self._models.carrying(self._carried, tuple(self._added.values()))
        made = Distances(model, self._allowed)
        if before is not None:
            for name in made.free:
                if name in before.free:
                    made.put(name, before.place_of(name))
        made.hold(self._held)
        return made

    @property
    def robot(self) -> RobotModel:
        """The robot and its limits."""
        return self._robot

    @property
    def margin(self) -> float:
        """Bodies nearer than this count as touching [m]."""
        return self._margin

    @property
    def allowed(self) -> frozenset[frozenset[str]]:
        """Pairs of names of bodies that may touch."""
        return self._allowed

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of all bodies: of the arm, its tool and the scene."""
        return self._distances.names

    @property
    def checks(self) -> int:
        """Postures whose distances were computed since the world was changed last."""
        return self._distances.checks

    # --------------------------------------------------------------------------------- the world

    def add(self, name: str, shape: Shape | Mesh | Sequence[Shape | Mesh], *, at: Pose = ORIGIN) -> None:
        """Add a body to the world. It can be placed, held and removed.

        Args:
            name: of the body, of which there is none yet.
            shape: one of `heptarm.shapes`, or several that are one body: `box`, `sphere`, `cylinder`, `capsule`,
                `mesh`, `height_map`.
            at: pose of its frame in the base.

        Raises:
            ShapeError: wrong types.
            CommandRejected: there is a body of that name, or it would be inside the base of the arm, which never moves.
        """
        given = (shape,) if isinstance(shape, Shape | Mesh) else _listed(shape, "shape")
        if not given:
            raise ShapeError("shape must have at least one shape, got none", parameter="shape", value=shape)
        parts: tuple[Shape | Mesh, ...] = tuple(instance(one, (Shape, Mesh), "shape") for one in given)
        self._add(name, parts, np.zeros((0, 3)), 0.0, at)

    def add_points(
        self, cloud: npt.ArrayLike, *, radius: float = POINT_RADIUS, name: str = "points", at: Pose = ORIGIN
    ) -> None:
        """Add a cloud of points, such as of a depth camera, as one body. Points nearer than `radius` become one sphere.

        Args:
            cloud: points, shape (n, 3) [m].
            radius: distance from each point that counts as occupied [m], 0.001 to 0.5.
            name: of the body, of which there is none yet.
            at: pose of the cloud's frame, such as of the camera, in the base.

        Raises:
            ShapeError: not points of shape (n, 3), or none.
            LimitError: a point that is not finite, a radius outside its range, or more than 5000 spheres.
            CommandRejected: as in `add`.
        """
        from heptarm.sim.plant.obstacles import merged

        points = finite_entries(numbers(cloud, "cloud", "points of shape (n, 3)"), "cloud")
        if points.ndim != 2 or points.shape[1] != 3 or not len(points):
            raise ShapeError(
                f"cloud must be points of shape (n, 3), got shape {points.shape}", parameter="cloud"
            )
        size = within(radius, "radius", 1e-3, 0.5, unit="m")
        centres, covering = merged(points, size)
        if len(centres) > _MOST_SPHERES:
            raise LimitError(
                f"a cloud must have at most {_MOST_SPHERES} points that are {size:g} m apart, got {len(centres)}",
                code=2,
                parameter="cloud",
                value=len(centres),
                hint="give a larger radius, or leave out what the arm cannot reach",
            )
        self._add(name, (), centres, covering, at)

    def _add(
        self, name: str, parts: tuple[Shape | Mesh, ...], points: Array, radius: float, at: Pose
    ) -> None:
        from heptarm.sim.plant.obstacles import Obstacle

        instance(name, str, "name")
        check_pose(at, "at")
        if not name or "/" in name or name in ("world", *self._distances.names):
            raise CommandRejected(
                f"name must be a new name without a slash, got {shown(name)}",
                parameter="name",
                value=name,
                hint="remove the body of that name first, or place it: bodies are listed in `bodies`",
            )
        self._added[name] = Obstacle(name, parts, at, points, radius)
        try:
            made = self._compiled(self._distances)
            self._check_base(made, name)
        except ValueError as error:
            del self._added[name]
            if isinstance(error, CommandRejected):
                raise
            raise CommandRejected(f"{name} is no body: {error}", parameter="shape", value=name) from None
        self._distances = made

    def _check_base(self, made: Distances, name: str) -> None:
        """Refuse a body inside the base of the arm.

        Raises:
            CommandRejected: it is inside.
        """
        geoms, distances = made.pairs(np.zeros(7), 0.0)
        for pair, distance in zip(geoms.tolist(), distances.tolist()):
            names = made.named(*pair)
            if names == ("link_0", name) and distance < 0.0:
                raise CommandRejected(
                    f"{name} would be {-distance * 1e3:.0f} mm inside link_0, the base of the arm, which never moves",
                    parameter="at",
                    value=name,
                    hint="give its pose in the base of the arm [m], or leave out the points on the arm itself",
                )

    def remove(self, body: str) -> None:
        """Remove a body that was added.

        Raises:
            CommandRejected: no body of that name was added.
        """
        instance(body, str, "body")
        if body not in self._added:
            raise _unknown(body, tuple(self._added), "a body that was added")
        del self._added[body]
        self._held.pop(body, None)
        self._distances = self._compiled(self._distances)

    def place(self, body: str, pose: Pose) -> None:
        """Put a free body of the scene, or one that was added, somewhere: its pose in the base.

        Raises:
            CommandRejected: there is no free body of that name.
        """
        self._check_free(body)
        check_pose(pose)
        if self._held.pop(body, None) is not None:
            self._distances.hold(self._held)
        self._distances.put(body, pose)

    def hold(self, body: str, pose: Pose) -> None:
        """Let the arm hold a free body: from now on it moves with the flange, and may touch the tool.

        Args:
            body: its name.
            pose: of the body in the flange frame, such as `flange.inverse() @ where_it_was_grasped`.

        Raises:
            CommandRejected: there is no free body of that name.
        """
        self._check_free(body)
        check_pose(pose)
        self._held[body] = pose
        self._distances.hold(self._held)

    def release(self, body: str) -> None:
        """Let the arm hold a body no more; it stays where it was in the last check. See `place`.

        Raises:
            CommandRejected: there is no free body of that name.
        """
        self._check_free(body)
        self._held.pop(body, None)
        self._distances.hold(self._held)

    def carrying(
        self,
        tool: Tool | KnownTool | None,
        workpiece: Workpiece | KnownTool | None = None,
        *,
        at: Pose | None = None,
    ) -> CollisionModel:
        """The same model, with the world as it is now, of an arm that carries a tool and a workpiece.

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
        view._held, view._added = dict(self._held), dict(self._added)
        view._carried = _carried(tool, workpiece, at)
        view._distances = view._compiled(self._distances)
        return view

    def _check_free(self, name: str) -> None:
        instance(name, str, "body")
        if name not in self._distances.free:
            raise _unknown(name, self._distances.free, "a free body of the scene")

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

    def distances(self, q: npt.ArrayLike, *, below: float = NEAR) -> Array:
        """Distance of the nearest two bodies at each of many joint positions; pairs that may touch do not count.

        Args:
            q: joint positions, shape (n, 7) [rad].
            below: largest distance that is computed [m], 0 to 1. A smaller one is faster.

        Returns:
            Shape (n,) [m]; infinite where nothing is nearer than `below`. See `touching` for the names.

        Raises:
            ShapeError: another shape.
        """
        rows, bound = _rows(q, "q"), within(below, "below", 0.0, 1.0, unit="m")
        return self._distances.nearest(rows, bound)

    def first_on(self, path: npt.ArrayLike) -> TouchOnPath | None:
        """The first place on a joint path at which two bodies touch.

        Bodies are not checked at fixed steps: from where the nearest two are a distance d apart, the arm may move on
        until one of its points could have moved by d plus `margin` (conservative advancement, Mirtich 1996). So bodies
        that are apart by `margin` wherever they are checked never meet between two checks, however thin they are.

        Pairs that touch at its start already do not count while they do not get nearer: so the arm can leave a contact.

        Args:
            path: joint positions, straight from one to the next, shape (n, 7) [rad].

        Returns:
            The place and the nearest pair there; None: nothing touches.

        Raises:
            ShapeError: no path.
        """
        points, margin = _rows(path, "path"), self._margin
        known: dict[tuple[str, str], float] = {}
        if self._distances.nearest(points[:1], margin)[0] < margin:
            known = {(one.first, one.second): one.distance for one in self.touching(points[0])}
        piece, at = 0, 0.0
        while known and piece < len(points) - 1:
            at, found = self._leave(points[piece], points[piece + 1], known)
            if found is not None:
                q = points[piece] + at * (points[piece + 1] - points[piece])
                return TouchOnPath(found, _place(points, piece, at), q)
            piece, at = (piece + 1, 0.0) if known else (piece, at)
        if piece >= len(points) - 1:
            return None
        here = points[piece] + at * (points[piece + 1] - points[piece])
        touch = self._distances.first(np.vstack([here, points[piece + 1 :]]), **self._steps)
        if touch is None:
            return None
        further, fraction, q = touch
        at = fraction if further else at + fraction * (1.0 - at)
        return TouchOnPath(self.touching(q)[0], _place(points, piece + further, at), q)

    def is_free(self, first: Array, last: Array) -> bool:
        """Whether nothing touches on a straight joint path: as `first_on`, and faster where something does.

        Args:
            first: joint positions at its beginning, shape (7,) [rad].
            last: likewise at its end.

        Raises:
            ShapeError: not seven numbers.
        """
        line = np.array([first, last], float)
        if line.shape != (2, 7) or not isfinite(line.sum()):
            array(first, 7, "first")
            array(last, 7, "last")
        free = self._distances.is_free(line, **self._steps)
        # a pair that touches at the beginning may be left
        return self.first_on(line) is None if free is None else free

    @property
    def _steps(self) -> dict[str, float]:
        """Margin and steps on a path, see `Distances.first`."""
        return {
            "margin": self._margin,
            "least": max(self._margin, _LEAST_MARGIN),
            "far": max(_FAR, self._margin),
        }

    def _leave(
        self, first: Array, last: Array, known: dict[tuple[str, str], float]
    ) -> tuple[float, Clearance | None]:
        """Move on along a straight joint path while pairs touch that did at its start, or to its end.

        Args:
            first: joint positions at its beginning.
            last: likewise at its end.
            known: pairs that touch there, and may while they do not get nearer; what is left is taken out.

        Returns:
            The fraction at which it ends, and the pair that may not touch there; None: there is none.
        """
        change, at = last - first, 0.0
        moved, least = self._distances.moved(change), max(self._margin, _LEAST_MARGIN)
        while known and at < 1.0:
            at = min(1.0, at + (self._margin + least) / max(moved, least))
            found = self._new(first + at * change, known)
            if found is not None:
                return at, found
        return at, None

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
        nearest: dict[tuple[str, str], float] = {}
        geoms, distances = self._distances.pairs(q, below)
        for pair, distance in zip(geoms.tolist(), distances.tolist()):
            names = self._distances.named(*pair)
            nearest[names] = min(nearest.get(names, np.inf), distance)
        found = [Clearance(*names, distance) for names, distance in nearest.items()]
        return tuple(sorted(found, key=lambda one: one.distance))


class _Models:
    """MuJoCo's models of one arm in one scene, by what the arm carries.

    Args:
        robot: its name.
        boxes: fixed boxes around it.
        scene: what else is around it; None: nothing.
    """

    def __init__(self, robot: str, boxes: list[Box], scene: Scene | None) -> None:
        self._robot, self._boxes, self._scene = robot, boxes, scene
        self._made: dict[tuple[tuple[CarriedShapes, ...], tuple[Obstacle, ...]], Any] = {}

    def carrying(self, carried: tuple[CarriedShapes, ...], obstacles: tuple[Obstacle, ...]) -> Any:
        """The model of an arm that carries shapes, among bodies that were added; the last ones are kept."""
        from heptarm.sim.plant.world import compiled

        key = (carried, obstacles)
        model = self._made.pop(key, None)
        if model is None:
            model = compiled(self._robot, self._boxes, self._scene, carried=carried, obstacles=obstacles)
        self._made[key] = model
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


def _unknown(name: str, known: tuple[str, ...], what: str) -> CommandRejected:
    listed = ", ".join(known) or "none"
    return CommandRejected(
        f"body must be {what}, one of {listed}; got {shown(name)}",
        parameter="body",
        value=name,
        allowed=listed,
    )


#: A pair that touches at the start of a path may get so much nearer, by rounding [m].
_NEARER = 1e-4


def _place(points: Array, piece: int, at: float) -> float:
    """The fraction of a joint path at a fraction of one of its pieces, by the joint that moves most in each."""
    moves = np.abs(np.diff(points, axis=0)).max(axis=1)
    return float((moves[:piece].sum() + at * moves[piece]) / (moves.sum() or 1.0))


def _rows(values: npt.ArrayLike, name: str) -> Array:
    """Joint positions of shape (n, 7).

    Raises:
        ShapeError: another shape, or none.
    """
    points = finite_entries(numbers(values, name, "joint positions of shape (n, 7)"), name)
    if points.ndim != 2 or points.shape[1] != 7 or not len(points):
        raise ShapeError(
            f"{name} must be joint positions of shape (n, 7), got shape {points.shape}",
            parameter=name,
            hint="for example [[0, 0.5, 0, -1.5, 0, 1, 0], [0.3, 0.5, 0, -1.5, 0, 1, 0]]",
        )
    return points


def _listed(values: object, name: str) -> list[Any]:
    """The entries of what is a list, a tuple or another iterable, but no text.

    Raises:
        ShapeError: it is something else.
    """
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise ShapeError(f"{name} must be a list, got {shown(values)}", parameter=name, value=values)
    return list(values)
