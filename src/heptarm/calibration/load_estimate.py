"""Identification of the load on the flange from torques: mass, centre of mass, and inertia where it was excited.

The torques of a load are linear in its ten parameters, the mass, the first moments and the inertia about the flange
(Atkeson, An, Hollerbach, "Estimation of inertial parameters of manipulator loads and links", 1986). What the cabinet
takes for an external torque is the part of the true load that its load data lack, with the errors of the torque
sensors; so the arm's own masses need not be known here, which KUKA does not publish. An offset and an error of gain of
each sensor are estimated beside the load, with the accuracy of a referenced sensor as prior knowledge. An inertia is
made consistent with a body by the Cholesky factor of the pseudo-inertia matrix (Rucker, Wensing, "Smooth
parameterization of rigid-body inertia", 2022).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.io.targets import save_tool
from heptarm.model.dynamics import GRAVITY, inverse_dynamics_rows
from heptarm.model.kinematics import forward
from heptarm.values.checks import Array, Value, array, finite_entries, frozen, instance, numbers
from heptarm.values.robot import Body, RobotModel, robot, symmetric
from heptarm.values.text import lines
from heptarm.values.tool import KnownTool, Tool, as_tool

#: Prior standard deviations of a torque sensor's gain, and of its offset as a fraction of the highest torque: a third
#: of the 2 % of KUKA's brochure, and less.
GAIN, OFFSET = 0.007, 0.005
#: Prior standard deviation of an element of inertia, which means nothing [kg m²]; one that is known better is measured.
_ANY_INERTIA, _MEASURED_INERTIA = 1.0, 0.02
#: Prior standard deviations of the mass [kg] and of the first moments [kg m], which mean nothing.
_ANY_MASS, _ANY_MOMENT = 100.0, 100.0
#: Noise of a torque reading that a moment of inertia has to exceed at the highest acceleration, so that it matters: a
#: fraction of the highest torque of A7, which carries least.
_FELT = 5e-4
#: Least noise that is assumed, as a fraction of the highest torque: the sensors have a resolution.
_LEAST_NOISE = 2e-5
#: Standard deviations of mass [kg] and first moment [kg m] above which the postures do not differ enough.
_MASS_KNOWN, _MOMENT_KNOWN = 0.15, 0.015
#: Least angle by which gravity turns in the flange's axes between two samples [rad].
_TURNED = math.radians(20.0)
#: Torque that no load explains, as a fraction of the highest torque of an axis: something touches the arm.
_TOUCHED = 0.015
#: Offsets and gains of the sensors that are not believed, in prior standard deviations.
_IMPLAUSIBLE = 5.0
_AXES = 7
_AT_REST = frozen(np.zeros(_AXES))


def _parameters(mass: float, com: npt.ArrayLike, inertia: Array) -> Array:
    """The ten parameters of a body, shape (10,): mass, first moments, inertia about the origin xx yy zz xy xz yz."""
    at = np.asarray(com, dtype=np.float64)
    about = inertia + mass * (float(at @ at) * np.eye(3) - np.outer(at, at))
    return np.concatenate([[mass], mass * at, about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]])


def _parameters_of(body: Body) -> Array:
    return _parameters(body.mass, body.com, symmetric(body.inertia))


#: Bodies of one point each, whose parameters are a basis: the torques of any load are sums of theirs.
POINTS = 0.1 * np.array(
    [
        *([0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0]),
        *([0, -1, 0], [0, 0, -1], [1, 1, 0], [1, 0, 1], [0, 1, 1]),
    ]
)
_BASIS = tuple(Body(1.0, point) for point in POINTS)
TO_PARAMETERS = np.linalg.inv(np.array([_parameters_of(body) for body in _BASIS]))


def load_regressor(
    model: RobotModel,
    q: npt.ArrayLike,
    dq: npt.ArrayLike = _AT_REST,
    ddq: npt.ArrayLike = _AT_REST,
    *,
    acceleration: npt.ArrayLike = GRAVITY,
) -> Array:
    """Matrix whose product with the ten parameters of a load are the joint torques that carry it.

    Args:
        model: the robot.
        q: joint positions, shape (7,) [rad].
        dq: joint velocities, shape (7,) [rad/s].
        ddq: joint accelerations, shape (7,) [rad/s²].
        acceleration: of gravity in the base frame, shape (3,) [m/s²]; another one for a tilted base.

    Returns:
        Shape (7, 10): by mass, first moments x y z [kg m], inertia about the flange xx yy zz xy xz yz [kg m²].
    """
    rows = (array(values, _AXES, name)[None] for values, name in ((q, "q"), (dq, "dq"), (ddq, "ddq")))
    return np.asarray(load_regressors(model, *rows, acceleration=acceleration)[0])


def load_regressors(
    model: RobotModel, q: Array, dq: Array, ddq: Array, *, acceleration: npt.ArrayLike
) -> Array:
    """`load_regressor` of many moments, unchecked: arrays of shape (n, 7) to shape (n, 7, 10)."""
    bare = inverse_dynamics_rows(model, q, dq, ddq, acceleration=acceleration)
    each = [inverse_dynamics_rows(model, q, dq, ddq, load=body, acceleration=acceleration) for body in _BASIS]
    return np.asarray(np.einsum("pb,bnj->njp", TO_PARAMETERS, np.array(each) - bare))


@dataclass(frozen=True, slots=True, eq=False)
class LoadSamples(Value):
    """What was measured: a row for each rest, or for each moment of a motion.

    Attributes:
        q: joint positions, shape (n, 7) [rad].
        tau: measured torques, shape (n, 7) [Nm].
        tau_ext: external torques as a state has them, shape (n, 7) [Nm].
        noise: standard deviation of `tau_ext`, shape (n, 7) [Nm].
        dq: joint velocities, shape (n, 7) [rad/s]; all 0 at rest.
        ddq: joint accelerations, shape (n, 7) [rad/s²]; all 0 at rest.
        spread: standard deviation of the times over which a row is a weighted mean, shape (n,) [s]; 0: one moment, or
            at rest.

    Raises:
        ShapeError: wrong shapes.
        LimitError: a number that is not finite.
    """

    q: Array
    tau: Array
    tau_ext: Array
    noise: Array
    dq: Array = field(default_factory=lambda: np.zeros((0, _AXES)))
    ddq: Array = field(default_factory=lambda: np.zeros((0, _AXES)))
    spread: Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        count = len(numbers(self.q, "q"))
        for name in ("q", "tau", "tau_ext", "noise", "dq", "ddq"):
            given = numbers(getattr(self, name), name)
            if given.shape == (0, _AXES) and name in ("dq", "ddq"):
                given = np.zeros((count, _AXES))
            if given.shape != (count, _AXES) or not count:
                raise ShapeError(
                    f"{name} must have shape (n, {_AXES}) with the n of q, got {given.shape}", parameter=name
                )
            object.__setattr__(self, name, frozen(finite_entries(given, name)))
        spread = numbers(self.spread, "spread")
        spread = np.zeros(count) if spread.shape == (0,) else spread
        if spread.shape != (count,):
            raise ShapeError(
                f"spread must have shape (n,) with the n of q, got {spread.shape}", parameter="spread"
            )
        object.__setattr__(self, "spread", frozen(finite_entries(spread, "spread")))

    def joined(self, other: LoadSamples) -> LoadSamples:
        """These samples and others."""
        names = ("q", "tau", "tau_ext", "noise", "dq", "ddq", "spread")
        return LoadSamples(*(np.concatenate([getattr(self, name), getattr(other, name)]) for name in names))


@dataclass(frozen=True, slots=True, eq=False)
class IdentifiedLoad(Value):
    """A load that was measured, in the flange frame.

    Attributes:
        robot: the robot.
        mass: [kg].
        com: centre of mass, shape (3,) [m].
        inertia: xx yy zz xy xz yz about the centre of mass, shape (6,) [kg m²]; that of `declared` where it was not
            measured.
        sigma_mass: standard deviation of the mass [kg].
        sigma_com: of the centre of mass, shape (3,) [m].
        sigma_inertia: of the inertia about the centre of mass, shape (6,) [kg m²]; NaN: it was not excited.
        offset: of the torque sensors, shape (7,) [Nm].
        sigma_offset: standard deviation of the offsets, shape (7,) [Nm].
        residual: torque of each axis that nothing of this explains, root mean square, shape (7,) [Nm].
        declared: load data in use while it was measured.
    """

    robot: RobotModel
    mass: float
    com: Array
    inertia: Array
    sigma_mass: float
    sigma_com: Array
    sigma_inertia: Array
    offset: Array
    sigma_offset: Array
    residual: Array
    declared: Body

    @property
    def body(self) -> Body:
        """Mass, centre of mass and inertia."""
        return Body(self.mass, self.com, inertia=self.inertia)

    @property
    def matters(self) -> tuple[bool, bool, bool]:
        """Whether each moment of inertia, xx yy zz, can be felt: it is above the least one that any motion shows.

        That makes as much torque at the highest acceleration of the arm as a torque sensor has noise: 0.002 kg m².
        """
        x, y, z = (self.inertia[:3] > _least_moment(self.robot)).tolist()
        return x, y, z

    @property
    def is_as_declared(self) -> bool:
        """Whether mass and centre of mass in use are within three standard deviations of the measured ones."""
        if abs(self.mass - self.declared.mass) > 3.0 * self.sigma_mass:
            return False
        return bool((np.abs(self.com - self.declared.com) <= 3.0 * self.sigma_com).all())

    @property
    def comparison(self) -> str:
        """In words: "declared 1.2 kg, measured 1.954 ± 0.02 kg"."""
        agree = "they agree" if self.is_as_declared else "they differ"
        return f"declared {self.declared.mass:.3g} kg, measured {self.mass:.3f} ± {self.sigma_mass:.3f} kg: {agree}"

    def __str__(self) -> str:
        """Measured and declared load, standard deviations, offsets of the sensors."""
        com = "  ".join(
            f"{axis} {1e3 * value:.1f} ± {1e3 * sigma:.1f}"
            for axis, value, sigma in zip("xyz", self.com, self.sigma_com, strict=True)
        )
        inertia = "not measured"
        if not np.isnan(self.sigma_inertia).any():
            pairs = zip(self.inertia, self.sigma_inertia, strict=True)
            inertia = "  ".join(f"{value:.4f} ± {sigma:.4f}" for value, sigma in pairs)
            inertia += " kg m² (xx yy zz xy xz yz)"
            small = [
                axis for axis, is_felt in zip(("xx", "yy", "zz"), self.matters, strict=True) if not is_felt
            ]
            if small:
                inertia += (
                    f"; {', '.join(small)} does not matter: no motion of the arm shows less than "
                    f"{_least_moment(self.robot):.3f}"
                )
        declared = " ".join(f"{1e3 * value:.1f}" for value in self.declared.com)
        rows = {
            "mass": self.comparison,
            "com": f"{com} mm from the flange (declared {declared})",
            "inertia": inertia,
            "offsets": " ".join(f"{value:.2f}" for value in self.offset) + " Nm",
            "residual": " ".join(f"{value:.2f}" for value in self.residual) + " Nm",
        }
        return lines(f"Load of the {self.robot.title}", rows)

    def to_tool(self, tool: Tool | KnownTool | str) -> Tool:
        """A tool with this load.

        Args:
            tool: whose frames and shapes stay; or the name of a new tool.
        """
        old = as_tool(tool)
        body = self.body
        return Tool(
            old.name,
            mass=body.mass,
            com=body.com,
            inertia=body.inertia,
            frames=dict(old.frames),
            shapes=old.shapes,
        )

    def save(self, target: str, tool: Tool | KnownTool | str) -> Tool:
        """Save `to_tool` with a saved target, whose arms know it from their next connection on.

        Raises:
            CommandRejected: there is no such target; nothing is changed.
        """
        made = self.to_tool(tool)
        save_tool(target, made)
        return made


def estimate_load(
    samples: LoadSamples,
    *,
    robot: RobotModel | str,
    declared: Body | None = None,
    acceleration: npt.ArrayLike = GRAVITY,
) -> IdentifiedLoad:
    """Compute the load on the flange from measured torques. Nothing moves; `heptarm.calibration.load` measures them.

    Args:
        samples: at rest in some postures between which gravity turns in the flange's axes, or during a motion.
        robot: the robot, or its name.
        declared: load data that the cabinet used meanwhile; None: none.
        acceleration: of gravity in the base frame, shape (3,) [m/s²]; another one for a tilted base.

    Raises:
        CommandRejected: the postures do not differ enough, something touched the arm, or there is no load.
        LimitError: the load is beyond the rating of the robot.
    """
    model = _model(robot)
    instance(samples, LoadSamples, "samples")
    used = Body(0.0, np.zeros(3)) if declared is None else instance(declared, Body, "declared")
    _check_turned(model, samples, acceleration)
    torque = model.tau_max
    by_load = _load_design(model, samples, acceleration)
    measured = -samples.tau_ext.ravel()
    noise = np.maximum(samples.noise, _LEAST_NOISE * torque).ravel()
    prior = _prior(torque)
    # the torques that gains act on without the sensors' noise, which would bias the gains and with them the load: those
    # that the cabinet expects with its load data, and from the second time on what these lack
    expected = (samples.tau + samples.tau_ext).ravel()
    held = expected
    for _ in range(3):
        design = np.concatenate([by_load, _sensor_design(held)], axis=1)
        scaled = design / noise[:, None]
        covariance = _inverse(scaled.T @ scaled + np.diag(prior**-2.0))
        found = covariance @ (scaled.T @ (measured / noise))
        held = expected + by_load @ found[:10]
    _check_known(covariance)
    missed = measured - design @ found
    residual = np.sqrt((missed.reshape(-1, _AXES) ** 2).mean(axis=0))
    _check_untouched(missed.reshape(-1, _AXES), torque, found[10:] / prior[10:])
    # where the model of the errors is too good to be true, they are larger by what is seen
    freedom = len(measured) - 10
    chi = float(((missed / noise) ** 2).sum() + ((found / prior) ** 2).sum()) / max(freedom, 1)
    covariance *= max(1.0, chi)
    total = found[:10] + _parameters_of(used)
    return _estimate(model, total, covariance, used, residual=residual, offset=found[10 : 10 + _AXES])


def _least_moment(model: RobotModel) -> float:
    """Moment of inertia that makes as much torque at the highest acceleration as a sensor has noise [kg m²]."""
    return _FELT * float(model.tau_max[-1] / model.ddq_max[-1])


def _model(given: RobotModel | str) -> RobotModel:
    return robot(given) if isinstance(given, str) else instance(given, RobotModel, "robot")


def _prior(torque: Array) -> Array:
    """Standard deviations of all unknowns before anything is measured: the load, offsets, gains."""
    return np.concatenate(
        [
            [_ANY_MASS],
            np.full(3, _ANY_MOMENT),
            np.full(6, _ANY_INERTIA),
            OFFSET * torque,
            np.full(_AXES, GAIN),
        ]
    )


def _load_design(model: RobotModel, samples: LoadSamples, acceleration: npt.ArrayLike) -> Array:
    """Torques by the parameters of the load, shape (7 n, 10).

    A mean over a short time is that of two moments, before and after its middle by its standard deviation: the squares
    of positions and velocities have a mean of their own.
    """
    after = samples.spread[:, None]
    found = [
        load_regressors(
            model,
            samples.q + off * samples.dq,
            samples.dq + off * samples.ddq,
            samples.ddq,
            acceleration=acceleration,
        )
        for off in ((-after, after) if after.any() else (0.0,))
    ]
    return np.asarray(np.mean(found, axis=0).reshape(-1, len(_BASIS)))


def _sensor_design(held: Array) -> Array:
    """Torques by offsets and gains of the sensors, shape (7 n, 14), of the torques that they measure, shape (7 n,)."""
    each = [np.concatenate([np.eye(_AXES), np.diag(row)], axis=1) for row in held.reshape(-1, _AXES)]
    return np.concatenate(each)


def _inverse(information: Array) -> Array:
    """Inverse of an information matrix whose entries have very different sizes."""
    scale = 1.0 / np.sqrt(np.diagonal(information))
    inner = np.linalg.inv(information * np.outer(scale, scale))
    return np.asarray(inner * np.outer(scale, scale))


def predicted_sigma(
    model: RobotModel, postures: Array, *, noise: float, acceleration: npt.ArrayLike = GRAVITY
) -> Array:
    """Covariance of the load that rests in some postures would give, shape (10, 10).

    Args:
        model: the robot.
        postures: shape (n, 7) [rad].
        noise: standard deviation of a torque after averaging, as a fraction of the axis' highest torque.
        acceleration: of gravity in the base frame, shape (3,) [m/s²].
    """
    still = np.zeros_like(postures)
    samples = LoadSamples(postures, still, still, still)
    held = inverse_dynamics_rows(model, postures, still, still, acceleration=acceleration)
    design = np.concatenate(
        [_load_design(model, samples, acceleration), _sensor_design(held.ravel())], axis=1
    )
    scaled = design / np.tile(noise * model.tau_max, len(postures))[:, None]
    return _inverse(scaled.T @ scaled + np.diag(_prior(model.tau_max) ** -2.0))[:10, :10]


def _check_turned(model: RobotModel, samples: LoadSamples, acceleration: npt.ArrayLike) -> None:
    """Refuse samples between which gravity does not turn in the flange's axes."""
    down = np.asarray(acceleration, dtype=np.float64)
    seen = np.array([forward(model, q)[:3, :3].T @ down for q in samples.q]) / np.linalg.norm(down)
    turned = float(np.arccos(np.clip(seen @ seen.T, -1.0, 1.0)).max())
    if turned < _TURNED:
        raise CommandRejected(
            f"the samples must differ in their postures: gravity turns by {math.degrees(turned):.1f} deg in the "
            f"flange's axes, and at least {math.degrees(_TURNED):.0f} deg are needed",
            parameter="samples",
            value=turned,
            hint="measure with A4 to A7 in several positions",
        )


def _check_known(covariance: Array) -> None:
    """Refuse what the postures do not determine."""
    sigma = np.sqrt(np.diagonal(covariance))
    if sigma[0] > _MASS_KNOWN or sigma[1:4].max() > _MOMENT_KNOWN:
        raise CommandRejected(
            f"the postures do not determine the load: the mass would be known to {sigma[0]:.2f} kg, and its moments to "
            f"{sigma[1:4].max():.3f} kg m; {_MASS_KNOWN:g} kg and {_MOMENT_KNOWN:g} kg m are needed",
            parameter="samples",
            hint="more postures, with A4 to A7 farther apart; begin with A4 and A6 bent",
        )


def _check_untouched(missed: Array, torque: Array, sensors: Array) -> None:
    """Refuse samples with a torque that no load explains, or only with sensors that no robot has.

    Args:
        missed: unexplained torques, shape (n, 7) [Nm].
        torque: highest torques of the axes, shape (7,) [Nm].
        sensors: offsets and gains in prior standard deviations, shape (14,).
    """
    part = np.abs(missed) / torque
    sample, axis = np.unravel_index(int(part.argmax()), part.shape)
    if part[sample, axis] > _TOUCHED or np.abs(sensors).max() > _IMPLAUSIBLE:
        raise CommandRejected(
            f"the samples do not fit one load, sample {sample + 1} least: {abs(missed[sample, axis]):.1f} Nm of "
            f"A{axis + 1} remain, and offsets or gains of the torque sensors would be {np.abs(sensors).max():.1f} "
            "times what is usual",
            parameter="samples",
            value=float(missed[sample, axis]),
            allowed=f"[0, {_TOUCHED * torque[axis]:.1f}] Nm, [0, {_IMPLAUSIBLE:g}] times",
            hint="does the tool or a cable touch something in a posture? Otherwise reference the torque sensors",
        )


def _estimate(
    model: RobotModel, total: Array, covariance: Array, declared: Body, *, residual: Array, offset: Array
) -> IdentifiedLoad:
    """The load of ten parameters, checked."""
    of_load = covariance[:10, :10]
    sigma = np.sqrt(np.diagonal(covariance))
    if total[0] < 2.0 * sigma[0]:
        raise CommandRejected(
            f"mass must be above 0 kg by two standard deviations, got {total[0]:.3f} ± {sigma[0]:.3f} kg: nothing is "
            "on the flange, or the load data in use are too large",
            parameter="mass",
            value=float(total[0]),
            hint="mount the tool; for an empty flange call arm.detach_tool()",
        )
    check_rating(model, float(total[0]), float(sigma[0]))
    is_excited = bool(sigma[4:10].max() < _MEASURED_INERTIA)
    inertia, sigma_inertia = declared.inertia, np.full(6, math.nan)
    if is_excited:
        total = consistent(total, of_load)
        jacobian = _numeric_jacobian(_central_inertia, total)
        inertia = frozen(_central_inertia(total))
        sigma_inertia = np.sqrt(np.diagonal(jacobian @ of_load @ jacobian.T))
    mass, com = float(total[0]), total[1:4] / total[0]
    by = np.concatenate([-com[:, None] / mass, np.eye(3) / mass], axis=1)
    sigma_com = np.sqrt(np.diagonal(by @ of_load[:4, :4] @ by.T))
    return IdentifiedLoad(
        model,
        mass,
        frozen(com),
        inertia,
        float(sigma[0]),
        frozen(sigma_com),
        frozen(sigma_inertia),
        frozen(offset),
        frozen(sigma[10 : 10 + _AXES]),
        frozen(residual),
        declared,
    )


def check_rating(model: RobotModel, mass: float, sigma: float) -> None:
    """Refuse a load beyond the rating of a robot.

    Raises:
        LimitError: it is.
    """
    if mass - 2.0 * sigma > model.rated_load:
        raise LimitError(
            f"mass must be in (0, {model.rated_load:g}] kg, the rated load of the {model.title}, got {mass:.2f} ± "
            f"{sigma:.2f} kg",
            code=2,
            parameter="mass",
            value=mass,
            allowed=f"(0, {model.rated_load:g}] kg",
            hint="take the tool or the workpiece off",
        )


def _central_inertia(parameters: Array) -> Array:
    """Inertia about the centre of mass, xx yy zz xy xz yz, of ten parameters."""
    mass, moment = parameters[0], parameters[1:4]
    at = moment / mass
    about = symmetric(parameters[4:10]) - mass * (float(at @ at) * np.eye(3) - np.outer(at, at))
    return np.asarray(about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])


def _numeric_jacobian(function: Callable[[Array], Array], at: Array) -> Array:
    """Derivatives by central differences, shape (m, n)."""
    step = 1e-6
    columns = [
        (function(at + step * unit) - function(at - step * unit)) / (2.0 * step) for unit in np.eye(len(at))
    ]
    return np.column_stack(columns)


def _pseudo_inertia(parameters: Array) -> Array:
    """The 4 x 4 matrix that is positive definite for a body, and for nothing else."""
    about = symmetric(parameters[4:10])
    second = 0.5 * np.trace(about) * np.eye(3) - about
    return np.block([[second, parameters[1:4, None]], [parameters[None, 1:4], parameters[None, :1]]])


def consistent(parameters: Array, covariance: Array) -> Array:
    """The parameters of a body that are most likely, given an estimate that no body may have.

    Args:
        parameters: the estimate, shape (10,); see `load_regressor`.
        covariance: its covariance, shape (10, 10).
    """
    if np.linalg.eigvalsh(_pseudo_inertia(parameters))[0] > 0.0:
        return parameters
    weight = np.linalg.cholesky(_inverse(covariance)).T
    low = np.tril_indices(4)

    def of(entries: Array) -> Array:
        factor = np.zeros((4, 4))
        factor[low] = entries
        full = factor @ factor.T
        second = full[:3, :3]
        about = np.trace(second) * np.eye(3) - second
        return np.concatenate([[full[3, 3]], full[:3, 3], about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]])

    # begin with the nearest positive definite matrix, then Levenberg-Marquardt
    moments, axes = np.linalg.eigh(_pseudo_inertia(parameters))
    start = axes @ np.diag(np.maximum(moments, 1e-5)) @ axes.T
    theta = np.linalg.cholesky(start)[low]
    damping = 1e-3
    error = weight @ (of(theta) - parameters)
    for _ in range(200):
        slope = weight @ _numeric_jacobian(of, theta)
        normal = slope.T @ slope
        step = np.linalg.solve(normal + damping * np.diag(np.diagonal(normal) + 1e-12), -slope.T @ error)
        tried = weight @ (of(theta + step) - parameters)
        if tried @ tried < error @ error:
            is_done = (error @ error - tried @ tried) < 1e-9 * (error @ error)
            theta, error, damping = theta + step, tried, max(damping / 10.0, 1e-12)
            if is_done:
                break
        else:
            damping *= 10.0
            if damping > 1e9:
                break
    return of(theta)
