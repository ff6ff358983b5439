"""A plant whose arm follows its set-points exactly: without dynamics, so that hundreds of stops take seconds."""

from __future__ import annotations

import numpy as np

from heptarm.model.kinematics import forward
from heptarm.planning.motion import TICK, ServoMotion
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.controller.interpolator import FAST_JERK
from heptarm.sim.controller.safety import StopRequest
from heptarm.sim.plant.plant import Plant
from heptarm.values.checks import Array
from heptarm.values.pose import Pose
from heptarm.values.robot import robot
from tests.sim import motions
from tests.sim.driving import READY

LINE = (0.05, 0.25, 0.05, 0.0, 0.0, 0.0, 1.0)
BASE = (0.0, 0.0, 0.0, 1.0)
_HERE = Pose.from_matrix(forward(robot("iiwa14"), READY))


def _at(x: float, y: float, z: float) -> tuple[float, ...]:
    return tuple(Pose(_HERE.xyz + (x, y, z), _HERE.quat).array.tolist())


#: Every kind of motion, each about a second long at full speed.
KINDS = {
    "ptp": MotionCommand(1, motions.ptp((1.2, 0.2, 0.3, -1.0, 0.4, 0.5, -0.8))),
    "lin": MotionCommand(1, motions.lin_rel(LINE, BASE)),
    "circ": MotionCommand(1, motions.circ(_at(0.08, 0.12, 0.0), _at(0.0, 0.24, 0.05))),
    "batch": MotionCommand(
        1,
        motions.batch(
            *(
                motions.lin(_at(*corner), blending=(0.0, 0.03, 0.0))
                for corner in ((0.0, 0.15, 0.0), (0.1, 0.15, 0.0), (0.1, 0.0, 0.05))
            )
        ),
    ),
    "spline": MotionCommand(
        1,
        motions.spline(
            *(motions.spl(_at(*knot)) for knot in ((0.05, 0.08, 0.0), (0.0, 0.16, 0.05), (0.08, 0.25, 0.0)))
        ),
    ),
    "hold": MotionCommand(1, motions.hold()),
    "servo": MotionCommand(1, motions.servo()),
    "direct": MotionCommand(1, motions.direct()),
}


class Ideal(Plant):
    """A plant that follows at once."""

    def tick(self, most: int = 1) -> int:
        self._advance()
        _, now, after = self.interpolator.command
        self._q[:] = after
        self._dq[:] = (after - now) / TICK
        self.tick_count += 1
        return 1

    @property
    def speed(self) -> Array:
        """Of the set-points, shape (7,) [rad/s]."""
        return np.array(self._dq)

    @property
    def acceleration(self) -> Array:
        """Of the set-points, shape (7,) [rad/s²]."""
        before, now, after = self.interpolator.command
        return np.asarray((after - 2 * now + before) / TICK**2)

    @property
    def is_under_way(self) -> bool:
        """Whether the set-points move, or a motion brakes that has not come to its end."""
        run = self.interpolator.run
        braking = run is not None and run.cancelled and run.phase != "settling"
        return braking or bool(self._dq.any())

    def press(self) -> None:
        """Press the emergency stop."""
        self.safety.request_stop(StopRequest.EMERGENCY_STOP)

    @property
    def _q(self) -> Array:
        """Its measured positions, shape (7,) [rad]."""
        return np.asarray(self.data.qpos[:7])

    @property
    def _dq(self) -> Array:
        """Its velocities, shape (7,) [rad/s]."""
        return np.asarray(self.data.qvel[:7])


def stopping_time(plant: Plant, how: str) -> float:
    """How long a stop may take by its deceleration limit, from this tick on [s].

    A stop on the path brakes with what the path's limits allow, jerk included; a servo motion with its axes'. The
    others brake at each axis' full deceleration; on a curved path the axis that is fastest may not be the one that
    limits the speed, so an emergency stop gets half as much again.
    """
    run = plant.interpolator.run
    assert run is not None
    hardest, jerk = float(plant.robot.ddq_max.min()), float(plant.robot.dddq_max.min())
    before, now, after = plant.interpolator.command
    fastest = float(np.abs(after - now).max()) / TICK
    if how != "path":
        return 1.5 * fastest / hardest + (hardest / jerk / FAST_JERK if how == "fast" else 0.0)
    if run.follower is not None:
        steepest = float(np.abs(after - 2 * now + before).max()) / TICK**2
        return braking(fastest, steepest, hardest, jerk)
    if run.profile is None:
        return 0.0
    place, speed, acceleration = run.profile.at(run.time)
    assert run.plan.timing is not None
    limits = run.plan.timing.stop_limits(place, speed)
    return braking(speed, abs(acceleration), limits.acceleration, limits.jerk)


def braking(speed: float, acceleration: float, most: float, jerk: float) -> float:
    """Time to rest from a speed while still accelerating, with limited deceleration and jerk [s]."""
    peak = speed + acceleration**2 / (2 * jerk)
    return acceleration / jerk + peak / most + most / jerk


def begin(kind: str, *, seed: int = 0) -> Ideal:
    """A motion of a kind in its first tick; a servo motion has a far target."""
    plant = Ideal("iiwa14", q=READY)
    order = KINDS[kind]
    plant.submit(order)
    plant.tick()
    if isinstance(order.motion, ServoMotion):
        away = np.random.default_rng(seed).uniform(-0.8, 0.8, 7)
        plant.shared.post(order.id, np.array(READY) + away)
    return plant
