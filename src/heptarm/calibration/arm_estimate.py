"""Identification of an arm from a recording: friction, stiffness, rotors, sensors, delay, and a load nobody declared.

Three differences of what a cabinet reports are linear in what is unknown:

* commanded torques minus those that the controller's model expects, which are measured plus external ones, are
  friction, inertia of the rotors, and the load that the load data lack; the errors of the torque sensors cancel;
* external torques of an arm that nothing touches are that load, and offset and gain of the sensors;
* commanded minus measured positions are friction and load by the stiffness of the joint, and the delay of the states
  by the speed (the motors follow the set-points; see docs/explanation/fidelity.md).

All are solved by weighted least squares with the accuracy of a referenced sensor as prior knowledge; the two speeds of
the friction curve by Gauss-Newton from the best of a grid. Residuals are not white, so that standard deviations come
from the scatter of whole seconds of the recording (the "sandwich" of Huber, 1967, and White, 1980).
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from heptarm.calibration.arm_samples import (
    MOVING,
    ArmSamples,
    Windows,
    aligned_windows,
    check_moved,
    windows_of,
)
from heptarm.calibration.load_estimate import GAIN, OFFSET, consistent, load_regressors
from heptarm.errors import CommandRejected
from heptarm.values.checks import Array, frozen
from heptarm.values.fitted_arm import QUANTITIES, FittedArm, FittedNumbers
from heptarm.values.robot import RobotModel
from heptarm.values.text import fixed

_AXES = 7
#: Unknowns of each axis, in this order; `slow` is breakaway beyond Coulomb friction.
_UNKNOWNS = ("coulomb", "slow", "viscous", "asymmetry", "rotor", "torque_offset", "torque_gain")
_EACH, _LOAD = len(_UNKNOWNS), 10
#: Places of the load and of the two speeds of the friction curve among all unknowns.
_LOAD_AT = slice(_AXES * _EACH, _AXES * _EACH + _LOAD)
_SHAPE_AT = slice(_LOAD_AT.stop, _LOAD_AT.stop + 2)
#: Prior standard deviations that mean nothing: friction [Nm, Nm s/rad], rotors [kg m²]; the load: mass [kg], first
#: moments [kg m], inertia [kg m²].
_ANY, _ANY_ROTOR = 20.0, 3.0
_ANY_LOAD = (30.0, *[10.0] * 3, *[0.3] * 6)
#: Windows that are used, and those of a search over the speeds of the friction curve.
_MOST, _SEARCHED = 6000, 1500
#: Speeds of transition, and of fading breakaway friction by that, which are tried [rad/s].
_TRANSITIONS = np.geomspace(2e-3, 0.08, 9)
_FADINGS = (1.5, 2.5, 4.0, 8.0)
#: By how much the speeds may leave those of the grid: about its spacing.
_NEAR = 1.8
#: Moments of a window at which its friction is computed.
_MOMENTS = 11
#: Steps of Gauss-Newton.
_STEPS = 6
#: Duration of a part of the recording whose residuals may depend on each other [s].
_PART = 1.0
#: Torque that nothing explains: so many standard deviations, and a fraction of the highest torque of an axis. The
#: largest part of the windows in which there may be one.
_UNEXPLAINED, _TOUCHED, _TOUCHED_PART = 8.0, 0.005, 0.3
#: A load is there from so many standard deviations and so much mass on [kg].
_SURE, _LEAST_LOAD = 4.0, 0.05
#: Largest standard deviation of what is reported, by its value: stiffness; breakaway friction beyond Coulomb friction.
_KNOWN_STIFFNESS, _KNOWN_BREAKAWAY = 0.25, 0.33
#: Residuals up to about so many standard deviations count fully.
_TRUSTED = 6.0
#: Least noise, as a fraction of the highest torque, of ideal sensors; of a position [rad].
LEAST_NOISE, _LEAST_POSITION = 2e-5, 1e-7
#: A shorter delay is none, and the least standard deviation of one [s].
_LEAST_DELAY, _SURE_DELAY = 2e-4, 2e-5
#: Least standard deviations of what is reported, as fractions of the value: the curve is a model, and the torques of a
#: state may belong to positions of the millisecond before. The asymmetry's is one of the Coulomb friction.
_MODEL = {
    "coulomb": 0.005,
    "breakaway": 0.008,
    "viscous": 0.015,
    "rotor": 0.015,
    "stiffness": 0.012,
    "transition": 0.01,
    "stribeck": 0.01,
    "torque_noise": 0.01,
    "position_noise": 0.01,
}


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """What a recording gives.

    Attributes:
        arm: the numbers; its contradictions are those of this recording.
        remarks: what the recording does not determine, and why.
    """

    arm: FittedArm
    remarks: tuple[str, ...]


def estimate_arm(samples: ArmSamples, model: RobotModel, *, acceleration: npt.ArrayLike) -> Estimate:
    """Identify an arm; see the module.

    Raises:
        CommandRejected: an axis hardly moves, the recording is too slow or too short, or something touched the arm all
            the time.
    """
    first = windows_of(samples)
    check_moved(first)
    delay = _rough_delay(first)
    windows = aligned_windows(samples, model, delay=delay, acceleration=acceleration).thinned(_MOST)
    design = _Design.of(windows, model, acceleration)
    found = _solved(design, model)
    touched, contradictions = _touched(design, found, model)
    if touched.any():
        if touched.mean() > _TOUCHED_PART:
            raise CommandRejected(
                f"something touches the arm in {touched.mean():.0%} of the recording, {contradictions[0]}",
                parameter="run",
                value=float(touched.mean()),
                allowed=f"[0, {_TOUCHED_PART:g}]",
                hint="record the motions of calibration.excitation(arm) with nothing in reach",
            )
        design = design.some(~touched)
        found = _solved(design, model)
    numbers, remarks = _numbers(design, found, samples, delay)
    return Estimate(FittedArm(model.name, tuple(numbers), tuple(contradictions)), tuple(remarks))


def _rough_delay(windows: Windows) -> float:
    """Delay of the measured states by the speeds alone [s]; 0: none that matters."""
    found, weights = [], []
    for axis in range(_AXES):
        dq = windows.dq[:, axis]
        rows = np.column_stack([dq, np.tanh(dq / 0.02), np.ones(len(dq)), windows.ddq[:, axis]])
        found.append(float(np.linalg.lstsq(rows, windows.error[:, axis], rcond=None)[0][0]))
        weights.append(float(dq @ dq))
    delay = float(np.average(found, weights=weights))
    return delay if delay > _LEAST_DELAY else 0.0


# ---------------------------------------------------------------------------------------------------- torques


def _curve(windows: Windows, transition: float, stribeck: float) -> tuple[Array, Array, Array]:
    """Means over each window of what multiplies Coulomb, slow and asymmetric friction, shape (m, 7) each."""
    sums = [np.zeros_like(windows.dq) for _ in range(3)]
    some = np.linspace(0, len(windows.offsets) - 1, _MOMENTS).astype(np.intp)
    weights = windows.centre[some] / windows.centre[some].sum()
    for weight, offset in zip(weights, windows.offsets[some], strict=True):
        dq = windows.dq + offset * windows.ddq
        turn = np.tanh(dq / transition)
        sums[0] += weight * turn
        sums[1] += weight * turn * np.exp(-((dq / stribeck) ** 2))
        sums[2] += weight * turn**2
    return sums[0], sums[1], sums[2]


class _Design:
    """The windows, with the torques of a load of each parameter.

    Attributes:
        windows: of the recording.
        by_load: torques by the parameters of a load, shape (m, 7, 10).
        parts: first window of each part of the recording.
    """

    __slots__ = ("by_load", "parts", "windows")

    def __init__(self, windows: Windows, by_load: Array) -> None:
        self.windows, self.by_load = windows, by_load
        part = np.floor((windows.t - windows.t[0]) / _PART)
        self.parts = np.flatnonzero(np.r_[True, np.diff(part) > 0.0])

    @classmethod
    def of(cls, windows: Windows, model: RobotModel, acceleration: npt.ArrayLike) -> _Design:
        """Compute the torques of a load."""
        moments = (windows.q, windows.dq, windows.ddq)
        return cls(windows, load_regressors(model, *moments, acceleration=acceleration))

    def some(self, chosen: npt.NDArray[np.bool_]) -> _Design:
        """Some of the windows."""
        return _Design(self.windows.some(chosen), self.by_load[chosen])


@dataclass(frozen=True, slots=True, eq=False)
class _Solution:
    """Solution of the torques.

    Attributes:
        x: all unknowns, shape (61,).
        covariance: of these, shape (61, 61).
        transition: speed of the transition of Coulomb friction [rad/s].
        stribeck: speed at which breakaway friction fades [rad/s].
        external: external torques that remain, shape (m, 7) [Nm].
        has_load: whether a load that nobody declared is there.
    """

    x: Array
    covariance: Array
    transition: float
    stribeck: float
    external: Array
    has_load: bool

    def of(self, name: str) -> Array:
        """An unknown of each axis, shape (7,)."""
        return self.x[: _AXES * _EACH].reshape(_AXES, _EACH)[:, _UNKNOWNS.index(name)]

    def sigma_of(self, name: str) -> Array:
        """Its standard deviation, shape (7,)."""
        return self.sigma[: _AXES * _EACH].reshape(_AXES, _EACH)[:, _UNKNOWNS.index(name)]

    @property
    def sigma(self) -> Array:
        """Standard deviations of all unknowns, shape (61,)."""
        return np.sqrt(np.diagonal(self.covariance))


def _solved(design: _Design, model: RobotModel) -> _Solution:
    """Solve the torques with a load, and without one where none is found."""
    shape = _searched(design)
    found = _gauss_newton(design, model, shape, has_load=True)
    mass, sigma = found.x[_LOAD_AT][0], found.sigma[_LOAD_AT][0]
    if mass > max(_SURE * sigma, _LEAST_LOAD):
        return found
    return _gauss_newton(design, model, shape, has_load=False)


def _searched(design: _Design) -> tuple[float, float]:
    """The best of a grid of speeds of transition and of fading breakaway friction."""
    windows, by_load = design.windows, design.by_load
    step = max(1, len(windows.t) // _SEARCHED)
    some, torques = windows.some(np.arange(0, len(windows.t), step)), by_load[::step]
    best, shape = math.inf, (0.02, 0.05)
    for transition, fading in itertools.product(_TRANSITIONS, _FADINGS):
        curve = _curve(some, transition, fading * transition)
        left = 0.0
        for axis in range(_AXES):
            moves = np.abs(some.dq[:, axis]) > MOVING
            columns = [term[:, axis] for term in curve] + [some.dq[:, axis], some.ddq[:, axis]]
            rows = np.column_stack([*columns, torques[:, axis, :4]])[moves]
            aim = some.excess[moves, axis]
            off = aim - rows @ np.linalg.lstsq(rows, aim, rcond=None)[0]
            left += math.log(float(off @ off) / max(1, len(aim)) + 1e-12) * len(aim)
        if left < best:
            best, shape = left, (float(transition), float(fading * transition))
    return shape


def _gauss_newton(
    design: _Design, model: RobotModel, shape: tuple[float, float], *, has_load: bool
) -> _Solution:
    """Solve the torques from speeds of the friction curve that are about right.

    Windows in which something touches the arm count little (weights of Cauchy).
    """
    windows, torque = design.windows, model.tau_max
    transition, stribeck = shape
    least = LEAST_NOISE * torque
    single = np.maximum(windows.tau_noise, least) * math.sqrt(float(windows.centre @ windows.centre))
    noise, trust = np.array([single, single]), np.ones(len(windows.t))
    x = np.zeros(_SHAPE_AT.stop)
    expected = windows.tau + windows.tau_ext
    bounds = np.outer([1.0 / _NEAR, _NEAR], shape)
    for _ in range(_STEPS):
        prior = _prior(torque, transition, stribeck, has_load=has_load)
        held = expected + design.by_load @ x[_LOAD_AT]
        rows = _rows(design, x, transition, stribeck, held)
        normal, right = np.diag(prior**-2.0), np.zeros(len(x))
        for block in rows:
            weighted = block.columns * (trust[block.chosen] / noise[block.kind, block.axis] ** 2)[:, None]
            normal[np.ix_(block.places, block.places)] += weighted.T @ block.columns
            right[block.places] += weighted.T @ block.aim
        inverse = _inverse(normal)
        x = inverse @ right
        off = np.zeros((2, _AXES, len(windows.t)))
        for block in rows:
            left = block.aim - block.columns @ x[block.places]
            off[block.kind, block.axis, block.chosen] = left
            usual = 1.4826 * float(np.median(np.abs(left)))
            noise[block.kind, block.axis] = max(usual, 0.1 * least[block.axis])
        trust = 1.0 / (1.0 + np.max((off / (_TRUSTED * noise[:, :, None])) ** 2, axis=(0, 1)) ** 2)
        steps = np.clip(x[_SHAPE_AT], [-0.5 * transition, -0.5 * stribeck], [transition, stribeck])
        transition, stribeck = np.clip(np.add([transition, stribeck], steps), *bounds).tolist()
    parts = np.zeros((len(design.parts), len(x)))
    for block in rows:
        each = np.zeros((len(windows.t), len(block.places)))
        left = (
            trust[block.chosen]
            * off[block.kind, block.axis, block.chosen]
            / noise[block.kind, block.axis] ** 2
        )
        each[block.chosen] = block.columns * left[:, None]
        parts[:, block.places] += np.add.reduceat(each, design.parts, axis=0)
    many = len(parts) / max(1, len(parts) - 1)
    covariance = inverse @ (np.diag(prior**-2.0) + many * parts.T @ parts) @ inverse
    # with few parts the scatter may be small by chance: at least what white noise gives
    more = np.sqrt(np.maximum(np.diagonal(inverse) / np.diagonal(covariance), 1.0))
    covariance *= np.outer(more, more)
    return _Solution(x, covariance, transition, stribeck, off[1].T, has_load)


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """Equations of one axis.

    Attributes:
        kind: 0: commanded torques beyond those expected; 1: external torques.
        axis: from 0.
        places: of their unknowns among all, shape (k,).
        columns: shape (c, k).
        aim: what they have to give, shape (c,) [Nm].
        chosen: their windows, shape (m,).
    """

    kind: int
    axis: int
    places: npt.NDArray[np.intp]
    columns: Array
    aim: Array
    chosen: npt.NDArray[np.bool_]


def _rows(design: _Design, x: Array, transition: float, stribeck: float, held: Array) -> list[_Rows]:
    """The equations of the torques about a solution."""
    windows = design.windows
    curve = _curve(windows, transition, stribeck)
    faster = _curve(windows, 1.01 * transition, stribeck)
    longer = _curve(windows, transition, 1.01 * stribeck)
    found = []
    load, shape = np.arange(_LOAD_AT.start, _LOAD_AT.stop), np.arange(_SHAPE_AT.start, _SHAPE_AT.stop)
    for axis in range(_AXES):
        own = axis * _EACH + np.arange(_EACH)
        known = dict(zip(_UNKNOWNS, x[own].tolist(), strict=True))
        factors = (known["coulomb"], known["slow"], known["asymmetry"])
        columns = [curve[0], curve[1], windows.dq, curve[2], windows.ddq]
        by_shape = [
            sum(by * (other[k] - curve[k])[:, axis] for k, by in enumerate(factors)) / (0.01 * speed)
            for other, speed in ((faster, transition), (longer, stribeck))
        ]
        rows = np.column_stack([*(column[:, axis] for column in columns), design.by_load[:, axis], *by_shape])
        moves = np.abs(windows.dq[:, axis]) > MOVING
        places = np.concatenate([own[:5], load, shape])
        found.append(_Rows(0, axis, places, rows[moves], windows.excess[moves, axis], moves))
        rows = np.column_stack([-np.ones(len(windows.t)), -held[:, axis], -design.by_load[:, axis]])
        every = np.ones(len(windows.t), dtype=bool)
        found.append(_Rows(1, axis, np.concatenate([own[5:], load]), rows, windows.tau_ext[:, axis], every))
    return found


def _prior(torque: Array, transition: float, stribeck: float, *, has_load: bool) -> Array:
    """Standard deviations of all unknowns before anything is measured."""
    axes = np.zeros((_AXES, _EACH))
    axes[:, :4], axes[:, 4], axes[:, 5], axes[:, 6] = _ANY, _ANY_ROTOR, OFFSET * torque, GAIN
    load = np.array(_ANY_LOAD) if has_load else np.full(_LOAD, 1e-9)
    return np.concatenate([axes.ravel(), load, [transition, stribeck]])


def _inverse(information: Array) -> Array:
    """Inverse of an information matrix whose entries have very different sizes."""
    scale = 1.0 / np.sqrt(np.diagonal(information))
    return np.asarray(np.linalg.inv(information * np.outer(scale, scale)) * np.outer(scale, scale))


def _touched(design: _Design, found: _Solution, model: RobotModel) -> tuple[npt.NDArray[np.bool_], list[str]]:
    """Windows with an external torque that nothing explains, and sentences about them."""
    usual = 1.4826 * np.median(np.abs(found.external - np.median(found.external, axis=0)), axis=0)
    bound = np.maximum(_UNEXPLAINED * usual, _TOUCHED * model.tau_max)
    part = np.abs(found.external) / bound
    touched = part.max(axis=1) > 1.0
    sentences: list[str] = []
    times = design.windows.t[touched]
    for group in np.split(np.flatnonzero(touched), np.flatnonzero(np.diff(times) > _PART) + 1):
        if not len(group):
            continue
        row, axis = np.unravel_index(int(part[group].argmax()), part[group].shape)
        begin, end = design.windows.t[[group[0], group[-1]]]
        sentences.append(
            f"from {fixed(begin, 1)} to {fixed(end, 1)} s: {found.external[group[row], axis]:.1f} Nm act on "
            f"A{axis + 1} from outside"
        )
    return touched, sentences


# ------------------------------------------------------------------------------------------- stiffness and delay


def _stiffness(design: _Design, found: _Solution) -> tuple[Array, Array, Array, Array]:
    """Stiffness of each axis [Nm/rad] and delay [s], with standard deviations, shape (7,) each."""
    windows = design.windows
    slow, fade, square = _curve(windows, found.transition, found.stribeck)
    torques = design.by_load @ found.x[_LOAD_AT]
    torques += found.of("coulomb") * slow + found.of("slow") * fade
    torques += found.of("viscous") * windows.dq + found.of("asymmetry") * square
    result = np.full((4, _AXES), math.nan)
    for axis in range(_AXES):
        chosen = windows.is_wound[:, axis]
        columns = np.column_stack(
            [torques[:, axis], windows.dq[:, axis], np.ones(len(windows.t)), windows.ddq[:, axis]]
        )[chosen]
        if chosen.sum() < 20:
            continue
        scale = np.maximum(np.abs(columns).max(axis=0), 1e-12)
        inverse = np.linalg.pinv((columns / scale).T @ (columns / scale)) / np.outer(scale, scale)
        solution = inverse @ (columns.T @ windows.error[chosen, axis])
        off = windows.error[chosen, axis] - columns @ solution
        part = np.floor(windows.t[chosen] / _PART)
        sums = np.add.reduceat(
            columns * off[:, None], np.flatnonzero(np.r_[True, np.diff(part) > 0.0]), axis=0
        )
        sigma = np.sqrt(np.diagonal(inverse @ (sums.T @ sums) @ inverse))
        if solution[0] > 0.0:
            # the torques that wind the joint are not known exactly either
            own = float(np.mean(found.sigma_of("coulomb")[axis] / max(found.of("coulomb")[axis], 1e-9)))
            stiffness = 1.0 / solution[0]
            result[:2, axis] = stiffness, stiffness * math.hypot(sigma[0] * stiffness, min(own, 1.0))
        result[2:, axis] = solution[1], sigma[1]
    return result[0], result[1], result[2], result[3]


# ----------------------------------------------------------------------------------------------------- results


def _numbers(
    design: _Design, found: _Solution, samples: ArmSamples, delay: float
) -> tuple[list[FittedNumbers], list[str]]:
    """All quantities that the recording determines, and remarks about the others."""
    windows, remarks = design.windows, []
    values: dict[str, tuple[Array, Array]] = {}

    def put(name: str, value: Array, sigma: Array) -> None:
        kind, size = QUANTITIES[name], _MODEL.get(name, 0.0) * np.abs(value)
        if name == "asymmetry":
            size = _MODEL["coulomb"] * found.of("coulomb")
        values[name] = np.clip(value, kind.low, kind.high), np.hypot(sigma, size)

    put("coulomb", found.of("coulomb"), found.sigma_of("coulomb"))
    slow, sigma_slow = found.of("slow"), found.sigma_of("slow")
    if (sigma_slow < _KNOWN_BREAKAWAY * np.abs(slow)).any():
        of_both = np.array([_sum_sigma(found, axis) for axis in range(_AXES)])
        put("breakaway", found.of("coulomb") + slow, of_both)
        put("stribeck", np.array([found.stribeck]), found.sigma[_SHAPE_AT][1:])
    else:
        remarks.append("breakaway friction: as Coulomb friction within its uncertainty")
    for name in ("viscous", "asymmetry", "rotor", "torque_offset", "torque_gain"):
        put(name, found.of(name), found.sigma_of(name))
    put("transition", np.array([found.transition]), found.sigma[_SHAPE_AT][:1])
    freedom = 0.5 * len(windows.offsets) * len(windows.t)
    for name, noise in (("torque_noise", windows.tau_noise), ("position_noise", windows.q_noise)):
        put(name, noise, noise / math.sqrt(2.0 * freedom))
    stiffness, sigma, late, sigma_late = _stiffness(design, found)
    unknown = ~(sigma < _KNOWN_STIFFNESS * stiffness)
    if unknown.any():
        axes = ", ".join(f"A{axis + 1}" for axis in np.flatnonzero(unknown))
        remarks.append(
            f"stiffness: friction and load wind {axes} too little; mount a known load and record again"
        )
    else:
        put("stiffness", stiffness, sigma)
    weights = sigma_late**-2.0
    more, spread = float(np.average(late, weights=weights)), float(np.sum(weights) ** -0.5)
    if delay + more > max(_LEAST_DELAY, 2.0 * spread):
        put("state_delay", np.array([delay + more]), np.array([math.hypot(spread, _SURE_DELAY)]))
    if found.has_load:
        covariance = found.covariance[_LOAD_AT, _LOAD_AT]
        put("load", consistent(found.x[_LOAD_AT], covariance), np.sqrt(np.diagonal(covariance)))
    source = f"{samples.source or 'samples'}: {windows.seconds:.0f} s"
    numbers = [FittedNumbers(name, *pair, source, samples.date) for name, pair in values.items()]
    return numbers, remarks


def _sum_sigma(found: _Solution, axis: int) -> float:
    """Standard deviation of the breakaway friction of an axis [Nm]."""
    two = slice(axis * _EACH, axis * _EACH + 2)
    return float(np.sqrt(frozen(found.covariance[two, two]).sum()))
