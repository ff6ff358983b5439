"""Collisions foreseen: which bodies of arm, tool and scene touch at joint positions, or along a joint path.

The shapes and the rules of who can touch whom are those of the simulator: MuJoCo's. It is an aid for programs, not a
safety function: it knows only what its scene contains.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import wraps
from math import isfinite
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError, ShapeError, require
from heptarm.values.checks import (
    Array,
    array,
    finite_entries,
    frozen,
    instance,
    integer,
    numbers,
    shown,
    within,
)
from heptarm.values.clearance import Clearance, ForeseenCollision, TouchOnPath
from heptarm.values.mesh import Mesh
from heptarm.values.pose import Pose, check_pose
from heptarm.values.robot import RobotModel
from heptarm.values.robot import robot as known
from heptarm.values.sealed import Sealed
from heptarm.values.shape import ORIGIN, Shape
from heptarm.values.tool import KnownTool, Tool, Workpiece
from heptarm.values.world import Color, WorldArm, WorldBody, WorldOutline, checked_color

if TYPE_CHECKING:
    from heptarm.sim.distances import Distances
    from heptarm.sim.plant.carried import CarriedShapes
    from heptarm.sim.plant.other_arm import OtherArm
    from heptarm.sim.plant.scene import Scene
    from heptarm.sim.plant.world import Box
    from heptarm.sim.shown_world import ShownWorld

#: Default of the distance below which two bodies count as touching [m].
MARGIN = 0.005
#: Default of the distance up to which clearances are reported [m].
NEAR = 0.1
#: Default of what counts as occupied around a point of a cloud [m].
POINT_RADIUS = 0.01
#: Bodies on a path may be nearer than a margin of 0 between two checks, by half of this [m].
_LEAST_MARGIN = 1e-3
#: Exact distances of farther bodies are not computed on a path: that takes longer than shorter steps [m].
_FAR = 0.1
#: Most spheres of a cloud.
_MOST_SPHERES = 5000
#: First parts of names in compiled models, which no arm may have.
_PREFIXES = ("scene", "tool", "workpiece", "added")
#: Compiled models that are kept, one for each tool and workpiece that was carried lately.
_MOST_KEPT = 8
_Method = TypeVar("_Method", bound=Callable[..., Any])


def _alone(method: _Method) -> _Method:
    """A method during which no other thread reads or changes the model: MuJoCo computes in one set of arrays."""

    @wraps(method)
    def alone(self: CollisionModel, *args: Any, **kwargs: Any) -> Any:
        with self._lock:
            return method(self, *args, **kwargs)

    return cast(_Method, alone)


def _changes(method: _Method) -> _Method:
    """A method that changes the world, alone; threads that wait for a change wake."""

    @wraps(method)
    def changes(self: CollisionModel, *args: Any, **kwargs: Any) -> None:
        with self._lock:
            method(self, *args, **kwargs)
            self._revision += 1
            self._lock.notify_all()

    return cast(_Method, changes)


class CollisionModel(Sealed):
    """The collision model of an arm, its tool and its scene; needs `pip install 'heptarm[sim]'`.

    It reads joint positions and nothing else, so it serves a robot as well as a simulator. Bodies of the scene stay
    where its file has them, unless you `place` or `hold` them; others can be added and removed while a program runs.

    A gripper counts as open, as wide as it gets.

    Its methods may be called from any thread: one that watches a camera changes the world while another one plans.

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
        pairs = _pairs(allowed)
        require("mujoco", extra="sim")
        from heptarm.sim.plant.scene import Scene
        from heptarm.sim.plant.world import Box

        self._robot = known(robot)
        self._margin = within(margin, "margin", 0.0, 0.1, unit="m")
        self._allowed = pairs
        least = max(self._margin, _LEAST_MARGIN)
        self._steps = {"margin": self._margin, "least": least, "far": max(_FAR, self._margin)}
        self._lock = threading.Condition(threading.RLock())
        self._revision = 0
        self._held: dict[str, Pose] = {}  # by body: its pose in the flange frame
        self._added: dict[str, WorldBody] = {}
        self._carried: tuple[CarriedShapes, ...] = ()
        self._arms: tuple[OtherArm, ...] = ()
        self._shown: ShownWorld | None = None
        try:
            made = [Box.of(text) for text in texts]
            self._models = _Models(robot, made, Scene.of(scene) if scene else None)
            self._distances = self._compiled()
        except ValueError as error:
            if isinstance(error, CommandRejected):
                raise
            raise CommandRejected(str(error), parameter="scene" if scene else "boxes") from None

    def _compiled(self, before: Distances | None = None) -> Distances:
        """The distances of the present world; free bodies and other arms are where they were before."""
        from heptarm.sim.distances import Distances

        model = self._models.compiled(self._carried, tuple(self._added.values()), self._arms)
        made = Distances(model, self._allowed)
        if before is not None:
            for name in made.free:
                if name in before.free:
                    made.put(name, before.place_of(name))
            for name in set(made.arms) & set(before.arms):
                made.set_arm(name, before.posture_of(name))
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
    def arms(self) -> tuple[str, ...]:
        """Names of the other arms in the world, see `with_arm`."""
        return tuple(arm.name for arm in self._arms)

    @property
    def checks(self) -> int:
        """Postures whose distances were computed since the world was changed last."""
        return self._distances.checks

    # --------------------------------------------------------------------------------- the world

    @property
    def revision(self) -> int:
        """Counts the changes of the world: bodies that were added, removed, placed, held or released."""
        return self._revision

    def wait_for_change(self, revision: int, *, timeout: float) -> int:
        """Wait until the world has changed since a revision.

        Args:
            revision: as `revision` was.
            timeout: longest wait [s].

        Returns:
            The revision now: the same if nothing has changed.

        Raises:
            ShapeError: not numbers.
            LimitError: one is outside its range.
        """
        before = integer(revision, "revision", 0, 2**63)
        longest = within(timeout, "timeout", 0.0, 3600.0, unit="s")
        with self._lock:
            self._lock.wait_for(lambda: self._revision != before, longest)
            return self._revision

    @_changes
    def add(
        self,
        name: str,
        shape: Shape | Mesh | Sequence[Shape | Mesh],
        *,
        at: Pose = ORIGIN,
        color: Sequence[float] | None = None,
    ) -> None:
        """Add a body to the world. It can be placed, held and removed.

        Args:
            name: of the body, of which there is none yet.
            shape: one of `heptarm.shapes`, or several that are one body: `box`, `sphere`, `cylinder`, `capsule`,
                `mesh`, `height_map`.
            at: pose of its frame in the base.
            color: in which a panel draws it, see `show`: red, green, blue and perhaps opacity, 0 to 1; None: that of
                wood.

        Raises:
            ShapeError: wrong types.
            LimitError: a colour outside its range.
            CommandRejected: there is a body of that name, or it would be inside the base of the arm, which never moves.
        """
        given = (shape,) if isinstance(shape, Shape | Mesh) else _listed(shape, "shape")
        if not given:
            raise ShapeError("shape must have at least one shape, got none", parameter="shape", value=shape)
        parts: tuple[Shape | Mesh, ...] = tuple(instance(part, (Shape, Mesh), "shape") for part in given)
        self._add(WorldBody(name, parts, at, color=checked_color(color)))

    @_changes
    def add_points(
        self,
        cloud: npt.ArrayLike,
        *,
        radius: float = POINT_RADIUS,
        name: str = "points",
        at: Pose = ORIGIN,
        color: Sequence[float] | None = None,
    ) -> None:
        """Add a cloud of points, such as of a depth camera, as one body. Points nearer than `radius` become one sphere.

        Args:
            cloud: points, shape (n, 3) [m].
            radius: distance from each point that counts as occupied [m], 0.001 to 0.5.
            name: of the body, of which there is none yet.
            at: pose of the cloud's frame, such as of the camera, in the base.
            color: as of `add`.

        Raises:
            ShapeError: not points of shape (n, 3), or none.
            LimitError: a point that is not finite, a radius or a colour outside its range, or more than 5000 spheres.
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
        self._add(WorldBody(name, (), at, frozen(centres), covering, checked_color(color)))

    def _add(self, body: WorldBody) -> None:
        name = body.name
        self._check_new(name)
        check_pose(body.pose, "at")
        self._added[name] = body
        try:
            made = self._compiled(self._distances)
            self._check_base(made, name)
        except ValueError as error:
            del self._added[name]
            if isinstance(error, CommandRejected):
                raise
            raise CommandRejected(f"{name} is no body: {error}", parameter="shape", value=name) from None
        self._distances = made

    def _check_new(self, name: str) -> None:
        """Refuse a name of a body or an arm that is no new one."""
        instance(name, str, "name")
        if not name or "/" in name or name in ("world", *_PREFIXES, *self._distances.names, *self.arms):
            raise CommandRejected(
                f"name must be a new name without a slash, got {shown(name)}",
                parameter="name",
                value=name,
                hint="remove the body of that name first, or place it: bodies are listed in `bodies`, arms in `arms`",
            )

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
                    hint="give its pose in the base [m], or leave out the points on the arm itself",
                )

    @_changes
    def remove(self, body: str) -> None:
        """Remove a body that was added.

        Raises:
            CommandRejected: no body of that name was added.
        """
        self._added_body(body)
        del self._added[body]
        self._held.pop(body, None)
        self._distances = self._compiled(self._distances)

    @_changes
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

    @_changes
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

    @_changes
    def release(self, body: str) -> None:
        """Let the arm hold a body no more; it stays where it was in the last check. See `place`.

        Raises:
            CommandRejected: there is no free body of that name.
        """
        self._check_free(body)
        self._held.pop(body, None)
        self._distances.hold(self._held)

    @_changes
    def set_color(self, body: str, color: Sequence[float] | None) -> None:
        """Give a body that was added another colour, in which a panel draws it.

        Args:
            body: its name.
            color: red, green, blue and perhaps opacity, 0 to 1; None: that of wood.

        Raises:
            CommandRejected: no body of that name was added.
            ShapeError: no colour.
            LimitError: a number outside its range.
        """
        self._added[body] = replace(self._added_body(body), color=checked_color(color))

    @_alone
    def color(self, body: str) -> Color:
        """Colour of a body that was added: red, green, blue and opacity, 0 to 1.

        Raises:
            CommandRejected: no body of that name was added.
        """
        return self._added_body(body).color

    def _added_body(self, body: str) -> WorldBody:
        instance(body, str, "body")
        if body not in self._added:
            raise _unknown(body, tuple(self._added), "a body that was added")
        return self._added[body]

    def show(self) -> bool:
        """Let the open panels of this user that show this robot draw the world, and each change, from now on.

        Bodies that were added are drawn in their colours with their names, others where the scene is; so are the other
        arms. A panel plans around what it draws. A panel that is opened later draws it, too. It ends with `hide`, with
        the program, and when the model is not used any more. Of several worlds the one is drawn that was shown last.

        Returns:
            Whether a panel is open.
        """
        from heptarm.sim.shown_world import ShownWorld

        with self._lock:
            if self._shown is None:
                self._shown = ShownWorld(self)
            return self._shown.is_seen

    def hide(self) -> None:
        """Let no panel draw the world any more."""
        with self._lock:
            ended, self._shown = self._shown, None
        if ended is not None:
            ended.end()

    @_alone
    def outline(self) -> WorldOutline:
        """What a panel shows of the world."""
        fixed = self._models.boxes()
        bodies = tuple(self._outline_of(body) for body in self._added.values())
        nothing = {
            name: WorldBody(name, (), ORIGIN) for name in self._distances.free if name not in self._added
        }
        return WorldOutline(
            self._robot.name,
            self._models.scene_text,
            (*fixed, *bodies),
            tuple(map(self._outline_of, nothing.values())),
            tuple(self._arm_outline(arm) for arm in self._arms),
        )

    @classmethod
    def of(cls, outline: WorldOutline) -> CollisionModel:
        """The world of an outline, such as one that another program shows: the reverse of `outline`.

        Args:
            outline: its bodies, arms and scene.

        Raises:
            ShapeError: no outline.
            CommandRejected: no such robot or scene, or what it has is no body.
        """
        from heptarm.sim.plant.carried import CarriedShapes
        from heptarm.sim.plant.other_arm import OtherArm

        given = instance(outline, WorldOutline, "outline")
        made = cls(given.robot, scene=given.scene)
        made._added = {body.name: replace(body, is_held=False) for body in given.bodies}
        made._arms = tuple(
            OtherArm(
                arm.name, arm.robot, arm.pose, (CarriedShapes("tool", arm.shapes, ORIGIN, is_tool=True),)
            )
            for arm in given.arms
        )
        try:
            made._distances = made._compiled()
        except ValueError as error:
            raise CommandRejected(f"outline has what is no body: {error}", parameter="outline") from None
        for arm in given.arms:
            made._distances.set_arm(arm.name, arm.q)
        for body in (*given.bodies, *given.placed):
            if body.is_held and body.name in made._distances.free:
                made._held[body.name] = body.pose
            elif body.name in made._distances.free:
                made._distances.put(body.name, body.pose)
        made._distances.hold(made._held)
        return made

    def _outline_of(self, body: WorldBody) -> WorldBody:
        held = self._held.get(body.name)
        if held is not None:
            return replace(body, pose=held, is_held=True)
        return replace(body, pose=self._distances.place_of(body.name))

    def _arm_outline(self, arm: OtherArm) -> WorldArm:
        shapes = tuple(
            replace(shape, pose=mounted.pose @ shape.pose)
            for mounted in arm.carried
            for shape in mounted.shapes
        )
        return WorldArm(arm.name, arm.robot, arm.pose, frozen(self._distances.posture_of(arm.name)), shapes)

    @_alone
    def pose(self, body: str) -> Pose:
        """Pose of a free body, or of one that was added, in the base; of one that is held: at the last check.

        Raises:
            CommandRejected: there is no free body of that name.
        """
        self._check_free(body)
        return self._distances.place_of(body)

    @_alone
    def held(self, body: str) -> Pose | None:
        """Pose in the flange frame of a free body that the arm holds; None: the arm does not hold it.

        Raises:
            CommandRejected: there is no free body of that name.
        """
        self._check_free(body)
        return self._held.get(body)

    @_alone
    def shapes(self, body: str) -> tuple[Shape, ...]:
        """Shapes of a free body, or of one that was added, in its frame; meshes are left out.

        Raises:
            CommandRejected: there is no free body of that name.
        """
        self._check_free(body)
        return self._distances.shapes_of(body)

    def allowing(self, pairs: Iterable[tuple[str, str]]) -> CollisionModel:
        """The same model, with the world as it is now, in which more pairs of bodies may touch.

        Args:
            pairs: names of bodies, such as ("part_1", "table").

        Raises:
            ShapeError: not pairs of names.
        """
        return self._view(self._carried, self._allowed | _pairs(pairs))

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
        not used. An arm does this by itself with what is attached to it. Later changes of either do not reach the
        other; its `revision` begins as that of the world it was made from.

        Args:
            tool: the tool; None: none.
            workpiece: what it holds; None: nothing.
            at: pose in the flange frame of the frame that holds the workpiece; None: the tool's tcp.

        Raises:
            ShapeError: wrong types.
        """
        return self._view(_carried(tool, workpiece, at), self._allowed)

    def become(self, other: CollisionModel) -> None:
        """Have the bodies and the other arms of another model, as they are now.

        So several changes, made to a copy, are one change for those who watch this model. What this arm carries, its
        margin and the pairs that may touch stay.

        Args:
            other: of the same robot, such as a copy: `world.carrying(None)`.

        Raises:
            ShapeError: no model.
            CommandRejected: it is of another robot.
        """
        instance(other, CollisionModel, "other")
        if other.robot.name != self._robot.name:
            raise CommandRejected(
                f"other must be a model of this robot, the {self._robot.name}, got one of the {other.robot.name}",
                parameter="other",
                value=other.robot.name,
            )
        self._take(other._view(self._carried, self._allowed))

    @_changes
    def _take(self, view: CollisionModel) -> None:
        self._models, self._added, self._held, self._arms = view._models, view._added, view._held, view._arms
        self._distances = view._distances

    @_alone
    def _view(self, carried: tuple[CarriedShapes, ...], allowed: frozenset[frozenset[str]]) -> CollisionModel:
        """The same model, with the world as it is now, in which the arm carries and may touch something else."""
        view = self._copy()
        view._carried, view._allowed = carried, allowed
        view._distances = view._compiled(self._distances)
        return view

    def _copy(self) -> CollisionModel:
        """A model whose later changes do not reach this one."""
        view = copy(self)
        view._lock, view._shown = threading.Condition(threading.RLock()), None
        view._held, view._added = dict(self._held), dict(self._added)
        return view

    # -------------------------------------------------------------------------------- other arms

    @_alone
    def with_arm(
        self,
        name: str,
        *,
        at: Pose | None = None,
        robot: str = "",
        q: npt.ArrayLike | None = None,
        tool: Tool | KnownTool | None = None,
        workpiece: Workpiece | KnownTool | None = None,
    ) -> CollisionModel:
        """The same model, with the world as it is now, and another arm in it: its bodies are "NAME/link_3" and so on.

        Checks and paths keep clear of it in the posture that `set_arm` gives it. `seen_by` is the same world for it.

        Args:
            name: of the arm, as of `connect_all`: a new name without a slash.
            at: pose of its base in the base of this arm; None: where the scene has a site of that name.
            robot: its name, such as "iiwa7"; "": as this one.
            q: its posture, shape (7,) [rad]; None: all joints at 0.
            tool: its tool, whose shapes it carries; None: none.
            workpiece: what the tool holds; None: nothing.

        Raises:
            ShapeError: wrong types.
            CommandRejected: the name is not new, no such robot, no place, or its base would be inside this one's.
        """
        from heptarm.sim.plant.other_arm import OtherArm

        self._check_new(name)
        place = self._models.site(name) if at is None else at
        if place is None:
            raise CommandRejected(
                f"at must be the pose of the base of {name}: the scene has no site of that name, got None",
                parameter="at",
                value=None,
                hint="for example at=heptarm.Pose.at(1.2, 0.0, 0.0)",
            )
        check_pose(place, "at")
        instance(robot, str, "robot")
        model = known(robot) if robot else self._robot
        posture = np.zeros(7) if q is None else array(q, 7, "q")
        model.check(posture, "q")
        view = self._copy()
        view._arms = (*self._arms, OtherArm(name, model.name, place, _carried(tool, workpiece, None)))
        view._distances = view._compiled(self._distances)
        view._distances.set_arm(name, posture)
        view._check_base(
            view._distances, f"{name}/link_1"
        )  # MuJoCo has no distance of two bases, which never move
        return view

    @_changes
    def set_arm(self, name: str, q: npt.ArrayLike) -> None:
        """Put another arm into a posture, such as the one of its newest state.

        Args:
            name: of the arm.
            q: joint positions, shape (7,) [rad].

        Raises:
            CommandRejected: there is no arm of that name.
            ShapeError: not seven numbers.
            LimitError: beyond the limits of its joints.
        """
        other = self._arm(name)
        posture = array(q, 7, "q")
        known(other.robot).check(posture, "q")
        self._distances.set_arm(name, posture)

    @_alone
    def seen_by(self, name: str, *, own: str, q: npt.ArrayLike | None = None) -> CollisionModel:
        """The same world for another arm in it: what it checks and plans is that arm, in whose base all poses are.

        Bodies that this arm holds stay where they are, and do not move with it there.

        Args:
            name: of the other arm.
            own: name under which this arm is in that world.
            q: posture of this arm there, shape (7,) [rad]; None: all joints at 0.

        Raises:
            CommandRejected: there is no arm of that name, or `own` is not a new one.
            ShapeError: wrong types.
            LimitError: beyond the limits of the joints.
        """
        from heptarm.sim.plant.other_arm import OtherArm

        chosen = self._arm(name)
        self._check_new(own)
        posture = np.zeros(7) if q is None else array(q, 7, "q")
        self._robot.check(posture, "q")
        back = chosen.pose.inverse()
        others = (OtherArm(arm.name, arm.robot, back @ arm.pose, arm.carried) for arm in self._arms)
        view = self._copy()
        view._robot, view._carried, view._held = known(chosen.robot), chosen.carried, {}
        view._arms = (
            OtherArm(own, self._robot.name, back, self._carried),
            *(other for other in others if other.name != name),
        )
        view._models = self._models.seen_by(name, view._robot.name, back, own)
        view._distances = view._compiled()
        view._distances.set_arm(own, posture)
        for arm in view.arms[1:]:
            view._distances.set_arm(arm, self._distances.posture_of(arm))
        for body in self._distances.free:
            view._distances.put(body, back @ self._distances.place_of(body))
        return view

    def _arm(self, name: str) -> OtherArm:
        instance(name, str, "name")
        found = next((arm for arm in self._arms if arm.name == name), None)
        if found is None:
            raise _unknown(name, self.arms, "another arm of the world", "name")
        return found

    @_alone
    def first_together(
        self, t: npt.ArrayLike, q: npt.ArrayLike, others: Mapping[str, npt.ArrayLike]
    ) -> ForeseenCollision | None:
        """The first time at which this arm and another one touch, when all move; other bodies do not count.

        Between two times the joints move straight. As in `first_on`, the arms are checked where they could have met,
        by the largest movement of any point of both, so that they never meet between two checks.

        Args:
            t: times, shape (n,) [s].
            q: joint positions of this arm at these times, shape (n, 7) [rad].
            others: likewise of other arms, by their names; those that are not named stay as they are.

        Returns:
            The time and the nearest bodies then; None: nothing touches. Other arms are where they were then, or at the
            end.

        Raises:
            ShapeError: wrong shapes.
            CommandRejected: there is no arm of that name.
        """
        from heptarm.sim.distances import Distances

        instance(others, Mapping, "others")
        rows = {"q": _rows(q, "q")} | {name: _rows(row, name) for name, row in others.items()}
        times = finite_entries(numbers(t, "t", "times of shape (n,)"), "t")
        if any(times.shape != (len(row),) for row in rows.values()):
            raise ShapeError(
                f"t and all joint positions must have the same length, got {times.shape} and "
                f"{[len(row) for row in rows.values()]}",
                parameter="t",
            )
        path = rows.pop("q")
        movers: dict[str, Distances] = {
            name: Distances(_Models(self._arm(name).robot, [], None).compiled(self._arm(name).carried), ())
            for name in rows
        }
        free = -1.0  # bound on the movement until which nothing can meet [m]
        for k in range(max(1, len(path) - 1)):
            last = min(k + 1, len(path) - 1)
            moved = self._distances.moved(path[last] - path[k])
            moved += max(
                (mover.moved(rows[name][last] - rows[name][k]) for name, mover in movers.items()), default=0.0
            )
            at = 0.0
            while free < (1.0 - at) * moved or free < 0.0 or (last == len(path) - 1 and at < 1.0):
                at = min(1.0, at + max(free, 0.0) / moved) if moved else 1.0
                for name, row in rows.items():
                    self._distances.set_arm(name, row[k] + at * (row[last] - row[k]))
                here = path[k] + at * (path[last] - path[k])
                found = self._distances.nearest_of_arms(here, self._steps["far"])
                if found is not None and found[1] < self._margin:
                    return ForeseenCollision(
                        Clearance(*found[0], found[1]),
                        float(times[k] + at * (times[last] - times[k])),
                        0,
                        frozen(here),
                    )
                free = self._steps["least"]
                free += self._steps["far"] if found is None else found[1]
            free -= (1.0 - at) * moved
        return None

    def _check_free(self, name: str) -> None:
        instance(name, str, "body")
        if name not in self._distances.free:
            raise _unknown(name, self._distances.free, "a free body of the scene")

    # ------------------------------------------------------------------------------------ checks

    @_alone
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

    @_alone
    def touching(self, q: npt.ArrayLike) -> tuple[Clearance, ...]:
        """Pairs of bodies that touch at joint positions: nearer than `margin`, and not allowed to; as `clearances`."""
        return tuple(
            clearance
            for clearance in self._clearances(array(q, 7, "q"), self._margin)
            if frozenset((clearance.first, clearance.second)) not in self._allowed
        )

    @_alone
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

    @_alone
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
            known = {
                (clearance.first, clearance.second): clearance.distance
                for clearance in self.touching(points[0])
            }
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

    @_alone
    def is_free(self, first: npt.ArrayLike, last: npt.ArrayLike) -> bool:
        """Whether nothing touches on a straight joint path: as `first_on`, and faster where something does.

        Args:
            first: joint positions at its beginning, shape (7,) [rad].
            last: likewise at its end.

        Raises:
            ShapeError: not seven numbers.
        """
        if _are_joints(first, last):
            ends = cast(Array, first), cast(Array, last)
        else:
            ends = array(first, 7, "first"), array(last, 7, "last")
        free = self._distances.is_free(ends[0], ends[1], **self._steps)
        # a pair that touches at the beginning may be left
        return self.first_on(np.array(ends)) is None if free is None else free

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
        moved, least = self._distances.moved(change), self._steps["least"]
        while known and at < 1.0:
            at = min(1.0, at + (self._margin + least) / max(moved, least))
            found = self._new(first + at * change, known)
            if found is not None:
                return at, found
        return at, None

    def _new(self, q: Array, start: dict[tuple[str, str], float]) -> Clearance | None:
        """The nearest pair that touches at joint positions and did not at the start, or is nearer now."""
        now = self.touching(q)
        present = {(clearance.first, clearance.second) for clearance in now}
        for pair in [pair for pair in start if pair not in present]:
            del start[pair]  # it has been left: from now on it counts
        for clearance in now:
            before = start.get((clearance.first, clearance.second))
            if before is None or clearance.distance < before - _NEARER:
                return clearance
        return None

    def _clearances(self, q: Array, below: float) -> tuple[Clearance, ...]:
        nearest: dict[tuple[str, str], float] = {}
        geoms, distances = self._distances.pairs(q, below)
        for pair, distance in zip(geoms.tolist(), distances.tolist()):
            names = self._distances.named(*pair)
            nearest[names] = min(nearest.get(names, np.inf), distance)
        found = [Clearance(*names, distance) for names, distance in nearest.items()]
        return tuple(sorted(found, key=lambda clearance: clearance.distance))


class _Models:
    """MuJoCo's models of one arm in one scene, by what the arm carries.

    Args:
        robot: its name.
        boxes: fixed boxes around it.
        scene: what else is around it; None: nothing.
        origin: pose of boxes, scene and floor in the base of the arm.
        tool_of: the other arm that has the tool of the scene; "": this one.
    """

    def __init__(
        self,
        robot: str,
        boxes: list[Box],
        scene: Scene | None,
        *,
        origin: Pose = ORIGIN,
        tool_of: str = "",
    ) -> None:
        self._robot, self._boxes, self._scene = robot, boxes, scene
        self._lock = threading.Lock()  # models of the same world share this in several threads
        self._origin, self._tool_of = origin, tool_of
        self._made: dict[tuple[object, ...], Any] = {}

    def boxes(self) -> tuple[WorldBody, ...]:
        """The fixed boxes, in the base of the arm."""
        return tuple(
            WorldBody(f"box {number}", (Shape("box", frozen(box.size)),), self._origin @ Pose.of(box.centre))
            for number, box in enumerate(self._boxes)
        )

    @property
    def scene_text(self) -> str:
        """The file of the scene; "": there is none, or it is another arm's."""
        return "" if self._scene is None or self._origin != ORIGIN else str(self._scene.path.resolve())

    def site(self, name: str) -> Pose | None:
        """Where the scene has a site of that name, in the base of the arm; None: it has none."""
        found = None if self._scene is None else self._scene.place_of(name)
        return None if found is None else self._origin @ found

    def seen_by(self, name: str, robot: str, back: Pose, own: str) -> _Models:
        """Models of the same world for another arm in it.

        Args:
            name: of that arm.
            robot: its robot.
            back: pose of the base of this arm in its base.
            own: name of this arm there.
        """
        tool_of = {"": own, name: ""}.get(self._tool_of, self._tool_of)
        return _Models(robot, self._boxes, self._scene, origin=back @ self._origin, tool_of=tool_of)

    def compiled(
        self,
        carried: tuple[CarriedShapes, ...],
        obstacles: tuple[WorldBody, ...] = (),
        arms: tuple[OtherArm, ...] = (),
    ) -> Any:
        """The model of an arm that carries shapes, among added bodies and other arms; the last ones are kept."""
        from heptarm.sim.plant.world import compiled

        key = (carried, obstacles, arms)
        with self._lock:
            model = self._made.pop(key, None)
            if model is None:
                model = compiled(
                    self._robot,
                    self._boxes,
                    self._scene,
                    carried=carried,
                    obstacles=obstacles,
                    arms=arms,
                    origin=self._origin,
                    tool_of=self._tool_of,
                )
            self._made[key] = model
            for oldest in list(self._made)[:-_MOST_KEPT]:
                del self._made[oldest]
            return model


def _carried(
    tool: Tool | KnownTool | None, workpiece: Workpiece | KnownTool | None, at: Pose | None
) -> tuple[CarriedShapes, ...]:
    """The shapes of a tool and of what it holds, as they are on the flange.

    Raises:
        ShapeError: wrong types.
    """
    from heptarm.sim.plant.carried import CarriedShapes

    if tool is not None:
        instance(tool, (Tool, KnownTool), "tool")
    if workpiece is not None:
        instance(workpiece, (Workpiece, KnownTool), "workpiece")
    if at is not None:
        check_pose(at, "at")
    origin = Pose.of((0.0, 0.0, 0.0))
    found = [] if tool is None else [CarriedShapes(tool.name, tool.shapes, origin, is_tool=True)]
    if workpiece is not None:
        tip = tool.frames[0][1] if tool is not None and tool.frames else origin
        found.append(CarriedShapes(workpiece.name, workpiece.shapes, tip if at is None else at))
    return tuple(body for body in found if body.shapes)


def _unknown(name: str, known: tuple[str, ...], what: str, parameter: str = "body") -> CommandRejected:
    listed = ", ".join(known) or "none"
    return CommandRejected(
        f"{parameter} must be {what}, one of {listed}; got {shown(name)}",
        parameter=parameter,
        value=name,
        allowed=listed,
    )


_DOUBLE = np.dtype(float)
#: A pair that touches at the start of a path may get so much nearer, by rounding [m].
_NEARER = 1e-4


def _are_joints(first: npt.ArrayLike, last: npt.ArrayLike) -> bool:
    """Whether both are joint positions as a search has them, which asks often and needs no more than a look."""
    return (
        type(first) is type(last) is np.ndarray
        and first.dtype is last.dtype is _DOUBLE
        and first.shape == last.shape == (7,)
        and isfinite(first @ last)  # which it is not with an entry that is not, or with huge ones
    )


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


def _pairs(allowed: Iterable[tuple[str, str]]) -> frozenset[frozenset[str]]:
    """Pairs of names of bodies that may touch.

    Raises:
        ShapeError: something else.
    """
    pairs = [tuple(_listed(pair, "allowed")) for pair in _listed(allowed, "allowed")]
    if any(len(pair) != 2 or not all(isinstance(name, str) for name in pair) for pair in pairs):
        raise ShapeError(
            f"allowed must be pairs of names of bodies, got {shown(allowed)}",
            parameter="allowed",
            value=allowed,
            hint='for example [("tool", "table")]',
        )
    return frozenset(frozenset(pair) for pair in pairs)


def _listed(values: object, name: str) -> list[Any]:
    """The entries of what is a list, a tuple or another iterable, but no text.

    Raises:
        ShapeError: it is something else.
    """
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise ShapeError(f"{name} must be a list, got {shown(values)}", parameter=name, value=values)
    return list(values)
