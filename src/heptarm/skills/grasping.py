"""Picking and placing: grasps of a body from its shape, and paths around everything else.

The model of the world knows where bodies are and what they look like. A pick takes the first grasp that can be reached,
and from then on the arm holds the body in that model, so that later paths keep it clear of the rest; a place puts it
back.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import pi

import numpy as np

from heptarm.arm.verbs import ArmVerbs
from heptarm.errors import CommandRejected, GraspFailed, NoPath, ShapeError
from heptarm.skills.gripper import Gripper, check_gripper
from heptarm.values.checks import Array, Value, instance, shown, within
from heptarm.values.clearance import CollisionWorld, TouchOnPath
from heptarm.values.frames import BASE, FLANGE, TOOL
from heptarm.values.motion.line import lin, lin_rel
from heptarm.values.motion.planned_path import Path
from heptarm.values.pose import Pose, check_pose
from heptarm.values.shape import Shape
from heptarm.values.tool import KnownTool, Workpiece

#: Default of the width between the open fingers [m].
OPENING = 0.08
#: Default of the length of the straight lines to a body and away from it [m].
APPROACH = 0.08
#: Default of the speed on these lines [m/s].
LINE_SPEED = 0.1
#: Default of the longest search for each path [s]; most of them end after a count of states.
PATIENCE = 30.0
#: The fingers need so much more room than the body is wide [m].
_PLAY = 0.004
#: Fractions of half the depth of a body by which a grasp is nearer to the face from which the gripper comes.
_OFFSETS = (0.0, 0.3, 0.6)
#: Directions about the axis of a cylinder from which it is grasped.
_AROUND = 8
#: Bodies may overlap by so much where one is grasped or placed, by rounding [m].
_ROUNDING = 1e-3
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Grasp(Value):
    """How a gripper holds a body.

    Attributes:
        pose: of the tool frame in the frame of the body; its z axis is the direction in which the gripper approaches,
            its y axis that in which the fingers close.
        width: of the body between the fingers [m].
    """

    pose: Pose
    width: float


def grasps(shapes: Sequence[Shape], *, opening: float = OPENING) -> tuple[Grasp, ...]:
    """Grasps of a body by two parallel fingers, those in its middle first.

    A box is grasped at each pair of faces that fits between the fingers, from the four faces between them; a cylinder
    across its axis, from its ends and from around it.

    Args:
        shapes: of the body, in its frame; one box or one cylinder.
        opening: width between the open fingers [m].

    Returns:
        Nothing where the body is too wide.

    Raises:
        ShapeError: another body.
        LimitError: a width outside its range.
    """
    room = within(opening, "opening", 0.0, 1.0, above=True, unit="m") - _PLAY
    if len(shapes) != 1 or shapes[0].kind not in ("box", "cylinder"):
        got = ", ".join(shape.kind for shape in shapes) or "none"
        raise ShapeError(
            f"a body must be one box or one cylinder to be grasped by its shape, got {got}",
            parameter="body",
            value=got,
            hint="give the grasps: heptarm.skills.Grasp(pose of the tool frame in the body's frame, width)",
        )
    shape = shapes[0]
    sides = list(_of_box(shape.size) if shape.kind == "box" else _of_cylinder(*shape.size[:2].tolist()))
    return tuple(
        Grasp(shape.pose @ _frame(approach, closing, -offset * depth * approach), width)
        for offset in _OFFSETS
        for approach, closing, depth, width in sides
        if width <= room
    )


_Side = tuple[Array, Array, float, float]


def _of_box(edges: Array) -> Iterator[_Side]:
    """Directions of approach and of closing, half the depth along the approach [m], width [m]."""
    for along in range(3):
        for across in range(3):
            if across == along:
                continue
            for sign in (-1.0, 1.0):
                for turn in (1.0, -1.0):
                    yield (
                        sign * np.eye(3)[along],
                        turn * np.eye(3)[across],
                        0.5 * float(edges[along]),
                        float(edges[across]),
                    )


def _of_cylinder(radius: float, length: float) -> Iterator[_Side]:
    """Likewise of a cylinder along z."""
    for angle in np.linspace(0.0, 2.0 * pi, _AROUND, endpoint=False):
        radial = np.array([np.cos(angle), np.sin(angle), 0.0])
        for sign in (-1.0, 1.0):
            yield sign * _UP, radial, 0.5 * length, 2.0 * radius
            yield -radial, sign * np.cross(_UP, radial), radius, 2.0 * radius


def _frame(approach: Array, closing: Array, at: Array) -> Pose:
    """Pose of a tool frame by its z and y axes and its origin."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([np.cross(closing, approach), closing, approach], axis=1)
    matrix[:3, 3] = at
    return Pose.from_matrix(matrix)


def pick(
    arm: ArmVerbs,
    gripper: Gripper,
    body: str,
    *,
    world: CollisionWorld,
    candidates: Sequence[Grasp] | None = None,
    opening: float = OPENING,
    approach: float = APPROACH,
    speed_mps: float = LINE_SPEED,
    timeout: float = PATIENCE,
    seed: int = 0,
) -> Grasp:
    """Pick a body: move around everything to a grasp of it, close the gripper, and lift it straight up.

    The arm moves along a path to a pose before the body, and on a straight line to it. When the gripper has closed, the
    flange holds the body in `world`. Attach its load to the arm where it counts: `with arm.attached(workpiece)`.

    Args:
        arm: in control and at rest. The z axis of its tool frame is the direction in which the fingers point, the y
            axis that in which they close.
        gripper: between whose fingers the tool frame is.
        body: a free body of the world.
        world: model of the bodies, such as a `heptarm.CollisionModel`; `place` in it what has moved before.
        candidates: grasps, the best first; None: those of `grasps`, from above first.
        opening: width between the open fingers, for `grasps` [m].
        approach: length of the straight lines to the body and up [m], 0.01 to 0.5.
        speed_mps: speed on these lines [m/s].
        timeout: longest search for each path [s].
        seed: of the searches.

    Returns:
        The grasp that was used.

    Raises:
        NoPath: no grasp can be reached; the text has the reason of the first one. Nothing has moved.
        GraspFailed: the gripper holds nothing; it is open again, and the arm is before the body.
        CommandRejected: there is no such body, or it cannot be grasped by its shape; LimitError: a value outside its
            range.
        MotionAborted: a motion ended early.
    """
    check_gripper(gripper)
    task = _Task(arm, world, instance(body, str, "body"), approach, speed_mps, timeout, seed)
    where = task.world.pose(body)
    if candidates is None:
        candidates = sorted(
            grasps(world.shapes(body), opening=opening),
            key=lambda pose: round(float((where @ pose.pose).rotation[2, 2]), 3),  # -1: from above
        )
    for index, candidate in enumerate(candidates):
        instance(candidate, Grasp, f"candidates[{index}]")
    number, path = task.first_path([where @ pose.pose for pose in candidates], _before(task.approach))
    gripper.open()
    grasp = where @ candidates[number].pose
    arm.move(path)
    with task.contact():
        arm.move(lin(grasp, speed_mps=task.speed_mps))
        gripper.close()
        if not gripper.holds_something:
            gripper.open()
            arm.move(lin(_before(task.approach)(grasp), speed_mps=task.speed_mps))
            raise GraspFailed(
                f"the gripper holds nothing at {body}",
                history=arm.history(),
                hint="look where the body is, and place it in the world: world.place(body, pose)",
            )
        world.hold(body, arm.pose(FLANGE).inverse() @ where)
    with task.contact():  # it leaves what it was on
        arm.move(lin_rel(z=task.approach, frame=BASE, speed_mps=task.speed_mps))
    return candidates[number]


def place(
    arm: ArmVerbs,
    gripper: Gripper,
    body: str,
    at: Pose | Sequence[Pose],
    *,
    world: CollisionWorld,
    approach: float = APPROACH,
    speed_mps: float = LINE_SPEED,
    timeout: float = PATIENCE,
    seed: int = 0,
) -> Pose:
    """Place a body that the gripper holds: move around everything, put it down from above, open, and retreat.

    Args:
        arm: in control and at rest.
        gripper: that holds the body.
        body: as it was picked.
        at: pose of the body in the base, or several, of which the first one that can be reached is taken. It may touch
            there what it is put on.
        world: in which the arm holds the body; as in `pick`.
        approach: length of the straight lines, down and then back from the body [m], 0.01 to 0.5.
        speed_mps: speed on these lines [m/s].
        timeout: longest search for each path [s].
        seed: of the searches.

    Returns:
        Pose of the body where the gripper was opened, in the base, as it is in the world now.

    Raises:
        NoPath: no pose can be reached; the text has the reason of the first one. Nothing has moved.
        CommandRejected: the arm does not hold the body in the world; LimitError: a value outside its range.
        MotionAborted: a motion ended early.
    """
    check_gripper(gripper)
    task = _Task(arm, world, instance(body, str, "body"), approach, speed_mps, timeout, seed)
    poses = [at] if isinstance(at, Pose) else list(at)
    for index, pose in enumerate(poses):
        check_pose(pose, f"at[{index}]")
    on_flange = task.world.held(body)
    if on_flange is None:
        raise CommandRejected(
            f"the arm must hold {body} in the world before it places it",
            parameter="body",
            value=body,
            hint="pick it, or world.hold(body, pose in the flange frame)",
        )
    in_tool = arm.pose(TOOL, reference=FLANGE).inverse() @ on_flange
    targets = [pose @ in_tool.inverse() for pose in poses]
    number, path = task.first_path(targets, lambda pose: pose.shifted(z=task.approach))
    arm.move(path)
    with task.contact():
        arm.move(lin(targets[number], speed_mps=task.speed_mps))
    gripper.open()
    reached = arm.pose() @ in_tool
    world.place(body, reached)
    with task.contact():
        arm.move(lin_rel(z=-task.approach, speed_mps=task.speed_mps))
    return reached


def _before(distance: float) -> Callable[[Pose], Pose]:
    """From a pose of the tool frame to that before it, against the direction of its fingers."""
    return lambda pose: pose @ Pose.at(z=-distance)


@dataclass(frozen=True, slots=True)
class _Task:
    """What picking and placing have in common.

    Attributes:
        arm: in control.
        world: model of the bodies.
        body: that is picked or placed.
        approach: length of the straight lines [m].
        speed_mps: on them [m/s].
        timeout: longest search [s].
        seed: of the searches.
    """

    arm: ArmVerbs
    world: CollisionWorld
    body: str
    approach: float
    speed_mps: float
    timeout: float
    seed: int

    def __post_init__(self) -> None:
        if not isinstance(self.world, CollisionWorld):
            raise ShapeError(
                f"world must be a model of bodies, got {shown(self.world)}",
                parameter="world",
                value=self.world,
                hint='for example heptarm.CollisionModel("iiwa14", scene="bins")',
            )
        within(self.approach, "approach", 0.01, 0.5, unit="m")
        within(self.speed_mps, "speed_mps", 0.0, 2.0, above=True, unit="m/s")

    def _line_check(self) -> _LineCheck:
        """What checks a straight line in the world as it is now."""
        pairs = [(self.body, body) for body in self.world.bodies if body != self.body]
        return _LineCheck(self.body, self.world, self.world.allowing(pairs))

    @contextmanager
    def contact(self) -> Iterator[None]:
        """A block whose motions are checked while the body may touch anything."""
        before = self.arm.collision_check
        self.arm.collision_check = self._line_check()
        try:
            yield
        finally:
            self.arm.collision_check = before

    def first_path(self, targets: Sequence[Pose], start: Callable[[Pose], Pose]) -> tuple[int, Path]:
        """The first target that can be reached, and a path to where the straight line to it begins.

        Args:
            targets: poses of the tool frame.
            start: where the line to a target begins.

        Raises:
            NoPath: none can be reached.
        """
        reasons: list[NoPath] = []
        for number, target in enumerate(targets):
            try:
                path = self.arm.find_path(
                    start(target), avoid=self.world, timeout=self.timeout, seed=self.seed
                )
                self._check_line(path, target)
            except NoPath as error:
                reasons.append(error)
            else:
                return number, path
        if not reasons:
            raise NoPath(
                f"{self.body} has no grasp: it is too wide for the fingers, or no candidates are given",
                reason="goal",
                parameter="opening",
                hint="give a larger opening, or candidates",
            )
        first = reasons[0]
        raise NoPath(
            f"none of {len(reasons)} poses at {self.body} can be reached; of the first one: {first.text}",
            reason=first.reason,
            clearance=first.clearance,
            parameter="body",
            value=self.body,
            hint="move what is in the way, give other poses, or a smaller margin of the world",
        )

    def _check_line(self, path: Path, target: Pose) -> None:
        """Check the straight line from the end of a path to a target.

        Raises:
            NoPath: bodies are in the way, or the arm cannot follow it.
        """
        try:
            ahead = self.arm.plan(
                lin(target, near=path.end), start=path.end, collision_check=self._line_check()
            )
        except CommandRejected as error:
            raise NoPath(error.text, reason="approach", parameter="body") from None
        if ahead.collisions:
            worst = ahead.collisions[0].clearance
            raise NoPath(str(worst), reason="approach", clearance=worst, parameter="body")


@dataclass(frozen=True, slots=True)
class _LineCheck:
    """Checks a straight line on which a body is approached, or put down: it may touch, but not be inside anything.

    Attributes:
        body: its name.
        world: the model of the bodies.
        contact: the same, in which the body may touch anything.
    """

    body: str
    world: CollisionWorld
    contact: CollisionWorld

    def carrying(
        self,
        tool: KnownTool | None,
        workpiece: Workpiece | KnownTool | None = None,
        *,
        at: Pose | None = None,
    ) -> _LineCheck:
        """The same, of an arm that carries a tool and a workpiece."""
        carried = [world.carrying(tool, workpiece, at=at) for world in (self.world, self.contact)]
        return _LineCheck(self.body, *carried)

    def first_on(self, path: Array) -> TouchOnPath | None:
        """The first place at which other bodies touch, or the end, if the body is inside another one there."""
        touch = self.contact.first_on(path)
        if touch is not None:
            return touch
        for contact in self.world.touching(path[-1]):
            if self.body in (contact.first, contact.second) and contact.distance < -_ROUNDING:
                return TouchOnPath(contact, 1.0, path[-1])
        return None
