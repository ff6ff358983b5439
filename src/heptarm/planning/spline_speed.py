"""How fast a joint spline may go: within the limits of the joints, their torques, and a speed of the tool frame.

The planner of the controller knows the limits of the joints alone. The others are met by lower fractions of those,
which the cabinet gets with the spline: of the speed for the tool frame, of the acceleration for the torques.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from heptarm.errors import NoPath
from heptarm.model.batch import forward_batch
from heptarm.model.dynamics import inverse_dynamics_rows
from heptarm.planning.lookahead import PlanSamples
from heptarm.planning.plan import Plan
from heptarm.planning.planner import plan
from heptarm.planning.seam import JointDynamics, JointSpline, Ptp
from heptarm.values.checks import Array
from heptarm.values.motion.dynamics import DEFAULT, Dynamics
from heptarm.values.pose import Pose
from heptarm.values.robot import Body, RobotModel

#: Fraction of a limit that is aimed for, and rounds in which it is met.
_AIM, _ROUNDS = 0.98, 30
#: Time between two samples of a spline [s].
_STEP = 0.01


@dataclass(frozen=True, slots=True)
class SpeedLimits:
    """What bounds the speed along a spline besides the limits of the joints.

    Attributes:
        speed: fraction of each joint's maximum for which the duration is computed, (0, 1].
        tcp_speed: of the origin of the tool frame [m/s]; infinite: any.
        tcp: pose of the tool frame in the flange frame.
        load: on the flange; None: torques are not looked at.
    """

    speed: float
    tcp_speed: float
    tcp: Pose
    load: Body | None

    def time(self, robot: RobotModel, points: Array) -> tuple[float, Dynamics]:
        """Duration of a spline through points at the speed [s], and dynamics with which limits are kept at any speed.

        The dynamics are those of full speed, since the arm may move along the spline at another speed than this one.

        Args:
            robot: the robot.
            points: joint positions, its start among them, shape (n, 7) [rad].

        Raises:
            PlanError: the spline leaves the limits of the joints.
            NoPath: the load is too heavy for the torques at rest.
        """
        if self.load is None and self.tcp_speed == inf:
            planned = _planned(robot, points, self.speed, 1.0)
            return (0.0 if planned.path is None else planned.duration), DEFAULT
        speed, acceleration = 1.0, 1.0
        for _ in range(_ROUNDS):
            planned = _planned(robot, points, speed, acceleration)
            if planned.path is None:
                return 0.0, DEFAULT
            samples = PlanSamples.of(planned, _STEP)
            slower = self.tcp_speed / max(self._fastest(robot, samples), 1e-9)
            weaker = inf if self.load is None else _torque_factor(robot, samples, self.load)
            if min(slower, weaker) >= 1.0:
                break
            speed *= min(1.0, _AIM * slower)
            acceleration *= min(1.0, _AIM * weaker)
        if self.speed < speed:
            planned = _planned(robot, points, self.speed, acceleration)
        return planned.duration, _dynamics(speed, acceleration)

    def _fastest(self, robot: RobotModel, samples: PlanSamples) -> float:
        """Largest speed of the origin of the tool frame between two samples [m/s]."""
        frames = forward_batch(robot, samples.q)
        places = frames[:, :3, 3] + frames[:, :3, :3] @ self.tcp.xyz
        return float((np.linalg.norm(np.diff(places, axis=0), axis=1) / np.diff(samples.t)).max())


def _torque_factor(robot: RobotModel, samples: PlanSamples, load: Body) -> float:
    """Factor of what is not gravity with which the torques are at their limits at the worst place.

    Raises:
        NoPath: gravity alone exceeds them.
    """
    still = np.zeros_like(samples.q)
    torques, weight = (
        np.abs(inverse_dynamics_rows(robot, samples.q, dq, ddq, load=load)) / robot.tau_max
        for dq, ddq in ((samples.dq, samples.ddq), (still, still))
    )
    if weight.max() > 1.0:
        joint = int(weight.max(axis=0).argmax())
        raise NoPath(
            f"the load is too heavy on the path: A{joint + 1} needs {weight.max() * robot.tau_max[joint]:.0f} Nm at "
            f"rest, at most {robot.tau_max[joint]:.0f} Nm are allowed",
            reason="torque",
            parameter="goal",
            hint="carry less, or keep the load nearer to the base",
        )
    moving = np.maximum(torques - weight, 1e-9)
    return float(((1.0 - weight) / moving).min())


def _planned(robot: RobotModel, points: Array, speed: float, acceleration: float) -> Plan:
    """The spline through points with fractions of the joints' maxima."""
    motion = JointSpline(
        points=tuple(Ptp(q=tuple(point.tolist())) for point in points[1:]),
        dynamics=JointDynamics(velocity=(speed,) * 7, acceleration=(acceleration,) * 7),
    )
    return plan(robot, motion, points[0])


def _dynamics(speed: float, acceleration: float) -> Dynamics:
    return Dynamics(
        joint_speed=speed if speed < 1.0 else None,
        joint_acceleration=acceleration if acceleration < 1.0 else None,
    )
