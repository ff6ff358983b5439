"""The boundary of a workspace: whether joint positions, poses and velocities stay inside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from heptarm.errors import OutsideWorkspace
from heptarm.model.kinematics import forward
from heptarm.values.checks import Array
from heptarm.values.frames import BASE
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel
from heptarm.values.workspace import Workspace

#: So far outside is inside: rounding, and the last step of a stream along a wall [m], [rad].
TOLERANCE = 1e-3
#: Halvings that find the last place inside between two joint positions.
_HALVINGS = 12
_AXES = ("x", "y", "z")


@dataclass(frozen=True, slots=True)
class Boundary:
    """A workspace applied to one robot with one tool.

    Attributes:
        workspace: where the tool and the joints may be.
        robot: the robot.
        frame: pose of the workspace's frame in the base.
        tip: pose of the tool frame in the flange frame.
    """

    workspace: Workspace
    robot: RobotModel
    frame: Pose
    tip: Pose

    @property
    def q_min(self) -> Array:
        """Lowest joint positions, shape (7,) [rad]."""
        joints = self.workspace.joints
        return self.robot.q_min if joints is None else np.maximum(self.robot.q_min, joints[0])

    @property
    def q_max(self) -> Array:
        """Highest joint positions, shape (7,) [rad]."""
        joints = self.workspace.joints
        return self.robot.q_max if joints is None else np.minimum(self.robot.q_max, joints[1])

    @property
    def refuses(self) -> bool:
        """Whether targets outside are refused instead of clamped."""
        return self.workspace.mode == "refuse"

    # ------------------------------------------------------------------------------------- where

    def tool(self, q: Array) -> Array:
        """Origin of the tool frame in the base at joint positions, shape (3,) [m]."""
        flange = forward(self.robot, q)
        return np.asarray(flange[:3, :3] @ self.tip.xyz + flange[:3, 3])

    def place(self, point: Array) -> Array:
        """A point of the base in the frame of the box, shape (3,) [m]."""
        return np.asarray(self.frame.rotation.T @ (point - self.frame.xyz))

    def walls(self, point: Array) -> tuple[Array, Array]:
        """Distances of a point of the base to the lower and the upper walls, shape (3,) each [m]; negative: outside."""
        box = self.workspace.box
        if box is None:
            return np.full(3, np.inf), np.full(3, np.inf)
        place = self.place(point)
        return place - box[0], box[1] - place

    def outside(self, point: Array) -> float:
        """How far a point of the base is outside of the box [m]; 0 inside."""
        below, above = self.walls(point)
        return float(max(0.0, -below.min(), -above.min()))

    def excess(self, q: Array) -> float:
        """How far joint positions are outside: the larger one of the box [m] and the joints [rad]; 0 inside."""
        joints = self.workspace.joints
        beyond = 0.0 if joints is None else float(max(0.0, (joints[0] - q).max(), (q - joints[1]).max()))
        return max(beyond, 0.0 if self.workspace.box is None else self.outside(self.tool(q)))

    # ----------------------------------------------------------------------------------- clamping

    def clamped_point(self, point: Array) -> Array:
        """The nearest point of the box, in the base, shape (3,) [m]."""
        box = self.workspace.box
        if box is None:
            return point
        return np.asarray(self.frame.rotation @ np.clip(self.place(point), box[0], box[1]) + self.frame.xyz)

    def clamped(self, q: Array, last: Array) -> Array:
        """The last joint positions inside on the straight joint path from `last`, shape (7,) [rad].

        Args:
            q: the target, shape (7,) [rad].
            last: the target before; where it is outside itself, a target that is not farther outside passes.
        """
        joints = self.workspace.joints
        if joints is not None:
            q = np.clip(q, np.minimum(joints[0], last), np.maximum(joints[1], last))
        allowed = max(self.excess(last), TOLERANCE)
        if self.excess(q) <= allowed:
            return q
        low, high = 0.0, 1.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            inside = self.excess(last + middle * (q - last)) <= allowed
            low, high = (middle, high) if inside else (low, middle)
        return np.asarray(last + low * (q - last))

    # ------------------------------------------------------------------------------------ refusal

    def refusal(self, q: Array, what: str, *, parameter: str) -> OutsideWorkspace:
        """The error for joint positions outside.

        Args:
            q: joint positions, shape (7,) [rad].
            what: what would be there, such as "the target".
            parameter: that is refused.
        """
        joints = self.workspace.joints
        if joints is not None:
            beyond = np.maximum(joints[0] - q, q - joints[1])
            axis = int(beyond.argmax())
            if beyond[axis] > 0.0:
                low, high, value = np.degrees([joints[0][axis], joints[1][axis], q[axis]])
                return _refusal(what, parameter, f"A{axis + 1}", value, f"[{low:.1f}, {high:.1f}] deg", "deg")
        return self.refusal_of_point(self.tool(q), what, parameter=parameter)

    def refusal_of_point(self, point: Array, what: str, *, parameter: str) -> OutsideWorkspace:
        """The error for a point of the base outside of the box; arguments as `refusal`."""
        box = self.workspace.box
        assert box is not None
        place = self.place(point)
        axis = int(np.maximum(box[0] - place, place - box[1]).argmax())
        frame = self.workspace.frame
        where = f"the tool's {_AXES[axis]} in {'the base' if frame == BASE else frame}"
        return _refusal(what, parameter, where, place[axis], f"[{box[0][axis]:g}, {box[1][axis]:g}] m", "m")


def _refusal(
    what: str, parameter: str, where: str, value: float, allowed: str, unit: str
) -> OutsideWorkspace:
    return OutsideWorkspace(
        f"{what} leaves arm.workspace: {where} must be in {allowed}, got {value:.4g} {unit}",
        code=2,
        parameter=parameter,
        value=float(value),
        allowed=allowed,
        hint="stay inside, or change arm.workspace, which is a check of this program and no safety function",
    )
