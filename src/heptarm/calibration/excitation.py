"""Motions that show what an arm is like: through postures that differ in gravity, at speeds from very slow to fast.

By FRI the client itself moves an axis at last, which shows how late its commands act.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from heptarm.arm.fri.session import Fri
from heptarm.arm.verbs import ArmVerbs
from heptarm.calibration.proposal import agree, box_text, flange_box, swings, unhindered
from heptarm.errors import CollisionForeseen, CommandRejected, OutsideWorkspace
from heptarm.fri.loop.user_api import Output, Params, State
from heptarm.values.checks import Array, Value, array, frozen, instance, integer, within
from heptarm.values.clearance import CollisionCheck
from heptarm.values.mode.mode import Position
from heptarm.values.motion.motion import Motion
from heptarm.values.motion.ptp import ptp
from heptarm.values.robot import RobotModel
from heptarm.values.text import lines

#: Default duration [s], fraction of each axis' maximum in the fastest motion, largest distance from the start [rad].
SECONDS, SPEED, REACH = 60.0, 0.4, 0.6
#: Speeds of the motions in turn, by the fastest one: the slow ones show breakaway friction.
_SPEEDS = (1.0, 0.06, 0.25, 0.02, 0.5, 0.12)
#: The slow motions are shorter by this root of their speed, or they would take all of the time.
_SHORTER = 0.7
#: Part of the axes that change their direction in a motion.
_TO_AND_FRO = 0.75
#: Room that is left to the limits of the joints [rad].
_ROOM = math.radians(5.0)
#: Postures that are tried for a motion before the room is taken as too narrow.
_TRIES = 40
#: Rate of the recording, the most that a cabinet pushes [Hz]; an FRI session beside it adds its cycles at 1 kHz.
_RATE = 500.0
#: By FRI A7 swings by this angle to one side [rad] and back, in this time [s], so many times.
_SWING, _SWING_TIME, _SWINGS = math.radians(6.0), 2.0, 2
#: Time for the last commands to act [s].
_REST = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class ExcitationPlan(Value):
    """What moves to identify an arm; nothing has moved yet.

    Attributes:
        robot: the robot.
        postures: joint positions between which it moves, the first one is where it rests, shape (n, 7) [rad].
        speeds: of the motion to each posture but the first, fractions of each axis' maximum, shape (n - 1,).
        duration: of all motions [s].
        low: lowest coordinates that the flange has in a posture, base frame, shape (3,) [m].
        high: highest ones, shape (3,) [m].
        is_checked: bodies that would touch were looked for.
        fri_period_ms: period of the FRI session that swings A7 at last [ms]; 0: there is none.
    """

    robot: RobotModel
    postures: Array
    speeds: Array
    duration: float
    low: Array
    high: Array
    is_checked: bool
    fri_period_ms: int = 0

    @property
    def motions(self) -> tuple[Motion, ...]:
        """The motions, back to the first posture at last."""
        pairs = zip(self.postures[1:], self.speeds.tolist(), strict=True)
        return tuple(ptp(q, speed=speed) for q, speed in pairs)

    def __str__(self) -> str:
        """What moves, how far, how fast, and for how long."""
        rows = {
            "moves": f"{swings(self.postures, self.postures[0])} deg",
            "flange": f"in the postures {box_text(self.low, self.high)}; between them it moves on arcs",
            "speed": f"{self.speeds.min():.1%} to {self.speeds.max():.0%} of each axis' maximum",
            "collisions": "none foreseen" if self.is_checked else "not checked: set arm.collision_check",
            "duration": f"{self.duration:.0f} s, {len(self.speeds)} motions",
        }
        if self.fri_period_ms:
            angle, seconds = math.degrees(_swing(self.robot, self.postures[0])), _SWINGS * _SWING_TIME
            rows["FRI"] = (
                f"A7 swings by {angle:+.0f} deg and back for {seconds:.0f} s at last, commanded every "
                f"{self.fri_period_ms} ms"
            )
        return lines(f"Identify the {self.robot.title}", rows)


def next_posture(
    model: RobotModel,
    start: Array,
    before: Array,
    *,
    reach: Array | float,
    turn: int,
    random: np.random.Generator,
) -> tuple[Array, float]:
    """Draw the posture after one, and the relative speed of the motion to it.

    Args:
        model: the robot.
        start: middle of the range, shape (7,) [rad].
        before: the posture where the motion begins, shape (7,) [rad].
        reach: the most by which an axis moves from `start`, one number or shape (7,) [rad].
        turn: number of the motion.
        random: draws the posture.
    """
    low = np.maximum(start - reach, model.q_min + _ROOM)
    high = np.minimum(start + reach, model.q_max - _ROOM)
    speed = _SPEEDS[turn % len(_SPEEDS)]
    # most axes turn back, but not all of them together
    is_up = np.where(random.random(7) < _TO_AND_FRO, before < start, before >= start)
    part = speed**_SHORTER * random.uniform(0.6, 1.0, 7)
    return before + part * (np.where(is_up, high, low) - before), speed


def excitation(
    arm: ArmVerbs,
    *,
    seconds: float = SECONDS,
    speed: float = SPEED,
    reach: npt.ArrayLike = REACH,
    collision_check: CollisionCheck | None = None,
    seed: int = 0,
    fri_period_ms: int = 0,
) -> ExcitationPlan:
    """Plan motions that identify the arm, from where it rests. Nothing moves.

    Each motion is planned and checked as `arm.plan` does: against the limits, `arm.workspace`, and bodies.

    Args:
        arm: connected, at rest, with room around it; best with A2, A4 and A6 bent.
        seconds: least duration of the motions [s], up to 3600.
        speed: of the fastest motions, (0, 1]; the lower one of this and `arm.speed`.
        reach: the most by which an axis moves from its position now, one number or shape (7,) [rad].
        collision_check: checks for collisions, such as a `heptarm.CollisionModel`; None: `arm.collision_check`.
        seed: other motions of the same kind, such as those for a validation.
        fri_period_ms: at last an FRI session with this period swings A7, for the delay of FRI commands, 1 to 10 [ms];
            0: there is none.

    Raises:
        CommandRejected: there is no room for such motions, or the cabinet has no FRI.
        MissingExtra: the planner is not installed.
        ModeConflict: a motion runs.
        LimitError: a value outside its range.
    """
    model = instance(arm, ArmVerbs, "arm").robot
    least = within(seconds, "seconds", 1.0, 3600.0, unit="s")
    fastest = min(within(speed, "speed", 0.0, 1.0, above=True), arm.speed)
    far = array(
        np.broadcast_to(np.asarray(reach, dtype=np.float64), 7) if np.ndim(reach) == 0 else reach, 7, "reach"
    )
    for index, angle in enumerate(far.tolist()):
        within(angle, f"reach[{index}]", 0.05, 3.0, unit="rad")
    postures, speeds, duration = [np.asarray(arm.state.q_cmd)], list[float](), 0.0
    if integer(fri_period_ms, "fri_period_ms", 0, 10):
        _check_swing(arm, postures[0], fri_period_ms, collision_check)
    tried, goes_back = 0, False
    random = np.random.default_rng(integer(seed, "seed", 0, 2**31))
    while not goes_back or tried:
        goes_back = duration >= least and len(speeds) >= len(_SPEEDS)
        posture, part = next_posture(
            model, postures[0], postures[-1], reach=far, turn=len(speeds), random=random
        )
        goal, top = (postures[0], fastest) if goes_back else (posture, part * fastest)
        taken = _duration(arm, postures[-1], goal, speed=top, collision_check=collision_check)
        if taken is None:
            tried += 1
            if tried > _TRIES:
                raise CommandRejected(
                    f"there is no room to identify the arm: {_TRIES} motions in a row would collide or leave the "
                    "workspace",
                    parameter="reach",
                    hint="begin where the arm has more room around it, or with a smaller reach",
                )
            continue
        tried = 0
        postures.append(goal)
        speeds.append(top)
        duration += taken
    is_checked = collision_check is not None or arm.collision_check is not None
    box = flange_box(model, postures)
    duration += _SWINGS * _SWING_TIME if fri_period_ms else 0.0
    return ExcitationPlan(
        model, frozen(np.array(postures)), frozen(speeds), duration, *box, is_checked, fri_period_ms
    )


def _duration(
    arm: ArmVerbs, start: Array, goal: Array, *, speed: float, collision_check: CollisionCheck | None
) -> float | None:
    """Duration of a motion [s]; None: it would collide or leave the workspace."""
    try:
        found = arm.plan(
            ptp(goal, speed=speed), start=start, mode=Position(), step=0.05, collision_check=collision_check
        )
    except (OutsideWorkspace, CollisionForeseen):
        return None
    return None if found.collisions else float(found.t[-1])


def _swing(model: RobotModel, start: Array) -> float:
    """By how much A7 swings: away from the nearer limit [rad]."""
    return _SWING if start[6] < 0.5 * (model.q_min[6] + model.q_max[6]) else -_SWING


def swing(state: State, out: Output, params: Params) -> None:
    """Swing A7 to one side and back, a whole number of times; the law of an FRI session."""
    t = min(state.t, params.seconds * params.count)
    out.q[6] += 0.5 * params.angle * (1.0 - math.cos(2.0 * math.pi * t / params.seconds))


def _swinging(arm: ArmVerbs, start: Array, period_ms: int) -> Fri:
    """The session that swings A7; it is not open yet.

    Raises:
        CommandRejected: the cabinet has no FRI.
    """
    params = {"angle": _swing(arm.robot, start), "seconds": _SWING_TIME, "count": _SWINGS}
    return arm.fri("position", period_ms=period_ms, mode=Position(), law=swing, params=params)


def _check_swing(arm: ArmVerbs, start: Array, period_ms: int, collision_check: CollisionCheck | None) -> None:
    """Refuse a swing that the cabinet cannot do, or for which there is no room.

    Raises:
        CommandRejected: it is.
    """
    _swinging(arm, start, period_ms)
    goal = start + _swing(arm.robot, start) * np.eye(7)[6]
    if _duration(arm, start, goal, speed=arm.speed, collision_check=collision_check) is None:
        raise CommandRejected(
            f"there is no room to swing A7 by {math.degrees(goal[6] - start[6]):+.0f} deg by FRI",
            parameter="fri_period_ms",
            value=period_ms,
            hint="begin where the flange has more room around it, or leave fri_period_ms out",
        )


def record_excitation(
    arm: ArmVerbs,
    path: str | Path,
    *,
    plan: ExcitationPlan | None = None,
    confirm: Callable[[ExcitationPlan], bool] | None = None,
    overwrite: bool = False,
) -> Path:
    """Move as planned and record it. The arm moves, and returns.

    Args:
        arm: in control, at rest, in position control, with nothing that touches it.
        path: the file, MCAP; for `heptarm.calibration.simulator`.
        plan: what moves; None: that of `excitation(arm)`.
        confirm: called with the plan; nothing moves unless it returns true. None: it moves.
        overwrite: replace a file that exists.

    Returns:
        The file.

    Raises:
        CommandRejected: it was not confirmed, or the file exists.
        MotionAborted: a stop or an error ended it. Others as `arm.move`.
    """
    instance(arm, ArmVerbs, "arm").wait_for_rest()
    made = excitation(arm) if plan is None else instance(plan, ExcitationPlan, "plan")
    if np.abs(arm.state.q_cmd - made.postures[0]).max() > math.radians(1.0):
        raise CommandRejected(
            "the plan begins where the arm does not rest any more",
            parameter="plan",
            hint="make a new one with calibration.excitation(arm)",
        )
    recorder = arm.record(path, rate=_RATE, overwrite=overwrite)
    agree(made, confirm, "identifying the arm")
    with recorder, unhindered("the arm"):
        for motion in made.motions:
            arm.move(motion, mode=Position())
        arm.wait_for_rest()
        if made.fri_period_ms:
            with _swinging(arm, made.postures[0], made.fri_period_ms) as session:
                while session.active and session.state.t < _SWINGS * _SWING_TIME + _REST:
                    session.wait(0.1)
            arm.wait_for_rest()
    return Path(path)
