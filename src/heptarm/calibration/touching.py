"""TCP calibration by touch: where the tip of a tool is, from contacts with a plane or a sphere whose place is known.

In each contact the tip t in the flange frame is at a known distance from the surface, d(R_i t + p_i) = r, with the
radius r of the tip: least squares in three unknowns, linear for a plane. A flange that is tilted differently in each
contact shows the tip along another direction. Arm and tip are compliant under the force of a contact, so the place
of a contact is extrapolated to force zero from the states during the push.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from heptarm.arm.verbs import ArmVerbs
from heptarm.calibration.load_motion import recorded
from heptarm.calibration.proposal import agree, box_text, flange_box, swings
from heptarm.calibration.tip import TOLERANCE, TcpEstimate, checked_poses, estimate_of
from heptarm.errors import CommandRejected, MissingExtra, ShapeError, StaleState, Unreachable
from heptarm.model.inverse_kinematics import solve
from heptarm.model.kinematics import forward
from heptarm.skills.touch import touch
from heptarm.values.checks import Array, Value, array, frozen, instance, integer, shown, within
from heptarm.values.condition.contact import direction_of
from heptarm.values.frames import BASE
from heptarm.values.mode.mode import Position
from heptarm.values.motion.motion import Motion
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import Pose, check_pose
from heptarm.values.robot import RobotModel
from heptarm.values.state import State
from heptarm.values.text import lines

#: Fewest contacts, and their default number.
FEWEST_TOUCHES, TOUCHES = 5, 8
#: Defaults: force of a contact [N], speed of the approach [m/s], ceiling of the speed of other motions.
FORCE, APPROACH, SPEED = 6.0, 0.005, 0.2
#: By how much the flange is tilted, and room that is left to the limits of the joints, which an approach needs [rad].
_TILT, _ROOM = math.radians(25.0), math.radians(5.0)
#: Distance of the tip from the surface at the start [m], and how much farther it is looked for.
_NEAREST, _FARTHEST, _BEYOND = 0.002, 0.05, 0.01
#: Part of the force from which on a state belongs to the push.
_PUSHING = 0.15
#: Distance before the end of an approach up to which nothing was touched [m], and fewest states of a push.
_BEFORE, _FEWEST_PUSHES = 0.001, 3
#: Steps of the least squares, and when they end [m].
_STEPS, _DONE = 50, 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class KnownSurface(Value):
    """A surface that a tip touches, and whose place is known; make one with `plane` or `sphere`.

    Attributes:
        place: a point of the plane, or the centre of the sphere, in the base, shape (3,) [m].
        normal: unit vector out of the plane, shape (3,); zeros: it is a sphere.
        radius: of the sphere [m]; 0: it is a plane.
        sigma: standard deviation of where the surface is along its normal [m].
    """

    place: Array
    normal: Array
    radius: float
    sigma: float

    @staticmethod
    def plane(
        place: npt.ArrayLike, normal: str | npt.ArrayLike = "z", *, sigma: float = 1e-4
    ) -> KnownSurface:
        """A plane.

        Args:
            place: one of its points, in the base, shape (3,) [m].
            normal: out of the surface: an axis of the base such as "z", or a vector, shape (3,).
            sigma: standard deviation of where it is along its normal [m].
        """
        known = within(sigma, "sigma", 0.0, 0.1, unit="m")
        return KnownSurface(array(place, 3, "place"), direction_of(normal), 0.0, known)

    @staticmethod
    def sphere(centre: npt.ArrayLike, radius: float, *, sigma: float = 1e-4) -> KnownSurface:
        """A sphere that is touched from outside.

        Args:
            centre: in the base, shape (3,) [m].
            radius: [m].
            sigma: standard deviation of where its surface is [m].
        """
        size = within(radius, "radius", 0.0, 1.0, above=True, unit="m")
        known = within(sigma, "sigma", 0.0, 0.1, unit="m")
        return KnownSurface(array(centre, 3, "centre"), frozen(np.zeros(3)), size, known)

    @staticmethod
    def parse(text: str) -> KnownSurface:
        """A level plane "plane:X,Y,Z" or a sphere "sphere:X,Y,Z,RADIUS", in the base [m].

        Raises:
            CommandRejected: it is neither. LimitError: a number outside its range.
        """
        kind, _, rest = instance(text, str, "surface").partition(":")
        try:
            given = [float(part) for part in rest.split(",")]
        except ValueError:
            given = []
        if (kind, len(given)) not in (("plane", 3), ("sphere", 4)):
            raise CommandRejected(
                f"surface must be plane:X,Y,Z or sphere:X,Y,Z,RADIUS in metres, got {shown(text)}",
                parameter="surface",
                value=text,
                hint="for example plane:0.6,0,0.2",
            )
        return KnownSurface.plane(given) if kind == "plane" else KnownSurface.sphere(given[:3], given[3])

    def __str__(self) -> str:
        """Kind and place."""
        at = ", ".join(f"{one:.3f}" for one in self.place)
        if self.radius:
            return f"sphere of {1e3 * self.radius:g} mm radius at ({at}) m"
        return f"plane at ({at}) m, normal ({', '.join(f'{one:.2f}' for one in self.normal)})"

    def nearness(self, points: Array) -> tuple[Array, Array]:
        """Distances of points from the surface, shape (n,) [m], and its normals there, shape (n, 3)."""
        off = points - self.place
        if not self.radius:
            return off @ self.normal, np.broadcast_to(self.normal, points.shape)
        far = np.linalg.norm(off, axis=1)
        return far - self.radius, off / np.maximum(far, 1e-9)[:, None]


def estimate_touched_tcp(
    flanges: Sequence[Pose],
    surface: KnownSurface,
    *,
    guess: Pose,
    tip_radius: float = 0.0,
    tolerance: float = TOLERANCE,
) -> TcpEstimate:
    """Compute the tip of a tool from poses of the flange in which it touches a known surface. Nothing moves.

    Args:
        flanges: poses of the flange in the base, five or more, tilted about different axes.
        surface: that is touched.
        guess: flange to tip, roughly; its orientation becomes that of the result.
        tip_radius: radius of a round tip, whose middle is found [m]; 0: it is a point.
        tolerance: the most by which a contact may miss the surface [m].

    Returns:
        The tip; `point` is the mean of the places where it was, `sigma` counts the surface's own.

    Raises:
        ShapeError: too few poses, or wrong types.
        CommandRejected: the poses differ too little, or a contact misses the surface; the text names it.
        LimitError: a value outside its range.
    """
    given = checked_poses(flanges, "flanges", FEWEST_TOUCHES, "touch the surface with the flange tilted")
    instance(surface, KnownSurface, "surface", hint="KnownSurface.plane(...) or KnownSurface.sphere(...)")
    check_pose(guess, "guess")
    size = within(tip_radius, "tip_radius", 0.0, 0.5, unit="m")
    allowed = within(tolerance, "tolerance", 0.0, 0.1, above=True, unit="m")
    turns, places = np.array([one.rotation for one in given]), np.array([one.xyz for one in given])
    tip = np.array(guess.xyz)
    for _ in range(_STEPS):
        far, normals = surface.nearness(turns @ tip + places)
        matrix = np.einsum("nij,ni->nj", turns, normals)
        step = np.linalg.lstsq(matrix, size - far, rcond=None)[0]
        tip = tip + step
        if np.abs(step).max() < _DONE:
            break
    at = turns @ tip + places
    missed = (surface.nearness(at)[0] - size)[:, None]
    return estimate_of(
        Pose.of(tip, guess.quat),
        at.mean(axis=0),
        matrix,
        missed,
        tolerance=allowed,
        fewest=FEWEST_TOUCHES,
        common=surface.sigma,
        what="contact",
    )


# ----------------------------------------------------------------------------------------- with an arm


@dataclass(frozen=True, slots=True, eq=False)
class TouchPlan(Value):
    """What moves when a tip is measured by touch; nothing has moved yet.

    Attributes:
        robot: the robot.
        surface: that is touched.
        direction: of the approaches, in the base, shape (3,).
        guess: flange to tip, roughly.
        tip_radius: [m].
        postures: joint positions from which it is touched, shape (n, 7) [rad].
        start: where the arm rests, shape (7,) [rad].
        distance: of the longest approach [m].
        force: at which an approach ends [N].
        speed: of other motions, a fraction of each axis' maximum.
        speed_mps: of the approaches [m/s].
        low: lowest coordinates of the flange in the postures, base frame, shape (3,) [m].
        high: highest ones, shape (3,) [m].
    """

    robot: RobotModel
    surface: KnownSurface
    direction: Array
    guess: Pose
    tip_radius: float
    postures: Array
    start: Array
    distance: float
    force: float
    speed: float
    speed_mps: float
    low: Array
    high: Array

    @property
    def motions(self) -> tuple[Motion, ...]:
        """The motions between the contacts, back to the start at last."""
        return tuple(ptp(q) for q in (*self.postures, self.start))

    def __str__(self) -> str:
        """What moves, what it touches, with what force, and how fast."""
        rows = {
            "moves": f"{swings(self.postures, self.start)} deg",
            "flange": f"in the postures {box_text(self.low, self.high)}; the tip stays over one place",
            "touches": f"{self.surface}: {len(self.postures)} times, each within {1e3 * self.distance:.0f} mm",
            "force": f"{self.force:g} N end an approach",
            "speed": f"{1e3 * self.speed_mps:g} mm/s in an approach, otherwise at most {self.speed:.0%}",
        }
        return lines(f"Touch with the tool of the {self.robot.title}", rows)


def touch_plan(
    arm: ArmVerbs,
    surface: KnownSurface,
    *,
    guess: Pose | None = None,
    tip_radius: float = 0.0,
    touches: int = TOUCHES,
    force: float = FORCE,
    speed: float = SPEED,
    speed_mps: float = APPROACH,
) -> TouchPlan:
    """Plan how to measure a tip by touch, from where the arm rests. Nothing moves.

    Begin with the tip 2 to 50 mm over the surface. The flange is tilted by 25 degrees about different axes, about the
    tip. The ways between are planned and checked as `arm.plan` does, against `arm.workspace` and by
    `arm.collision_check`; postures that cannot be reached so are left out.

    Args:
        arm: connected, at rest.
        surface: see `KnownSurface`.
        guess: flange to tip within some millimetres; None: the motion frame.
        tip_radius: radius of a round tip, whose middle is found [m]; 0: it is a point.
        touches: number of contacts.
        force: at which an approach ends [N].
        speed: ceiling of the other motions, (0, 1]; the lower one of this and `arm.speed`.
        speed_mps: speed of the approaches [m/s]; the slower, the better known is the place of a contact.

    Raises:
        CommandRejected: the tip is not near the surface, or too few postures can be reached.
        LimitError: a value outside its range. ShapeError: wrong types.
        ModeConflict: a motion runs.
    """
    robot = instance(arm, ArmVerbs, "arm").robot
    instance(surface, KnownSurface, "surface", hint="KnownSurface.plane(...) or KnownSurface.sphere(...)")
    count = integer(touches, "touches", FEWEST_TOUCHES, 100)
    size = within(tip_radius, "tip_radius", 0.0, 0.5, unit="m")
    push = within(force, "force", 0.5, 100.0, unit="N")
    limit = min(within(speed, "speed", 0.0, 1.0, above=True), arm.speed)
    slow = within(speed_mps, "speed_mps", 0.0, 0.1, above=True, unit="m/s")
    start = np.asarray(arm.state.q_cmd)
    flange = Pose.from_matrix(forward(robot, start))
    if guess is not None:
        check_pose(guess, "guess")
    rough = flange.inverse() @ arm.state.pose if guess is None else guess
    tip = flange @ rough
    far, normals = surface.nearness(tip.xyz[None])
    height, normal = float(far[0]) - size, normals[0]
    if not _NEAREST <= height <= _FARTHEST:
        raise CommandRejected(
            f"the tip must be {1e3 * _NEAREST:g} to {1e3 * _FARTHEST:g} mm over the {surface}, got "
            f"{1e3 * height:.1f} mm",
            parameter="surface",
            value=height,
            allowed=f"[{_NEAREST:g}, {_FARTHEST:g}] m",
            hint="move the tip over the surface, and check guess, the tool's frame, and the place of the surface",
        )
    beside = np.linalg.svd(normal[None])[2][1:]
    angles = 2.0 * math.pi * np.arange(count - 1) / (count - 1)
    tilts = [
        np.zeros(3),
        *(_TILT * (math.cos(one) * beside[0] + math.sin(one) * beside[1]) for one in angles),
    ]
    postures = list[Array]()
    for tilt in tilts:
        turned = Pose.from_rotvec((0, 0, 0), tilt) @ Pose.of((0, 0, 0), flange.quat)
        goal = Pose.of(tip.xyz - turned.rotation @ rough.xyz, turned.quat)
        q = _reached(arm, goal, postures[-1] if postures else start, start, limit)
        if q is not None:
            postures.append(q)
    if len(postures) < FEWEST_TOUCHES:
        raise CommandRejected(
            f"{len(postures)} of {count} postures can be reached without a collision, and {FEWEST_TOUCHES} are needed",
            parameter="arm",
            hint="begin with more room around the tool, farther from the limits of the joints",
        )
    box = flange_box(robot, postures)
    return TouchPlan(
        robot,
        surface,
        frozen(-normal),
        rough,
        size,
        frozen(np.array(postures)),
        frozen(start),
        height + _BEYOND,
        push,
        limit,
        slow,
        *box,
    )


def _reached(arm: ArmVerbs, goal: Pose, before: Array, start: Array, speed: float) -> Array | None:
    """Joint positions of a flange that the arm can move to; None: there are none."""
    try:
        q = solve(arm.robot, goal, near=start)
        if (q < arm.robot.q_min + _ROOM).any() or (q > arm.robot.q_max - _ROOM).any():
            return None
        preview = arm.plan(ptp(q), start=before, speed=speed, mode=Position(), step=0.05)
    except MissingExtra:
        if arm.workspace is not None or arm.collision_check is not None:
            raise
        return q
    except (Unreachable, CommandRejected):
        return None
    return None if preview.collisions else q


def touch_tcp(
    arm: ArmVerbs,
    surface: KnownSurface | None = None,
    *,
    plan: TouchPlan | None = None,
    confirm: Callable[[TouchPlan], bool] | None = None,
    tolerance: float = TOLERANCE,
    progress: Callable[[int, int], object] | None = None,
) -> TcpEstimate:
    """Measure where the tip of a tool is by touching a known surface. The arm moves, and returns.

    What moves is logged, and shown to `confirm`, before it moves. The tool in use stays: the estimate becomes a tool by
    `to_tool` or `save`.

    Args:
        arm: in control, at rest, in position control.
        surface: see `touch_plan`; its defaults are used.
        plan: instead of a surface, what moves.
        confirm: called with the plan; nothing moves unless it returns true. None: it moves.
        tolerance: the most by which a contact may miss the surface [m].
        progress: called after each contact with their number and that of all.

    Raises:
        CommandRejected: it was not confirmed; the plan begins elsewhere; a contact contradicts the others.
        NoContact: nothing was touched; the arm stays where the approach ended.
        StaleState: the subscribed groups lack "joints", "pose" or "wrench".
        MotionAborted: a stop or an error ended it. Others as `arm.move` and `touch_plan`.
    """
    missing = {"joints", "pose", "wrench"} - set(instance(arm, ArmVerbs, "arm").groups)
    if arm.state_rate <= 0 or missing:
        raise StaleState(
            'measuring a tip by touch needs the state groups "joints", "pose" and "wrench"',
            hint='arm.subscribe(rate=500, groups=(..., "joints", "pose", "wrench"))',
        )
    if (plan is None) == (surface is None):
        raise ShapeError(
            "either a surface or a plan must be given, got both or none",
            parameter="surface",
            hint="give one of them",
        )
    arm.wait_for_rest()
    if plan is None:
        made = touch_plan(arm, instance(surface, KnownSurface, "surface"))
    else:
        made = instance(plan, TouchPlan, "plan")
    if np.abs(arm.state.q_cmd - made.start).max() > math.radians(1.0):
        raise CommandRejected(
            "the plan begins where the arm does not rest any more",
            parameter="plan",
            hint="make a new one with calibration.touch_plan(arm, surface)",
        )
    agree(made, confirm, "touching with the tool")
    contacts = list[tuple[Pose, float]]()
    for q in made.postures:
        arm.move(ptp(q), speed=made.speed, mode=Position())
        contacts.append(_contact(arm, made))
        if progress is not None:
            progress(len(contacts), len(made.postures))
    arm.move(ptp(made.start), speed=made.speed, mode=Position())
    flanges, softness = zip(*contacts, strict=True)
    sigma = math.hypot(made.surface.sigma, float(np.mean(softness)))
    return estimate_touched_tcp(
        flanges,
        replace(made.surface, sigma=sigma),
        guess=made.guess,
        tip_radius=made.tip_radius,
        tolerance=tolerance,
    )


def _contact(arm: ArmVerbs, plan: TouchPlan) -> tuple[Pose, float]:
    """Touch once, and return over the surface; see `at_no_force`."""
    with recorded(arm) as states:
        found = touch(
            arm,
            plan.direction,
            distance=plan.distance,
            force=plan.force,
            frame=BASE,
            speed_mps=plan.speed_mps,
            retreat=plan.distance - _BEYOND,
            mode=Position(),
        )
    fired = found.result.fired_at
    until = states[-1].stamp if fired is None else fired.stamp
    approach = [one for one in states if one.stamp <= until]
    return at_no_force(arm.robot, approach, direction=plan.direction, force=plan.force)


def at_no_force(
    robot: RobotModel, states: Sequence[State], *, direction: Array, force: float
) -> tuple[Pose, float]:
    """Extrapolate the pose of the flange to the beginning of a contact.

    A force that begins to grow with the square of the way is between what an elastic arm shows on a hard surface, a
    linear one, and what a compliant surface shows; their difference is how little that is known.

    Args:
        robot: the robot.
        states: of an approach until the force was reached.
        direction: of the approach in the base, shape (3,).
        force: that was reached [N].

    Returns:
        The pose of the flange, and the standard deviation of its place along the direction [m].
    """
    rows = [one for one in states if one.groups.joints is not None and one.groups.wrench is not None]
    flanges = np.array([forward(robot, one.q) for one in rows])
    travel = (flanges[:, :3, 3] - flanges[0, :3, 3]) @ direction
    push = -np.array([one.wrench.force for one in rows]) @ direction
    push -= push[travel <= max(travel[-1] - _BEFORE, travel[0])].mean()
    quiet = np.flatnonzero(push < _PUSHING * force)
    begin = min(int(quiet[-1]) + 1 if len(quiet) else 0, len(rows) - 1)
    turn, place = flanges[begin, :3, :3], flanges[begin, :3, 3]
    if len(rows) - begin < _FEWEST_PUSHES:
        return Pose.from_matrix(np.column_stack([turn, place])), float(travel[-1] - travel[begin - 1])
    linear, square, cubic = (
        float(np.polyfit(push[begin:] ** (1.0 / power), travel[begin:], 1)[1]) for power in (1, 2, 3)
    )
    contact = place + (square - travel[begin]) * direction
    return Pose.from_matrix(np.column_stack([turn, contact])), abs(linear - cubic)
