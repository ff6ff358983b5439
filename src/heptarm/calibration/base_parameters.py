"""Base parameters: the combinations of the links' masses, centres and inertias that the torques of an arm determine.

The torques are linear in the ten parameters of each link. Of the 70 columns only some are independent; the others act
through these (Gautier, "Numerical calculation of the base inertial parameters of robots", 1991, by a QR decomposition
with pivoting). With them the torques of a motion are predicted without KUKA's link masses, which are not published.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from heptarm.calibration.arm_fit import ArmRun, model_of, samples_of
from heptarm.calibration.arm_samples import aligned_windows
from heptarm.calibration.load_estimate import POINTS, TO_PARAMETERS
from heptarm.errors import CommandRejected
from heptarm.model.dynamics import GRAVITY, inverse_dynamics_rows
from heptarm.values.checks import Array, Value, array, frozen, instance, numbers, within
from heptarm.values.robot import RobotModel
from heptarm.values.text import lines

_AXES, _EACH = 7, 10
#: Columns of the regressor are dependent below this part of the first one.
_DEPENDENT = 1e-8
#: Moments that show the structure of the regressor.
_SHOWN = 60
#: Windows that are used, and the parts that are left out in turn for the standard deviations.
_MOST, _PARTS = 800, 10
#: Amplification of the torques' noise above which the motions do not determine the parameters.
_CONDITION = 1e4


def dynamics_regressor(
    model: RobotModel, q: Array, dq: Array, ddq: Array, *, acceleration: npt.ArrayLike = GRAVITY
) -> Array:
    """Matrix whose product with the parameters of all links are the joint torques.

    Args:
        model: the robot; its masses have no effect.
        q: joint positions, shape (n, 7) [rad].
        dq: joint velocities, shape (n, 7) [rad/s].
        ddq: joint accelerations, shape (n, 7) [rad/s²].
        acceleration: of gravity in the base frame, shape (3,) [m/s²].

    Returns:
        Shape (n, 7, 70): for each link mass, first moments x y z [kg m], inertia about the link's origin xx yy zz xy xz
        yz [kg m²].
    """
    instance(model, RobotModel, "model")
    moments = (numbers(q, "q"), numbers(dq, "dq"), numbers(ddq, "ddq"))
    found = np.zeros((len(moments[0]), _AXES, _AXES, _EACH))
    for link in range(_AXES):
        by_point = []
        for number, point in enumerate(POINTS):
            mass, com = np.zeros(_AXES), np.zeros((_AXES, 3))
            mass[link], com[link] = 1.0, point
            alone = replace(model.links, mass=mass, com=com, inertia=np.zeros((_AXES, 3, 3)))
            # a name stands for its numbers: models are looked up by it
            single = replace(model, name=f"{model.name}, point {number} of link {link + 1}", links=alone)
            by_point.append(inverse_dynamics_rows(single, *moments, acceleration=acceleration))
        found[:, :, link] = np.einsum("pb,bnj->njp", TO_PARAMETERS, np.array(by_point))
    return found.reshape(len(moments[0]), _AXES, _AXES * _EACH)


@dataclass(frozen=True, slots=True, eq=False)
class BaseParameters(Value):
    """Base parameters of an arm.

    Attributes:
        robot: the robot.
        columns: columns of `dynamics_regressor` that are independent, shape (b,).
        value: of the base parameters, in the units of these columns, shape (b,).
        sigma: their standard deviations, shape (b,).
        offset: of the torque sensors, shape (7,) [Nm]; that of A1 and of what gravity never turns is part of no load.
        residual: torque of each axis that is not explained, root mean square, shape (7,) [Nm].
        acceleration: of gravity in the base frame, shape (3,) [m/s²].
    """

    robot: RobotModel
    columns: npt.NDArray[np.int64]
    value: Array
    sigma: Array
    offset: Array
    residual: Array
    acceleration: Array

    def torques(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Torques of a motion, without the offsets of the sensors: arguments and result of shape (n, 7)."""
        by = dynamics_regressor(self.robot, q, dq, ddq, acceleration=self.acceleration)
        return np.asarray(by[:, :, self.columns] @ self.value)

    def __str__(self) -> str:
        """How many there are, how well they are known, and what they leave."""
        known = int((np.abs(self.value) > 2.0 * self.sigma).sum())
        rows = {
            "parameters": f"{len(self.value)}, {known} of them beyond two standard deviations",
            "offsets": " ".join(f"{one:.2f}" for one in self.offset) + " Nm",
            "residual": " ".join(f"{one:.3f}" for one in self.residual) + " Nm",
        }
        return lines(f"Base parameters of the {self.robot.title}", rows)


def independent_columns(model: RobotModel, *, acceleration: npt.ArrayLike = GRAVITY) -> npt.NDArray[np.int64]:
    """Columns of `dynamics_regressor` that are independent, in order: the base parameters belong to these."""
    random = np.random.default_rng(0)
    moments = random.uniform(-2.0, 2.0, (3, _SHOWN, _AXES))
    stacked = dynamics_regressor(model, *moments, acceleration=acceleration).reshape(-1, _AXES * _EACH)
    chosen = list[int]()
    basis = np.zeros((len(stacked), 0))
    largest = float(np.linalg.norm(stacked, axis=0).max())
    for column in range(stacked.shape[1]):
        rest = stacked[:, column] - basis @ (basis.T @ stacked[:, column])
        rest -= basis @ (basis.T @ rest)  # twice is enough (Kahan)
        if np.linalg.norm(rest) > _DEPENDENT * largest:
            basis = np.column_stack([basis, rest / np.linalg.norm(rest)])
            chosen.append(column)
    return np.array(chosen)


def base_parameters(
    run: ArmRun,
    *,
    robot: RobotModel | str | None = None,
    delay: float = 0.0,
    acceleration: npt.ArrayLike = GRAVITY,
) -> BaseParameters:
    """Identify the base parameters from the measured torques of a recording, without the masses of the links.

    Args:
        run: a recording of motions of all axes, such as `record_excitation` makes, with nothing that touches the arm;
            what is on the flange is part of the last link.
        robot: the robot; None: that of the recording.
        delay: of the measured states, such as `simulator` finds it [s].
        acceleration: of gravity in the base frame, shape (3,) [m/s²].

    Raises:
        CommandRejected: the recording cannot be used, or its motions do not determine the parameters.
    """
    samples, named = samples_of(run, "run")
    model, fall = model_of(robot, named), array(acceleration, 3, "acceleration")
    late = within(delay, "delay", 0.0, 0.05, unit="s")
    windows = aligned_windows(samples, model, delay=late, acceleration=fall).thinned(_MOST)
    columns = independent_columns(model, acceleration=fall)
    by = dynamics_regressor(model, windows.q, windows.dq, windows.ddq, acceleration=fall)[:, :, columns]
    count, weight = len(windows.q), 1.0 / np.maximum(windows.tau_noise, 1e-6 * model.tau_max)
    offsets = np.broadcast_to(np.eye(_AXES), (count, _AXES, _AXES))
    design = np.concatenate([by, offsets], axis=2) * weight[:, None]
    measured = windows.tau * weight
    flat = design.reshape(-1, design.shape[2])
    size = np.linalg.norm(flat, axis=0)
    # the vertical axis A1 shows no weight, so that its column of an offset is always independent
    if np.linalg.cond(flat / np.where(size > 0.0, size, 1.0)) > _CONDITION or not size.all():
        raise CommandRejected(
            "the motions of the recording do not determine the base parameters of the arm",
            parameter="run",
            hint="record a longer one with a greater reach and speed: heptarm calibrate arm --reach 1 --speed 0.5",
        )
    found = np.linalg.lstsq(flat, measured.ravel(), rcond=None)[0]
    part = np.arange(count) * _PARTS // count
    without = np.array(
        [
            np.linalg.lstsq(
                design[part != one].reshape(-1, flat.shape[1]), measured[part != one].ravel(), rcond=None
            )[0]
            for one in range(_PARTS)
        ]
    )
    sigma = np.sqrt((_PARTS - 1) / _PARTS * np.square(without - without.mean(axis=0)).sum(axis=0))
    missed = (measured - (design @ found)) / weight
    base = len(columns)
    return BaseParameters(
        model,
        columns,
        frozen(found[:base]),
        frozen(sigma[:base]),
        frozen(found[base:]),
        frozen(np.sqrt(np.square(missed).mean(axis=0))),
        frozen(fall),
    )
