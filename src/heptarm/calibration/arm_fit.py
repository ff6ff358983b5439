"""A fitted arm from recordings: identified from one, tried on another one, with what both contradict."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from heptarm.calibration.arm_estimate import LEAST_NOISE, estimate_arm
from heptarm.calibration.arm_samples import ArmSamples, aligned_windows, written
from heptarm.calibration.fri_delay import FriDelay, delay_of
from heptarm.errors import CommandRejected
from heptarm.model.dynamics import GRAVITY, inverse_dynamics_rows
from heptarm.record.fri_commands import FriCommands
from heptarm.record.recorded import RecordedData
from heptarm.record.recording import load as load_recording
from heptarm.values.checks import Array, Value, array, frozen, instance, within
from heptarm.values.files import path_of, read_text
from heptarm.values.fitted_arm import QUANTITIES, FittedArm
from heptarm.values.robot import Body, RobotModel, known_robot, robot
from heptarm.values.text import lines

#: What is identified: samples, a recording, or the name of its file.
ArmRun: TypeAlias = ArmSamples | RecordedData | str | Path

_AXES = 7
#: Prediction errors by the noise that are as good as the noise itself.
WITHIN_NOISE = 1.2
#: Windows at which a prediction is compared.
_MOST = 3000


@dataclass(frozen=True, slots=True, eq=False)
class Validation(Value):
    """How well a fitted arm predicts a recording.

    Attributes:
        source: of the recording.
        noise: of the torque sensors in it, standard deviation, shape (7,) [Nm].
        torque: root mean square of measured minus predicted torques of the sensors, shape (7,) [Nm].
        motor: of commanded minus predicted torques of the motors, shape (7,) [Nm].
        deflection: of the distance between commanded and measured positions minus the predicted one, shape (7,) [rad].
        masses: of what the controller's model expects beyond that of heptarm, shape (7,) [Nm].
    """

    source: str
    noise: Array
    torque: Array
    motor: Array
    deflection: Array
    masses: Array

    @property
    def ratio(self) -> Array:
        """Errors of the predicted torques by the noise, shape (7,); 1: nothing is left but noise."""
        return self.torque / self.noise

    @property
    def is_good(self) -> bool:
        """Whether every axis is predicted within 1.2 times its noise."""
        return bool((self.ratio <= WITHIN_NOISE).all())

    @property
    def contradictions(self) -> tuple[str, ...]:
        """What the recording contradicts, in sentences."""
        found = []
        for axis in range(_AXES):
            if self.ratio[axis] > WITHIN_NOISE:
                found.append(
                    f"{self.source or 'samples'}: torques of A{axis + 1} are {self.torque[axis]:.2f} Nm off the "
                    f"prediction, and their noise is {self.noise[axis]:.2f} Nm; "
                    f"masses of the controller that are not heptarm's explain {self.masses[axis]:.2f} Nm"
                )
        return tuple(found)

    def __str__(self) -> str:
        """Errors of all predictions beside the noise."""
        rows = {
            "torques": " ".join(f"{value:.3f}" for value in self.torque) + " Nm off",
            "noise": " ".join(f"{value:.3f}" for value in self.noise) + " Nm",
            "ratio": " ".join(f"{value:.2f}" for value in self.ratio),
            "motors": " ".join(f"{value:.3f}" for value in self.motor) + " Nm off",
            "deflection": " ".join(f"{1e6 * value:.1f}" for value in self.deflection) + " µrad off",
        }
        return lines(f"Prediction of {self.source or 'samples'}", rows)


@dataclass(frozen=True, slots=True, eq=False)
class ArmFit(Value):
    """An identified arm.

    Attributes:
        arm: the numbers, for `sim://MODEL?fitted=FILE`.
        validation: how well they predict a recording: another one if it was given.
        remarks: what the recording does not determine, and why.
        fri: how late FRI commands act; None: no FRI session shows it.
    """

    arm: FittedArm
    validation: Validation
    remarks: tuple[str, ...] = ()
    fri: FriDelay | None = None

    def __str__(self) -> str:
        """The numbers, the prediction, the delay of FRI commands, and the remarks."""
        parts = [str(self.arm), str(self.validation), *([] if self.fri is None else [str(self.fri)])]
        return "\n".join([*parts, *(f"  not known: {remark}" for remark in self.remarks)])

    def save(self, path: str | Path, *, overwrite: bool = False) -> None:
        """Write the file of the fitted arm; see `FittedArm.save`."""
        self.arm.save(path, overwrite=overwrite)


def simulator(
    run: ArmRun,
    *,
    robot: RobotModel | str | None = None,
    validation: ArmRun | None = None,
    fri: RecordedData | str | Path | None = None,
    declared: Body | None = None,
    commissioning: str | Path | None = None,
    acceleration: npt.ArrayLike = GRAVITY,
) -> ArmFit:
    """Identify an arm from a recording, so that a virtual cabinet behaves like it.

    Record the motions of `heptarm.calibration.excitation` at 500 Hz or, by FRI, at 1 kHz, with nothing that touches the
    arm, for a minute or longer. Friction, rotors and load come from the commanded torques beyond those that the
    controller expects; offset, gain and noise of the torque sensors from the external torques; stiffness and delay from
    the distance between commanded and measured positions.

    Args:
        run: what was recorded: samples, a recording, or the name of its file.
        robot: the robot; None: that of the recording.
        validation: another recording, of other motions, that the result has to predict; its flange may be another one.
            None: it is the same one, which proves less.
        fri: another recording, of FRI sessions whose client moves the arm, for the delay of FRI commands; None: those
            of `run`, if it has any.
        declared: load data that the cabinet used meanwhile; None: none.
        commissioning: JSON report of `heptarm check --commission`: what it found to differ is among the contradictions.
        acceleration: of gravity in the base frame, shape (3,) [m/s²]; another one for a tilted base.

    Raises:
        CommandRejected: a recording cannot be used: an axis hardly moves, it lacks torques, it is too slow, something
            touches the arm all the time, or its robot is unknown; or `validation` is of another robot.
        ShapeError: a wrong shape.
    """
    run = run if isinstance(run, ArmSamples) else _recording(run, "run")
    samples, named = samples_of(run, "run")
    model = model_of(robot, named)
    fall = array(acceleration, 3, "acceleration")
    found = estimate_arm(samples, model, acceleration=fall)
    arm, remarks, late = found.arm, found.remarks, None
    state_delay = float(arm.value("state_delay", 0.0)[0])
    if fri is not None:
        late = fri_command_delay(fri, state_delay=state_delay)
    elif isinstance(run, RecordedData):
        late = _fri_delay(run, state_delay)
    if late is None:
        remarks += ("delay of FRI commands: no FRI session is recorded whose client moves the arm",)
    else:
        arm = arm.with_numbers([late.numbers])
    other = samples
    if validation is not None:
        other, named = samples_of(validation, "validation")
        recorded = _recorded_model(model, named, "validation")
        model = recorded if robot is None else model
    tried = _predicted(arm, other, model, declared=declared, acceleration=fall)
    contradictions = (*arm.contradictions, *tried.contradictions, *(late.contradictions if late else ()))
    if commissioning is not None:
        contradictions += _differences(path_of(commissioning, "commissioning"))
    return ArmFit(replace(arm, contradictions=contradictions), tried, remarks, late)


def fri_command_delay(run: RecordedData | str | Path, *, state_delay: float = 0.0) -> FriDelay:
    """Identify how late FRI commands act, from FRI sessions whose client moves the arm.

    Args:
        run: a recording of such sessions by `arm.record`, or of a client by `heptarm.record_client`.
        state_delay: by which measured values come later than commanded ones [s].

    Raises:
        CommandRejected: in no session the arm follows a client that moves it.
        LimitError: the delay is outside its range.
    """
    late = _fri_delay(
        _recording(run, "run"),
        within(state_delay, "state_delay", 0.0, QUANTITIES["state_delay"].high, unit="s"),
    )
    if late is None:
        raise CommandRejected(
            "the recording must have an FRI session whose client moves the arm for half a second or longer",
            parameter="run",
            hint="calibration.excitation(arm, fri_period_ms=2) moves it so; torques and poses do not show the delay",
        )
    return late


def _fri_delay(run: RecordedData, state_delay: float) -> FriDelay | None:
    return delay_of(
        FriCommands.of(run), state_delay=state_delay, source=run.path.name, date=written(run.path)
    )


def validate(
    arm: FittedArm, run: ArmRun, *, declared: Body | None = None, acceleration: npt.ArrayLike = GRAVITY
) -> Validation:
    """Predict a recording by a fitted arm, from the motion that it shows.

    Args:
        arm: the fitted arm.
        run: a recording, best of motions that the arm was not identified from; the flange is that of its robot, and of
            samples that of the fitted arm.
        declared: load data that the cabinet used meanwhile; None: none.
        acceleration: of gravity in the base frame, shape (3,) [m/s²].

    Raises:
        CommandRejected: the recording cannot be used, or is of another robot.
    """
    model = instance(arm, FittedArm, "arm").model
    samples, named = samples_of(run, "run")
    model = _recorded_model(model, named, "run")
    return _predicted(arm, samples, model, declared=declared, acceleration=acceleration)


def _recorded_model(model: RobotModel, named: str, name: str) -> RobotModel:
    """The robot that a recording names, with its flange; the model where it names none that is known.

    Raises:
        CommandRejected: it is another robot than the model.
    """
    found = known_robot(named) if named else None
    if found is None:
        return model
    if found.base_name != model.base_name:
        raise CommandRejected(
            f"{name} must be a recording of an {model.base_name}, got one of an {found.name}",
            parameter=name,
            value=found.name,
            allowed=model.base_name,
            hint="record the robot whose numbers these are",
        )
    return found


def _predicted(
    arm: FittedArm,
    samples: ArmSamples,
    model: RobotModel,
    *,
    declared: Body | None,
    acceleration: npt.ArrayLike,
) -> Validation:
    """How well a fitted arm predicts samples of a robot with its flange."""
    delay, fall = float(arm.value("state_delay", 0.0)[0]), array(acceleration, 3, "acceleration")
    windows = aligned_windows(samples, model, delay=delay, acceleration=fall).thinned(_MOST)
    used = None if declared is None else instance(declared, Body, "declared")
    load = arm.load if used is None else used if arm.load is None else used.joined(arm.load)
    moments = (windows.q, windows.dq, windows.ddq)
    rigid = inverse_dynamics_rows(model, *moments, load=load, acceleration=fall)
    expected = inverse_dynamics_rows(model, *moments, load=used, acceleration=fall)
    shown = rigid + arm.value("torque_gain", 0.0) * rigid + arm.value("torque_offset", 0.0)
    friction = np.zeros_like(rigid) if arm.friction is None else arm.friction.at(windows.dq)
    motor = rigid + friction + arm.value("rotor", 0.0) * windows.ddq
    wound = (friction + rigid - expected) / arm.value("stiffness", np.inf)
    error = windows.error - np.mean(windows.error - wound, axis=0)
    noise = np.maximum(windows.tau_noise, LEAST_NOISE * model.tau_max)
    # of single torques: what the filtered ones are off, with the noise that the filter takes away
    left = _rms(windows.tau - shown) ** 2 + noise**2 * (1.0 - float(windows.centre @ windows.centre))
    return Validation(
        samples.source,
        frozen(noise),
        frozen(np.sqrt(left)),
        _rms(windows.commanded - motor),
        _rms(error - wound),
        _rms(windows.tau + windows.tau_ext - expected),
    )


def _rms(values: Array) -> Array:
    return frozen(np.sqrt((values**2).mean(axis=0)))


def samples_of(run: ArmRun, name: str) -> tuple[ArmSamples, str]:
    """Samples of a recording, and the name of its robot; empty: unknown."""
    if isinstance(run, ArmSamples):
        return run, ""
    recording = _recording(run, name)
    return ArmSamples.of(recording), recording.facts.get("robot", "")


def _recording(run: RecordedData | str | Path, name: str) -> RecordedData:
    read = load_recording(path_of(run, name)) if isinstance(run, (str, Path)) else run
    return instance(read, RecordedData, name)


def model_of(given: RobotModel | str | None, named: str) -> RobotModel:
    """The robot that is given, or that a recording names.

    Raises:
        CommandRejected: none is known.
    """
    if given is not None:
        return robot(given) if isinstance(given, str) else instance(given, RobotModel, "robot")
    found = known_robot(named) if named else None
    if found is None:
        raise CommandRejected(
            "robot must be given: the recording names none that is known",
            parameter="robot",
            hint='for example robot="iiwa14"',
        )
    return found


def _differences(file: Path) -> tuple[str, ...]:
    """Sentences about the steps of a commissioning run that differ from what the simulator assumes."""
    try:
        report = json.loads(read_text(file, name="commissioning"))
        date, steps = report["date"], report["steps"]
        return tuple(
            f"commissioning of {date}: {step['step']}: {comparison['quantity']}: expected {comparison['expected']}, "
            f"measured {comparison['measured']}"
            for step in steps
            for comparison in step["comparisons"]
            if not comparison["agrees"]
        )
    except (KeyError, TypeError, ValueError) as error:
        if isinstance(error, CommandRejected):
            raise
        raise CommandRejected(
            f"{file} is not the report of a commissioning run: {error or type(error).__name__}",
            parameter="commissioning",
            value=str(file),
            hint="heptarm check --commission writes one as JSON",
        ) from None
