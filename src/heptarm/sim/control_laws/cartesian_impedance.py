"""Cartesian impedance: the tool frame is attached to its set-point by a spring and a damper in each direction.

The overlaid forces of Cartesian sine impedance are a `OverlaidForce` on top of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import atan2, cos, inf, isnan, pi, sin, sqrt

import mujoco
import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected
from heptarm.model.kinematics import joints
from heptarm.planning.motion import TICK
from heptarm.sim.control_laws.laws import GUIDED, GUIDED_AXIS, MeasuredState, braking, freedom
from heptarm.values.checks import Array
from heptarm.values.frames import BASE, TOOL
from heptarm.values.mode.impedance import CartesianImpedance
from heptarm.values.mode.sine import SineImpedance
from heptarm.values.pose import quaternion, rotation
from heptarm.values.robot import RobotModel

#: In this last fraction of the distance to the position limit a force towards it fades out.
FADE = 0.2
#: In place of no limit [N, Nm, m, rad]; infinity would make NaN of it.
_NONE = 1e9


class OverlaidForce:
    """The overlaid force of a sine impedance over time.

    Args:
        mode: its parameters.

    Attributes:
        mode: the same.
        end: time at which the force ends [s]; infinite: never.
        stays: the motion must not end before that.
    """

    def __init__(self, mode: SineImpedance) -> None:
        self.mode = mode
        duration = mode.duration
        self.end = inf if isnan(duration) else duration
        self.stays = mode.stay_active
        self._pulsation = 2.0 * pi * mode.frequency
        self._limited = not bool(np.isnan(mode.force_limit).all())
        self._most = np.nan_to_num(mode.force_limit, nan=_NONE)
        self._bounded = not bool(np.isnan(mode.position_limit).all())
        self._reach = np.nan_to_num(mode.position_limit, nan=_NONE)
        self._slope = 1.0 / np.maximum(FADE * self._reach, 1.0 / _NONE)

    def fraction(self, time: float) -> float:
        """Fraction of the force that acts at a time since its start [s], 0 to 1."""
        if time < 0.0 or time >= self.end:
            return 0.0
        rise, fall, left = self.mode.rise_time, self.mode.fall_time, self.end - time
        risen = time / rise if time < rise else 1.0
        fallen = left / fall if left < fall else 1.0
        return min(risen, fallen)

    def force(self, time: float, deviation: Array) -> Array:
        """The force on the tool frame.

        Args:
            time: since the beginning [s].
            deviation: of the tool frame from its set-point, shape (6,) [m, rad].

        Returns:
            Shape (6,) [N, Nm], in the axes of the mode's frame.
        """
        fraction, mode = self.fraction(time), self.mode
        if fraction == 0.0:
            return np.zeros(6)
        force: Array = mode.amplitude * np.sin(self._pulsation * time + mode.phase)
        force += mode.bias
        force *= fraction
        if self._limited:
            np.minimum(force, self._most, out=force)
            np.maximum(force, -self._most, out=force)
        if self._bounded:
            room = np.minimum(np.maximum((self._reach - np.abs(deviation)) * self._slope, 0.0), 1.0)
            force *= np.where(force * deviation > 0.0, room, 1.0)  # a force that pulls back acts in full
        return force


#: Duration of a parameter change while the law is in force, and of the rise of added forces [s].
RAMP = 0.05
#: A direction of less stiffness can be guided by hand [N/m, Nm/rad]. A damping ratio means nothing there: such a
#: direction is damped critically, like one of the stiffness below.
LEAST_STIFFNESS = np.array([10.0, 10.0, 10.0, 0.5, 0.5, 0.5])
GUIDED_STIFFNESS = np.array([300.0, 300.0, 300.0, 10.0, 10.0, 10.0])
#: The same for the elbow: the spring of the null space [Nm/rad], and the natural frequency [rad/s].
LEAST_ELBOW, GUIDED_PULSATION = 5.0, 10.0
#: Where a guided direction has a velocity that stops the motion, its speed is bounded at this fraction of it.
BOUND = 0.8
#: With a higher bound of the speed than by default the bound of the axes grows alike, up to this fraction.
MOST_AXIS = 0.9
#: Least natural frequency for the damper of the null space, or a touch would make the elbow drift forever, and of the
#: Cartesian modes, which bounds the damper near singularities [rad/s].
LEAST_PULSATION = 1.0
#: Directions in which the arm's inertia is above 1 / HEAVY² [kg, kg m²] are practically blocked: there the joint spring
#: replaces the Cartesian one.
HEAVY = 0.05

_ALONG = ("along x", "along y", "along z", "about x", "about y", "about z")
_NO_TOOL = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


class FlangeKinematics:
    """Pose and Jacobian of the flange of a simulated arm.

    Args:
        model: MuJoCo's model; its first seven joints are the arm's.
        data: its state.

    Attributes:
        jacobian: base axes, shape (6, 7).
        rotation: axes in the base frame as columns, shape (3, 3).
        position: in the base frame, shape (3,) [m].
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._model, self._data = model, data
        self._site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, "flange")
        whole = np.zeros((6, model.nv))
        self._linear, self._angular = whole[:3], whole[3:]
        self.jacobian: Array = whole[:, :7]
        self.rotation: Array = data.site_xmat[self._site].reshape(3, 3)
        self.position: Array = data.site_xpos[self._site]

    def update(self) -> None:
        """Update the Jacobian; MuJoCo updates the pose."""
        mujoco.mj_jacSite(self._model, self._data, self._linear, self._angular, self._site)


class CartesianImpedanceLaw:
    """Cartesian impedance, with or without an overlaid force.

    Args:
        mode: its parameters.
        robot: the robot.
        flange: of the simulated arm.
        tcp: flange to tool frame, x y z [m], quaternion x y z w.
        axes: of the mode's frame, columns in the base frame, shape (3, 3); needed for frames other than "tool" and
            "base".

    Attributes:
        violation: text of the first exceeded limit that stops the motion; "" while there is none.
        force: control force of the last tick, shape (6,) [N, Nm], in the axes of the mode's frame.
        overlay: the overlaid part of it.
        deviation: of the tool frame from its set-point, shape (6,) [m, rad], in the same axes.
        velocity: of the tool frame, shape (6,) [m/s, rad/s], in the same axes.

    Raises:
        CommandRejected: the axes of the mode's frame are not given.
    """

    is_stiff = False
    is_plain = False

    def __init__(
        self,
        mode: CartesianImpedance | SineImpedance,
        robot: RobotModel,
        flange: FlangeKinematics,
        *,
        tcp: Sequence[float] = _NO_TOOL,
        axes: npt.ArrayLike | None = None,
    ) -> None:
        base = _base(mode)
        if axes is None and base.frame not in (TOOL, BASE):
            raise CommandRejected(
                f"frame of a Cartesian impedance must be {TOOL!r}, {BASE!r} or given with its axes, got {base.frame!r}",
                code=42,
                parameter="frame",
                value=base.frame,
            )
        self._robot, self._flange = robot, flange
        self._offset, self._turn = np.array(tcp[:3], dtype=np.float64), rotation(np.array(tcp[3:]))
        self._axes: Array | None = None  # None: those of the set-point
        if base.frame != TOOL:
            self._axes = np.eye(3) if axes is None else np.array(axes, dtype=np.float64)
        self.violation = ""
        self.force, self.overlay = np.zeros(6), np.zeros(6)
        self.deviation, self.velocity = np.zeros(6), np.zeros(6)
        self._shift = np.zeros((6, 6))  # from the flange's Jacobian to the tool frame's, in the mode's axes
        self._seen: list[float] = []  # joints of the set-point whose pose is known
        self._goal_rotation, self._goal = np.eye(3), np.zeros(3)
        self._axes_of: list[tuple[float, float, float]] = []
        self._points: list[tuple[float, float, float]] = []
        self._pattern: OverlaidForce | None = None
        self._old_pattern: OverlaidForce | None = None
        self._time = self._old_time = 0.0
        self._take(mode)
        self._present = self._wanted.copy()
        self._present[12:18] = 0.0  # added forces rise on a ramp
        self._tune()

    def change(self, mode: CartesianImpedance | SineImpedance) -> None:
        """Change the parameters on a short ramp; the frame stays. A different overlaid force starts again."""
        self._take(mode)

    @property
    def stays(self) -> bool:
        """Whether the motion must not end yet, because its overlaid force has not ended."""
        pattern = self._pattern
        return pattern is not None and pattern.stays and self._time < pattern.end

    def _take(self, mode: CartesianImpedance | SineImpedance) -> None:
        base = _base(mode)
        self._wanted = np.concatenate(
            [
                base.stiffness,
                base.damping,
                base.additional_force,
                [base.nullspace_stiffness, base.nullspace_damping],
            ]
        )
        self._ramp = 0.0
        self._max_force = _unless_open(base.max_force)
        limits = [
            ("Maximum path deviation", "deviation", _unless_open(base.max_deviation), ("m", "rad")),
            ("Maximum Cartesian velocity", "velocity", _unless_open(base.max_velocity), ("m/s", "rad/s")),
            (
                "Maximum control force",
                "force",
                self._max_force if base.max_force_stops else None,
                ("N", "Nm"),
            ),
        ]
        self._bounds = GUIDED if limits[1][2] is None else _bounds(limits[1][2])
        self._fastest = (
            min(GUIDED_AXIS * max(self._bounds[0] / GUIDED[0], 1.0), MOST_AXIS) * self._robot.dq_max
        )
        self._limits = [(name, what, most, unit) for name, what, most, unit in limits if most is not None]
        now = self._pattern
        if (
            isinstance(mode, SineImpedance)
            and now is not None
            and replace(mode, base=now.mode.base) == now.mode
        ):
            return
        self._old_pattern, self._old_time = now, self._time
        self._pattern, self._time = (OverlaidForce(mode) if isinstance(mode, SineImpedance) else None), 0.0

    def _tune(self) -> None:
        """Advance the parameters on their ramp by one tick."""
        self._ramp += TICK
        fraction = min(1.0, self._ramp / RAMP)
        if fraction == 1.0:
            self._present = self._wanted
        else:
            self._present = self._present + (self._wanted - self._present) * (
                TICK / (RAMP - self._ramp + TICK)
            )
        self._stiffness, self._added = self._present[:6], self._present[12:18]
        self._root = np.sqrt(np.maximum(self._stiffness, LEAST_STIFFNESS))
        self._weight = np.sqrt(self._present[6:12])
        self._elbow, self._elbow_damping = float(self._present[18]), float(self._present[19])
        self._free = free = freedom(self._stiffness, LEAST_STIFFNESS)
        self._guided_root = np.sqrt(np.maximum(self._stiffness, GUIDED_STIFFNESS * free))
        self._guided_weight = self._weight + free * (1.0 - self._weight)
        self._elbow_pulsation = GUIDED_PULSATION * max(1.0 - self._elbow / LEAST_ELBOW, 0.0)
        self._is_guided = bool(free.any()) or self._elbow < LEAST_ELBOW

    def torque(self, sensed: MeasuredState) -> Array:
        """Torques of the motors, shape (7,) [Nm]."""
        if self._ramp < RAMP:
            self._tune()
        flange = self._flange
        flange.update()
        speed = (sensed.after - sensed.before) * 500.0
        goal_velocity = self._update_goal(sensed.now.tolist(), speed.tolist())
        axes = self._goal_rotation if self._axes is None else self._axes
        to_axes = axes.T
        lever = flange.rotation @ self._offset
        jacobian = self._jacobian(to_axes, lever.tolist())
        deviation = np.empty(6)
        deviation[:3] = to_axes @ (flange.position + lever - self._goal)
        turned = flange.rotation @ self._turn @ self._goal_rotation.T
        deviation[3:] = to_axes @ _turning(turned)
        velocity = jacobian @ sensed.dq
        rate = velocity - (to_axes @ goal_velocity).T.ravel()
        root = np.linalg.inv(np.linalg.cholesky(sensed.mass))  # of the inverse mass matrix: M^-1 = root' root
        mobility = jacobian @ root.T
        is_guided = self._is_guided and not sensed.is_overlaid
        damping = (self._guided_root, self._guided_weight) if is_guided else (self._root, self._weight)
        force = self._spring(deviation, rate, mobility @ mobility.T, *damping)
        self.deviation, self.velocity, self.force = deviation, velocity, force
        if not self.violation:
            self._watch()
        if self._max_force is not None:
            self.force = force = np.minimum(np.maximum(force, -self._max_force), self._max_force)
        torque: Array = sensed.bias - sensed.passive + jacobian.T @ force
        if (
            not sensed.is_overlaid
        ):  # a client's set-points may jump, and the arm shall not be thrown after them
            torque += sensed.mass @ ((sensed.after - 2 * sensed.now + sensed.before) * 1e6)
        slip = sensed.dq - speed
        least = max(self._elbow_pulsation if is_guided else 0.0, LEAST_PULSATION)
        torque += self._null(mobility, root, sensed.mass, sensed.now - sensed.q, -slip, least)
        if is_guided:
            torque += sensed.mass @ braking(slip, self._too_fast(slip, rate))
        self._time += TICK
        self._old_time += TICK
        return torque

    def _update_goal(self, q: list[float], dq: list[float]) -> Array:
        """Pose of the set-point, if it is a new one, and its velocity: linear and angular as columns, shape (3, 2)."""
        if q != self._seen:
            axes, points, tip = joints(self._robot, q)
            y, z, c, s = axes[5], axes[6], cos(q[6]), sin(q[6])
            x = (y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0])
            turn = np.array((x, y, z)).T @ ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))
            self._goal = np.array(tip) + turn @ self._offset
            self._goal_rotation = turn @ self._turn
            self._seen, self._axes_of, self._points = q, axes, points
        if not any(dq):
            return np.zeros((3, 2))
        tx, ty, tz = self._goal.tolist()
        vx = vy = vz = wx = wy = wz = 0.0
        for (ax, ay, az), (px, py, pz), rate in zip(self._axes_of, self._points, dq, strict=True):
            rx, ry, rz = tx - px, ty - py, tz - pz
            vx += rate * (ay * rz - az * ry)
            vy += rate * (az * rx - ax * rz)
            vz += rate * (ax * ry - ay * rx)
            wx += rate * ax
            wy += rate * ay
            wz += rate * az
        return np.array(((vx, wx), (vy, wy), (vz, wz)))

    def _jacobian(self, to_axes: Array, lever: list[float]) -> Array:
        """Of the tool frame, in the mode's axes."""
        x, y, z = lever
        shift = self._shift
        shift[:3, :3] = shift[3:, 3:] = to_axes
        shift[:3, 3:] = to_axes @ ((0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0))
        result: Array = shift @ self._flange.jacobian
        return result

    def _too_fast(self, slip: Array, rate: Array) -> float:
        """Largest ratio of a velocity from the set-point's to its bound in guiding by hand."""
        velocity = np.where(self._free > 0.0, rate, 0.0)
        along, about = float(np.linalg.norm(velocity[:3])), float(np.linalg.norm(velocity[3:]))
        axis = float((np.abs(slip) / self._fastest).max())
        return max(axis, along / self._bounds[0], about / self._bounds[1])

    def _spring(self, deviation: Array, rate: Array, mobility: Array, root: Array, weight: Array) -> Array:
        """Force of spring and damper with the added forces; mobility: Λ^-1, shape (6, 6)."""
        pulsation2, modes = np.linalg.eigh(root[:, None] * mobility * root)
        np.maximum(pulsation2, LEAST_PULSATION**2, out=pulsation2)
        modes *= (root * weight)[:, None]
        force: Array = self._added - self._stiffness * deviation
        force -= modes @ ((rate @ modes) * 2.0 / np.sqrt(pulsation2))
        if self._pattern is not None or self._old_pattern is not None:
            self.overlay = self._overlaid(deviation)
            force += self.overlay
        return force

    def _overlaid(self, deviation: Array) -> Array:
        """The overlaid force; a new one rises on a ramp while the one before it fades out."""
        new, old = self._pattern, self._old_pattern
        force = np.zeros(6) if new is None else new.force(self._time, deviation)
        if self._time >= RAMP:
            self._old_pattern = None
            return force
        fraction = self._time / RAMP
        force *= fraction
        if old is not None:
            force += (1.0 - fraction) * old.force(self._old_time, deviation)
        return force

    def _null(
        self, mobility: Array, root: Array, mass: Array, error: Array, rate: Array, least: float
    ) -> Array:
        """Torques that hold the elbow without accelerating the tool frame."""
        squares, vectors = np.linalg.eigh(mobility.T @ mobility)
        torque = np.zeros(7)
        for index in range(7):
            square = float(squares[index])
            if square >= HEAVY * HEAVY:
                break
            weight = (1.0 - sqrt(max(0.0, square)) / HEAVY) ** 2
            direction = vectors[:, index] @ root  # J direction = 0, direction' M direction = 1
            push = mass @ direction
            pulsation = max(least, sqrt(self._elbow * float(direction @ direction)))
            pull = self._elbow * float(direction @ error) + 2.0 * self._elbow_damping * pulsation * float(
                push @ rate
            )
            torque += weight * pull * push
        return torque

    def _watch(self) -> None:
        """Check the limits that stop the motion."""
        for name, what, most, units in self._limits:
            values = getattr(self, what)
            over = np.abs(values) > most
            if over.any():
                index = int(over.argmax())
                value, limit, unit = abs(float(values[index])), float(most[index]), units[index // 3]
                self.violation = (
                    f"{name} exceeded: {value:.4g} {unit} {_ALONG[index]}; allowed is {limit:.4g} {unit}"
                )
                return


def _base(mode: CartesianImpedance | SineImpedance) -> CartesianImpedance:
    return mode.base if isinstance(mode, SineImpedance) else mode


def _bounds(most: Array) -> tuple[float, float]:
    """Bounds of the speed along and about axes, from velocities that stop the motion; without them the defaults."""
    along, about = float(most[:3].min()), float(most[3:].min())
    return (
        BOUND * along if along < inf else GUIDED[0],
        BOUND * about if about < inf else GUIDED[1],
    )


def _unless_open(limits: Array) -> Array | None:
    """Limits with infinity for open ones; None: all are open."""
    return None if np.isnan(limits).all() else np.where(np.isnan(limits), np.inf, limits)


def _turning(matrix: Array) -> Array:
    """Rotation vector of a rotation matrix, shape (3,) [rad]."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = matrix.tolist()
    if xx + yy + zz < -0.5:  # beyond 138 degrees the skew-symmetric part does not determine the axis well
        quat = quaternion(matrix)
        sine = float(np.linalg.norm(quat[:3]))
        return np.asarray(quat[:3] * (2.0 * atan2(sine, float(quat[3])) / sine), dtype=np.float64)
    x, y, z = 0.5 * (zy - yz), 0.5 * (xz - zx), 0.5 * (yx - xy)
    sine = sqrt(x * x + y * y + z * z)
    scale = 1.0 if sine < 1e-9 else atan2(sine, 0.5 * (xx + yy + zz - 1.0)) / sine
    return np.array((scale * x, scale * y, scale * z))
