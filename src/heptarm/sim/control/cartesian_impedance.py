"""Cartesian impedance: the moved frame hangs on its set-point by a spring and a damper in each direction.

The control force F = -K e - D de/dt, with what is added to it, acts through the transposed Jacobian; gravity, friction,
Coriolis torques and the commanded acceleration are compensated, the arm's inertia is not shaped (Ott, "Cartesian
Impedance Control of Redundant and Flexible-Joint Robots", 2008, chapter 3).

The damper follows from stiffness K and Cartesian inertia Λ by double diagonalisation (Albu-Schäffer, Ott, Frese,
Hirzinger, "Cartesian impedance control of redundant robots", ICRA 2003): with Λ = Q Q' and K = Q B Q' it is
D = 2 Q √B Q'. That is twice the geometric mean of K and Λ, hence also D = 2 √K (√K Λ^-1 √K)^-½ √K: it takes no inverse
of Λ, which does not exist in a singularity. Damping ratios enter as D → √ζ D √ζ: D stays positive, and directions that
are not coupled have their own ratio each.

The elbow hangs on its set-point by a spring in joint space, through the dynamically consistent null space (Khatib, "A
unified approach for motion and force control of robot manipulators", 1987): with M = L L' it is spanned by those a for
which J a = 0 and a' M a = 1, and torques M a do not accelerate the moved frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import atan2, cos, sin, sqrt

import mujoco
import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected
from heptarm.model.kinematics import joints
from heptarm.values.arrays import Array
from heptarm.values.mode import CartesianImpedance, SineImpedance
from heptarm.values.motion import BASE, TOOL
from heptarm.values.pose import quaternion, rotation
from heptarm.values.robot import RobotModel
from heptarm.virtual.law import Sensed
from heptarm.virtual.sine import Pattern
from heptarm.virtual.tick import TICK

#: Parameters that change while the law is in force do so within this time [s]; added forces set in likewise.
RAMP = 0.05
#: A direction without stiffness is damped like one of this stiffness [N/m, Nm/rad], or a touch would set the arm
#: adrift for good.
LEAST_STIFFNESS = np.array([10.0, 10.0, 10.0, 0.5, 0.5, 0.5])
#: The null space's damper is at least that of this pulsation [rad/s], for the same reason; no Cartesian mode counts as
#: slower, which bounds the damper near singularities.
LEAST_PULSATION = 1.0
#: Directions in which the arm's inertia is above 1 / HEAVY² [kg, kg m²] are as good as blocked: what the Cartesian
#: spring does not hold there, the joint spring takes over.
HEAVY = 0.05

_ALONG = ("along x", "along y", "along z", "about x", "about y", "about z")
_NO_TOOL = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


class Flange:
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
        """Take the Jacobian of the present state; the rest is up to date by itself."""
        mujoco.mj_jacSite(self._model, self._data, self._linear, self._angular, self._site)


class CartesianSpring:
    """Cartesian impedance, with or without an overlaid force.

    Args:
        mode: its parameters.
        robot: the robot.
        flange: of the simulated arm.
        tcp: flange to moved frame, x y z [m], quaternion x y z w.
        axes: of the mode's frame, columns in the base frame, shape (3, 3); needed for frames other than "tool" and
            "base".

    Attributes:
        violation: which limit that stops the motion was exceeded first, in words; "" while none was.
        force: control force of the last tick, shape (6,) [N, Nm], in the axes of the mode's frame.
        overlay: the overlaid part of it.
        deviation: of the moved frame from its set-point, shape (6,) [m, rad], in the same axes.
        velocity: of the moved frame, shape (6,) [m/s, rad/s], in the same axes.

    Raises:
        CommandRejected: the axes of the mode's frame are not given.
    """

    is_stiff = False

    def __init__(
        self,
        mode: CartesianImpedance | SineImpedance,
        robot: RobotModel,
        flange: Flange,
        *,
        tcp: Sequence[float] = _NO_TOOL,
        axes: npt.ArrayLike | None = None,
    ) -> None:
        base = _base(mode)
        if axes is None and base.frame not in (TOOL, BASE):
            raise CommandRejected(
                f"the axes of frame {base.frame!r} are not known",
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
        self._shift = np.zeros((6, 6))  # from the flange's Jacobian to the moved frame's, in the mode's axes
        self._seen: list[float] = []  # joints of the set-point whose pose is known
        self._goal_rotation, self._goal = np.eye(3), np.zeros(3)
        self._axes_of: list[tuple[float, float, float]] = []
        self._points: list[tuple[float, float, float]] = []
        self._pattern: Pattern | None = None
        self._old_pattern: Pattern | None = None
        self._time = self._old_time = 0.0
        self._take(mode)
        self._present = self._wanted.copy()
        self._present[12:18] = 0.0  # added forces set in gently
        self._tune()

    # ------------------------------------------------------------------------------ parameters

    def change(self, mode: CartesianImpedance | SineImpedance) -> None:
        """Take other parameters, on a short ramp; the frame stays. An overlaid force that differs begins anew."""
        self._take(mode)

    @property
    def stays(self) -> bool:
        """The overlaid force has not ended, and the motion is not to end before."""
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
        self._limits = [(name, what, most, unit) for name, what, most, unit in limits if most is not None]
        now = self._pattern
        if (
            isinstance(mode, SineImpedance)
            and now is not None
            and replace(mode, base=now.mode.base) == now.mode
        ):
            return
        self._old_pattern, self._old_time = now, self._time
        self._pattern, self._time = (Pattern(mode) if isinstance(mode, SineImpedance) else None), 0.0

    def _tune(self) -> None:
        """Bring the parameters that change on a ramp a tick further."""
        self._ramp += TICK
        share = min(1.0, self._ramp / RAMP)
        if share == 1.0:
            self._present = self._wanted
        else:
            self._present = self._present + (self._wanted - self._present) * (
                TICK / (RAMP - self._ramp + TICK)
            )
        self._stiffness, self._added = self._present[:6], self._present[12:18]
        self._root = np.sqrt(np.maximum(self._stiffness, LEAST_STIFFNESS))
        self._weight = np.sqrt(self._present[6:12])
        self._elbow, self._elbow_damping = float(self._present[18]), float(self._present[19])

    # ------------------------------------------------------------------------------ the tick

    def torque(self, sensed: Sensed) -> Array:
        """Torques of the motors, shape (7,) [Nm]."""
        if self._ramp < RAMP:
            self._tune()
        flange = self._flange
        flange.update()
        speed = (sensed.after - sensed.before) * 500.0
        goal_velocity = self._lead(sensed.now.tolist(), speed.tolist())
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
        force = self._spring(deviation, rate, mobility @ mobility.T)
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
        torque += self._null(mobility, root, sensed.mass, sensed.now - sensed.q, speed - sensed.dq)
        self._time += TICK
        self._old_time += TICK
        return torque

    def _lead(self, q: list[float], dq: list[float]) -> Array:
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
        """Of the moved frame, in the mode's axes."""
        x, y, z = lever
        shift = self._shift
        shift[:3, :3] = shift[3:, 3:] = to_axes
        shift[:3, 3:] = to_axes @ ((0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0))
        result: Array = shift @ self._flange.jacobian
        return result

    def _spring(self, deviation: Array, rate: Array, mobility: Array) -> Array:
        """Force of spring, damper and what is added; mobility: Λ^-1, shape (6, 6)."""
        root = self._root
        pulsation2, modes = np.linalg.eigh(root[:, None] * mobility * root)
        np.maximum(pulsation2, LEAST_PULSATION**2, out=pulsation2)
        modes *= (root * self._weight)[:, None]
        force: Array = self._added - self._stiffness * deviation
        force -= modes @ ((rate @ modes) * 2.0 / np.sqrt(pulsation2))
        if self._pattern is not None or self._old_pattern is not None:
            self.overlay = self._overlaid(deviation)
            force += self.overlay
        return force

    def _overlaid(self, deviation: Array) -> Array:
        """The overlaid force; a new one sets in gently, as the one before it fades out."""
        new, old = self._pattern, self._old_pattern
        force = np.zeros(6) if new is None else new.force(self._time, deviation)
        if self._time >= RAMP:
            self._old_pattern = None
            return force
        share = self._time / RAMP
        force *= share
        if old is not None:
            force += (1.0 - share) * old.force(self._old_time, deviation)
        return force

    def _null(self, mobility: Array, root: Array, mass: Array, error: Array, rate: Array) -> Array:
        """Torques that hold the elbow without accelerating the moved frame."""
        squares, vectors = np.linalg.eigh(mobility.T @ mobility)
        torque = np.zeros(7)
        for index in range(7):
            square = float(squares[index])
            if square >= HEAVY * HEAVY:
                break
            weight = (1.0 - sqrt(max(0.0, square)) / HEAVY) ** 2
            way = vectors[:, index] @ root  # J way = 0, way' M way = 1
            push = mass @ way
            pulsation = max(LEAST_PULSATION, sqrt(self._elbow * float(way @ way)))
            pull = self._elbow * float(way @ error) + 2.0 * self._elbow_damping * pulsation * float(
                push @ rate
            )
            torque += weight * pull * push
        return torque

    def _watch(self) -> None:
        """Find out whether a limit that stops the motion is exceeded."""
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


def _unless_open(limits: Array) -> Array | None:
    """Limits with infinity where there is none; None: there is none at all."""
    return None if np.isnan(limits).all() else np.where(np.isnan(limits), np.inf, limits)


def _turning(matrix: Array) -> Array:
    """Rotation vector of a rotation matrix, shape (3,) [rad]."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = matrix.tolist()
    if xx + yy + zz < -0.5:  # beyond 138 degrees the difference of the sides does not tell the axis well
        quat = quaternion(matrix)
        sine = float(np.linalg.norm(quat[:3]))
        return np.asarray(quat[:3] * (2.0 * atan2(sine, float(quat[3])) / sine), dtype=np.float64)
    x, y, z = 0.5 * (zy - yz), 0.5 * (xz - zx), 0.5 * (yx - xy)
    sine = sqrt(x * x + y * y + z * z)
    scale = 1.0 if sine < 1e-9 else atan2(sine, 0.5 * (xx + yy + zz - 1.0)) / sine
    return np.array((scale * x, scale * y, scale * z))
