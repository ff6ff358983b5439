"""Insertion: press a part onto a surface, search for the hole, and push the part in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from heptarm.arm.verbs import ArmVerbs
from heptarm.errors import InsertionFailed, MotionAborted, ShapeError, Timeout
from heptarm.skills.grasping import PATIENCE
from heptarm.values.checks import Array, Value, instance, within
from heptarm.values.clearance import CollisionWorld
from heptarm.values.condition.contact import axis_of
from heptarm.values.condition.force import force as force_signal
from heptarm.values.frames import TOOL, check_name
from heptarm.values.mode.compliance import pressing
from heptarm.values.mode.impedance import STIFFEST
from heptarm.values.motion.line import lin_rel
from heptarm.values.motion.ptp import ptp
from heptarm.values.motion.search import Spiral, spiral
from heptarm.values.motion.spline import spline
from heptarm.values.pose import Pose, check_pose
from heptarm.values.result import Cause
from heptarm.values.state import State
from heptarm.values.text import fixed, lines

if TYPE_CHECKING:
    from heptarm.arm.motion.handle import MotionHandle
    from heptarm.values.mode.impedance import CartesianImpedance

#: Default of the search: for a hole within 3 mm.
SEARCH = spiral(0.003)
#: Stiffness across the direction while the hole is looked for, and while the part goes in [N/m].
SEARCHING, CENTRING = 3000.0, 800.0
#: Stiffness along the direction while the part goes in [N/m]; the force is limited.
PUSHING = 2000.0
#: A part that is so much deeper than the surface has found the hole [m].
SUNK = 1.5e-3
#: A part that finds the hole falls by so much of the depth, until the spring along the direction balances the force.
SINKING = 0.3
#: Speeds of the approach and of pushing in [m/s].
APPROACH, PUSH = 0.02, 0.02
#: The depth counts as reached when so little is missing [m].
_NEARLY = 5e-4
#: The arm pushes this much beyond the depth, against the spring of the direction [m].
_BEYOND = 2e-3
_STRONGEST = 100.0


@dataclass(frozen=True, slots=True, eq=False)
class Insertion(Value):
    """How a part went into its hole.

    Attributes:
        depth: how deep it is behind the surface [m].
        offset: from where it first touched the surface to where the hole is, across the direction: base axes,
            shape (3,) [m].
        pose: of the motion frame at the end, in the base.
        duration: from the first contact to the end, by the robot's clock [s].
        searched: whether the hole had to be searched; otherwise the part went straight into it.
    """

    depth: float
    offset: Array
    pose: Pose
    duration: float
    searched: bool

    def __str__(self) -> str:
        """A few lines with units."""
        rows = {
            "depth": f"{fixed(self.depth * 1e3, 1)} mm",
            "offset": f"{' '.join(fixed(length * 1e3, 2) for length in self.offset)} mm",
            "pose": str(self.pose),
            "duration": f"{fixed(self.duration, 2)} s",
            "searched": "yes" if self.searched else "no",
        }
        return lines("Insertion", rows)


def insert(
    arm: ArmVerbs,
    direction: str = "z",
    *,
    depth: float,
    force: float = 8.0,
    search: Spiral = SEARCH,
    distance: float = 0.02,
    frame: str = TOOL,
    timeout: float = 60.0,
    before: Pose | None = None,
    world: CollisionWorld | None = None,
) -> Insertion:
    """Insert a part: approach the surface, search the hole with a spiral under force, push the part in.

    The arm is compliant (Cartesian impedance) from the approach to the end, so that a wall cannot jam it. Afterwards
    the part is still in the gripper and the arm at rest.

    The hole is found when the part sinks. Where the part meets no surface within `distance`, it counts as in the hole
    already, and its depth counts from there.

    Args:
        arm: in control, the part before the hole.
        direction: of the insertion: an axis of the frame, such as "z" or "-x".
        depth: how deep to insert it behind the surface [m].
        force: with which it is pressed onto the surface and pushed in [N], up to 100.
        search: pattern of the search, across the direction; see `heptarm.spiral`.
        distance: largest distance to the surface [m].
        frame: whose axes: "tool" (the motion frame's own), "base", or the name of a frame.
        timeout: longest time for the search, and for pushing [s].
        before: pose of the motion frame before the hole, to which the arm moves first; None: it is there.
        world: model of the bodies around which it moves there, such as a `heptarm.CollisionModel`; None: it moves there
            by a PTP. What is inserted touches what it has to: the rest is not checked against it.

    Returns:
        Depth, offset and pose of the part.

    Raises:
        NoPath: there is no way to `before`; nothing has moved.
        ShapeError: a world without `before`, or wrong types.
        InsertionFailed: the hole was not found within the pattern or in time, or the part got stuck.
        MotionAborted: a motion ended early.
        LimitError: a value outside its range.
    """
    axis = axis_of(direction)
    instance(search, Spiral, "search", hint="make one with heptarm.spiral(radius)")
    if world is not None and before is None:
        raise ShapeError(
            "world is that around which the arm moves to `before`, but this is not given",
            parameter="before",
            value=before,
            hint="give before=, the pose of the motion frame before the hole, or leave out world",
        )
    task = _Insertion(
        arm,
        direction,
        axis,
        check_name(frame, "frame"),
        depth=within(depth, "depth", 2.0 * SUNK / SINKING, 0.5, unit="m"),
        force=within(force, "force", 0.0, _STRONGEST, above=True, unit="N"),
        distance=within(distance, "distance", 0.0, 0.5, above=True, unit="m"),
        timeout=within(timeout, "timeout", 0.0, 1e6, above=True, unit="s"),
    )
    if before is not None:
        check_pose(before, "before")
        arm.move(ptp(before) if world is None else arm.find_path(before, avoid=world, timeout=PATIENCE))
    return task.run(search)


@dataclass(frozen=True, slots=True)
class _Insertion:
    """One insertion.

    Attributes:
        arm: in control.
        direction: name of the axis.
        axis: unit vector in the axes of the frame, shape (3,).
        frame: name of the frame.
        depth: behind the surface [m].
        force: [N].
        distance: largest to the surface [m].
        timeout: of the search, and of pushing [s].
    """

    arm: ArmVerbs
    direction: str
    axis: Array
    frame: str
    depth: float
    force: float
    distance: float
    timeout: float

    def run(self, search: Spiral) -> Insertion:
        """Approach, search, push."""
        start = self.arm.wait_for_rest()
        axes = self.arm.pose(self.frame, state=start).rotation
        along: Array = axes @ self.axis
        first = self._approach()
        ahead = float((first.pose.xyz - start.pose.xyz) @ along)
        is_found = ahead > self.distance + SUNK
        origin = Pose.of(start.pose.xyz + self.distance * along, start.pose.quat) if is_found else first.pose
        if not is_found:
            self._search(search, origin, along, axes)
        end = self._push(origin, along)
        reached = float((end.pose.xyz - origin.xyz) @ along)
        offset: Array = end.pose.xyz - origin.xyz - reached * along
        return Insertion(reached, offset, end.pose, (end.stamp - first.stamp) * 1e-9, not is_found)

    def _approach(self) -> State:
        """Move until the part touches something, at the latest where it is inserted; the state at rest there."""
        contact = force_signal(frame=self.frame).normal(self.direction[-1]) > 0.5 * self.force
        step = (self.distance + self.depth) * self.axis
        self.arm.move(
            lin_rel(*step.tolist(), frame=self.frame, speed_mps=APPROACH),
            mode=pressing(self.direction, 0.0, frame=self.frame, along=SEARCHING),
            until=contact,
        )
        return self.arm.wait_for_rest()

    def _search(self, search: Spiral, origin: Pose, along: Array, axes: Array) -> None:
        """Press, and move along the spiral until the part sinks."""
        across = axes[:, self.axis == 0.0]
        places = origin.xyz + search.points @ across.T
        motion = spline([Pose.of(place, origin.quat) for place in places], speed_mps=search.speed_mps)
        spring = min(self.force / (SINKING * self.depth), STIFFEST[0])  # ends the fall into the hole
        mode = pressing(self.direction, self.force, frame=self.frame, stiffness=SEARCHING, along=spring)
        handle = self.arm.start(motion, mode=mode)
        state = self._follow(handle, lambda seen: float((seen.pose.xyz - origin.xyz) @ along) > SUNK)
        deep = float((state.pose.xyz - origin.xyz) @ along)
        if deep <= SUNK:
            raise InsertionFailed(
                f"no hole within {search.radius * 1e3:g} mm of the first contact",
                depth=deep,
                history=self.arm.history(),
                hint="check where the part touched; give the search a larger radius, or a smaller pitch",
            )

    def _push(self, origin: Pose, along: Array) -> State:
        """Push the part in, compliant across the direction; the state at the end."""

        def missing(seen: State) -> float:
            return self.depth - float((seen.pose.xyz - origin.xyz) @ along)

        step = max(0.0, missing(self.arm.wait_for_rest()) + _BEYOND) * self.axis
        handle = self.arm.start(
            lin_rel(*step.tolist(), frame=self.frame, speed_mps=PUSH),
            mode=self._pushing(),
        )
        state = self._follow(handle, lambda seen: missing(seen) <= 0.0)
        if missing(state) > _NEARLY:
            reached = self.depth - missing(state)
            raise InsertionFailed(
                f"the part is stuck at a depth of {reached * 1e3:.1f} mm, commanded {self.depth * 1e3:.1f} mm",
                depth=reached,
                history=self.arm.history(),
                hint="raise the force, or check the orientation of the part and the depth of the hole",
            )
        return state

    def _pushing(self) -> CartesianImpedance:
        """Mode that moves the part to its depth, with the force as its limit, and is compliant across."""
        springs = pressing(self.direction, 0.0, frame=self.frame, stiffness=CENTRING, along=PUSHING)
        limits = np.full(6, np.nan)
        limits[:3][self.axis != 0.0] = self.force
        return replace(springs, max_force=limits)

    def _follow(self, handle: MotionHandle, is_enough: Callable[[State], bool]) -> State:
        """Wait until a state is enough or the motion ends; then let the arm rest, still compliant.

        The result is the state at rest.
        """
        try:
            self.arm.wait_until(lambda seen: handle.done or is_enough(seen), timeout=self.timeout)
        except Timeout:
            pass
        finally:
            handle.cancel()
        result = handle.wait(timeout=self.timeout)
        if result.cause not in (Cause.FINISHED, Cause.CANCELLED):
            raise MotionAborted(f"the insertion ended early: {result.cause.value}", result=result)
        return self.arm.wait_for_rest()
