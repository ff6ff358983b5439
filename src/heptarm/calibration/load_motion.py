"""Measuring the load on the flange: the postures of the arm, the plan that it shows before it moves, its recording."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from heptarm.arm.verbs import ArmVerbs
from heptarm.calibration.arm_samples import SLOWEST, ArmSamples, aligned_windows
from heptarm.calibration.load_estimate import (
    IdentifiedLoad,
    LoadSamples,
    check_rating,
    estimate_load,
    load_regressor,
    predicted_sigma,
)
from heptarm.calibration.proposal import agree, box_text, flange_box, swings, unhindered
from heptarm.errors import CollisionForeseen, CommandRejected, MissingExtra, StaleState
from heptarm.model.dynamics import GRAVITY
from heptarm.values.checks import Array, Value, frozen, instance, within, word
from heptarm.values.mode.mode import Position
from heptarm.values.motion.motion import Motion
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import deg
from heptarm.values.robot import Body, RobotModel
from heptarm.values.state import State
from heptarm.values.text import lines

#: What is measured: "rests" mass and centre of mass; "short" the inertia too, from the motions between the rests;
#: "full" better, since A4 to A7 swing at each rest.
Excitation = Literal["rests", "short", "full"]
EXCITATIONS = ("rests", "short", "full")
#: By how much A4 to A7 move from the first posture in each rest [deg].
_OFFSETS = np.array(
    [
        *([0, 0, 0, 0], [30, 90, -50, 0], [-30, -90, 20, 90], [0, 90, 40, -90], [0, -90, -50, 90]),
        *([30, 0, -60, 0], [-30, 0, 30, 0], [30, -90, 40, 90], [-30, 90, -60, -90]),
    ],
    dtype=float,
)
#: Room that is left to the limits of the joints [rad].
_ROOM = math.radians(3.0)
#: Default speed, a fraction of each axis' maximum, and time for which a rest is measured [s].
SPEED, SECONDS = 0.1, 2.0
#: Noise of an averaged torque that a plan counts on, as a fraction of the axis' highest torque.
_NOISE = 5e-5
#: Time after a motion in which the arm still settles [s].
_SETTLING = 0.1
#: How far an axis swings to each side [rad]: so little that it accelerates or brakes all the time.
_SWING = math.radians(8.0)
#: Least acceleration of an axis at which a moment of a motion counts [rad/s²], and the most moments that are used.
_EXCITING, _MOMENTS = 0.5, 2000
#: Torque of a moment of a motion that the filtered model does not explain, as a fraction of the highest torque.
_MODEL = 1e-4
#: Standard deviations that are larger than this are refused before anything moves: mass [kg], moments [kg m].
_MASS, _MOMENT = 0.15, 0.015


@dataclass(frozen=True, slots=True, eq=False)
class LoadPlan(Value):
    """What moves when a load is measured; nothing has moved yet.

    Attributes:
        robot: the robot.
        excitation: "rests", "short" or "full".
        postures: commanded joint positions of the rests, the present ones first, shape (n, 7) [rad]; A1 to A3 do not
            move.
        speed: fraction of each axis' maximum.
        seconds: time of each rest [s].
        duration: of the whole [s]; NaN: the planner is not installed.
        low: lowest coordinates that the flange has in a rest, base frame, shape (3,) [m].
        high: highest ones, shape (3,) [m].
    """

    robot: RobotModel
    excitation: str
    postures: Array
    speed: float
    seconds: float
    duration: float
    low: Array
    high: Array

    @property
    def legs(self) -> tuple[tuple[Motion, ...], ...]:
        """The motions after each rest, to the next one; back to the first posture at last."""
        swings = [_swings(self.robot, q) if self.excitation == "full" else [] for q in self.postures]
        pairs = zip(swings, np.roll(self.postures, -1, axis=0), strict=True)
        return tuple(tuple(ptp(q) for q in (*swing, following)) for swing, following in pairs)

    @property
    def motions(self) -> tuple[Motion, ...]:
        """All motions."""
        return tuple(motion for leg in self.legs for motion in leg)

    def __str__(self) -> str:
        """What moves, how far, how fast, and for how long."""
        moves = swings(self.postures, self.postures[0], range(3, 7))
        rows = {
            "moves": f"{moves} deg; A1 to A3 stay",
            "swings": f"by {math.degrees(_SWING):.0f} deg, A4 to A7 in turn at each rest"
            if self.excitation == "full"
            else "",
            "flange": f"in the rests {box_text(self.low, self.high)}; between them it moves on arcs",
            "speed": f"at most {self.speed:.0%} of each axis' maximum",
            "rests": f"{len(self.postures)} of {self.seconds:g} s",
            "duration": "" if math.isnan(self.duration) else f"{self.duration:.0f} s",
        }
        return lines(f"Measure the load of the {self.robot.title}", rows)


def load_plan(
    arm: ArmVerbs, *, excitation: Excitation = "rests", speed: float = SPEED, seconds: float = SECONDS
) -> LoadPlan:
    """Plan how to measure the load, from where the arm rests. Nothing moves.

    It is planned and checked as `arm.plan` does: against `arm.workspace`, and by `arm.collision_check`.

    Args:
        arm: connected, at rest, with A4 and A6 bent and room around the flange.
        excitation: "rests": mass and centre of mass, from nine rests; "short": the inertia too, from what is measured
            during the motions between them, which need a higher speed: 0.3 or more; "full": A4 to A7 swing at each
            rest as well, and the inertia is known better.
        speed: ceiling, (0, 1]; the lower one of this and `arm.speed`.
        seconds: time of each rest [s].

    Raises:
        CommandRejected: this posture is not suited.
        CollisionForeseen: `arm.collision_check` found bodies that would touch.
        OutsideWorkspace: it leaves `arm.workspace`.
        ModeConflict: a motion runs.
    """
    word(excitation, "excitation", EXCITATIONS)
    limit = min(within(speed, "speed", 0.0, 1.0, above=True), arm.speed)
    pause = within(seconds, "seconds", 0.1, 60.0, unit="s")
    # the commanded position: an elastic arm that returned to the measured one would have sunk by its deflection
    postures = _postures(arm.robot, arm.state.q_cmd)
    sigma = np.sqrt(np.diagonal(predicted_sigma(arm.robot, postures, noise=_NOISE)))
    if sigma[0] > _MASS or sigma[1:4].max() > _MOMENT:
        raise CommandRejected(
            f"this posture is not suited to measure a load: the mass would be known to {sigma[0]:.2f} kg, and "
            f"{_MASS:g} kg is needed",
            parameter="arm",
            value=float(sigma[0]),
            hint="begin with A4 and A6 bent, for example ptp(ha.deg(0, 30, 0, -90, 0, 60, 0))",
        )
    box = flange_box(arm.robot, postures)
    made = LoadPlan(arm.robot, excitation, frozen(postures), limit, pause, math.nan, *box)
    return _timed(arm, made)


def _postures(model: RobotModel, start: Array) -> Array:
    """The rests, within the limits of the joints: an axis that has no room goes to the other side, or less far."""
    low, high = model.q_min + _ROOM, model.q_max - _ROOM
    result = np.tile(start, (len(_OFFSETS), 1))
    for row, offsets in zip(result[1:], _OFFSETS[1:], strict=True):
        for axis, offset in zip(range(3, 7), deg(*offsets), strict=True):
            down, up = low[axis] - start[axis], high[axis] - start[axis]
            fitting = [angle for angle in (offset, -offset) if down <= angle <= up]
            row[axis] += fitting[0] if fitting else np.clip(offset, min(down, 0.0), max(up, 0.0))
    return result


def _swings(model: RobotModel, middle: Array) -> list[Array]:
    """A swing of each of A4 to A7 to both sides of a posture, within the limits of the joints."""
    low, high = model.q_min + _ROOM, model.q_max - _ROOM
    found = []
    for axis in range(3, 7):
        for angle in (_SWING, -_SWING, 0.0):
            there = middle.copy()
            there[axis] = np.clip(
                middle[axis] + angle, min(low[axis], middle[axis]), max(high[axis], middle[axis])
            )
            found.append(there)
    return found


def _timed(arm: ArmVerbs, plan: LoadPlan) -> LoadPlan:
    """The plan with its duration, checked against workspace and bodies before anything moves."""
    try:
        preview = arm.plan(list(plan.motions), speed=plan.speed, mode=Position(), step=0.05)
    except MissingExtra:
        if arm.workspace is not None or arm.collision_check is not None:
            raise
        return plan
    if preview.collisions:
        first = preview.collisions[0]
        raise CollisionForeseen(
            f"measuring the load would collide: {first}", touch=first, hint="begin in another posture"
        )
    resting = len(plan.postures) * (plan.seconds + _SETTLING)
    return replace(plan, duration=float(preview.t[-1]) + resting)


def load(
    arm: ArmVerbs,
    *,
    plan: LoadPlan | None = None,
    declared: Body | None = None,
    confirm: Callable[[LoadPlan], bool] | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> IdentifiedLoad:
    """Measure mass, centre of mass and, if planned, inertia of what is on the flange. The arm moves, and returns.

    What moves is logged, and shown to `confirm`, before it moves. The load data in use stay: the estimate is compared
    with them, and becomes a tool by `to_tool` or `save`.

    Args:
        arm: in control, at rest, in position control, with nothing that touches it.
        plan: what moves, from `load_plan`; None: its defaults.
        declared: load data that the cabinet uses; None: those of the attached tool and workpiece.
        confirm: called with the plan; nothing moves unless it returns true. None: it moves.
        progress: called after each rest with their number and that of all.

    Raises:
        CommandRejected: it was not confirmed; the posture is not suited; something touched the arm; there is no load.
        LimitError: the load is beyond the rating of the robot; if it is far beyond, nothing has moved.
        StaleState: the subscribed groups lack "joints" or "torques".
        MotionAborted: a stop or an error ended it. Others as `arm.move`.
    """
    arm.wait_for_rest()
    made = load_plan(arm) if plan is None else instance(plan, LoadPlan, "plan")
    _check_states(arm, SLOWEST if made.excitation != "rests" else 0.0)
    if np.abs(arm.state.q_cmd - made.postures[0]).max() > math.radians(1.0):
        raise CommandRejected(
            "the plan begins where the arm does not rest any more",
            parameter="plan",
            hint="make a new one with calibration.load_plan(arm)",
        )
    used = arm.load if declared is None else instance(declared, Body, "declared")
    rests = [_rest(arm, made.seconds)]
    check_rating(arm.robot, *_apparent(arm.robot, rests[0], used))
    agree(made, confirm, "measuring the load")
    moving: list[State] = []
    for index, leg in enumerate(made.legs):
        with recorded(arm) as states, unhindered("the load"):
            arm.move(list(leg), speed=made.speed, mode=Position())
            arm.wait_for_rest()
        moving += states
        if index + 1 < len(made.postures):
            rests.append(_rest(arm, made.seconds))
        if progress is not None:
            progress(len(rests), len(made.postures))
    samples = rests[0]
    for rest in rests[1:]:
        samples = samples.joined(rest)
    if made.excitation != "rests":
        samples = samples.joined(moving_samples(_samples_of(moving), arm.robot, declared=used))
    return estimate_load(samples, robot=arm.robot, declared=used)


def _check_states(arm: ArmVerbs, least: float) -> None:
    """Refuse an arm whose states do not suffice; at least so many per second."""
    missing = {"joints", "torques"} - set(arm.groups)
    if arm.state_rate <= least or missing:
        raise StaleState(
            'measuring a load needs the state groups "joints" and "torques", and for its inertia at least 200 states '
            f"per second, got {arm.state_rate:g} with {', '.join(arm.groups)}",
            hint='arm.subscribe(rate=500, groups=(..., "joints", "torques"))',
        )


def _rest(arm: ArmVerbs, seconds: float) -> LoadSamples:
    """Mean of the states of a rest."""
    first, rows = arm.state.stamp + round(_SETTLING * 1e9), dict[int, State]()
    pushed = arm.states()
    for state in pushed:
        if state.torques is None or state.torques.stamp < first:
            continue
        rows[state.torques.stamp] = state
        if state.torques.stamp > first + seconds * 1e9:
            break
    pushed.close()
    q, tau, tau_ext = (
        np.array([getattr(state, name) for state in rows.values()]) for name in ("q", "tau", "tau_ext")
    )
    noise = tau_ext.std(axis=0) / math.sqrt(len(rows))
    means = (q.mean(axis=0), tau.mean(axis=0), tau_ext.mean(axis=0), noise)
    return LoadSamples(*(mean[None] for mean in means))


def _apparent(model: RobotModel, rest: LoadSamples, used: Body | None) -> tuple[float, float]:
    """Mass that one rest shows, as if it were at the flange, and a bound of its error [kg]."""
    weight = load_regressor(model, rest.q[0])[:, 0] / model.tau_max
    shown = -rest.tau_ext[0] / model.tau_max
    least = float(weight @ weight)
    if least < 1e-6:
        return 0.0, 0.0
    declared = 0.0 if used is None else used.mass
    # a centre of mass far from the flange looks like a heavier load: half of it may be that
    found = float(weight @ shown) / least
    return declared + found, 0.25 * abs(declared + found) + 0.02 / math.sqrt(least)


@contextmanager
def recorded(arm: ArmVerbs) -> Iterator[list[State]]:
    """The states of a block, complete at its end."""
    states: list[State] = []
    pushed = arm.states(size=100_000)
    yield states
    last = arm.state.stamp
    for state in pushed:
        states.append(state)
        if state.stamp >= last:
            break
    pushed.close()


def _samples_of(states: list[State]) -> ArmSamples:
    """States as samples, each moment once."""
    rows = {state.torques.stamp: state for state in states if state.torques is not None}
    names = ("q", "q_cmd", "tau", "tau_ext")
    columns = [np.array([getattr(rows[stamp], name) for stamp in sorted(rows)]) for name in names]
    times = 1e-9 * (np.array(sorted(rows)) - min(rows))
    q, q_cmd, tau, tau_ext = columns
    return ArmSamples(times, q, q_cmd, tau, tau_ext, tau)  # what the motors are commanded does not count here


def moving_samples(samples: ArmSamples, model: RobotModel, *, declared: Body | None) -> LoadSamples:
    """What motions show of a load: the windows of a recording in which an axis accelerates.

    Args:
        samples: of the motions.
        model: the robot.
        declared: load data that the cabinet used; None: none.

    Raises:
        CommandRejected: the states are too few, or nothing accelerates.
    """
    windows = aligned_windows(samples, model, load=declared, acceleration=GRAVITY)
    exciting = np.abs(windows.ddq).max(axis=1) > _EXCITING
    if not exciting.any():
        raise CommandRejected(
            f"no axis accelerates by {_EXCITING:g} rad/s²: the inertia cannot be measured",
            parameter="speed",
            hint="a higher speed, 0.3 or more",
        )
    chosen = windows.some(exciting).thinned(_MOMENTS)
    # windows overlap by half, so that the noise of neighbours is not independent
    half, weights = len(chosen.centre) // 2, chosen.centre
    shared = float(weights[half:] @ weights[: len(weights) - half])
    noise = chosen.tau_noise * math.sqrt(float(weights @ weights) + 2.0 * shared)
    rows = np.tile(np.hypot(noise, _MODEL * model.tau_max), (len(chosen.t), 1))
    spread = np.full(len(chosen.t), math.sqrt(float(weights @ chosen.offsets**2)))
    return LoadSamples(chosen.q, chosen.tau, chosen.tau_ext, rows, chosen.dq, chosen.ddq, spread)
