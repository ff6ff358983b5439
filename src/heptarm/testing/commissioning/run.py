"""The commissioning run: one assumption at a time, in T1, slowly, and only after the person beside the robot agrees."""

from __future__ import annotations

import datetime
from collections.abc import Callable, Sequence

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.errors import ConnectionLost, HeptarmError, ModeConflict, NotReady
from heptarm.testing.commissioning.person import PATIENCE, PROVES, Person, PersonTask
from heptarm.testing.commissioning.report import Agreement, CommissioningReport, StepOutcome
from heptarm.testing.commissioning.step import STEPS, CommissioningStep
from heptarm.testing.measure import Unfit
from heptarm.testing.scenario import defined, selected
from heptarm.testing.stage import HOME, REAL_SPEED, has_operator
from heptarm.values.motion.ptp import ptp
from heptarm.values.state import OperationMode

#: Modules of this package with steps, in the order in which they run: what does not move comes first.
GROUPS = ("sunrise", "sensors", "dynamics", "redundancy", "contact", "drives", "safety", "fri")
#: At home the joints are within this [rad].
_AT_HOME = 1e-3
#: Longest approach to the home position [s].
_APPROACH = 120.0


def steps() -> tuple[CommissioningStep, ...]:
    """All steps, group by group."""
    return defined(STEPS, "heptarm.testing.commissioning", GROUPS)


def find_steps(patterns: Sequence[str] = ()) -> tuple[CommissioningStep, ...]:
    """Steps by name, group, or pattern such as "fri.*"; without any: all.

    Raises:
        CommandRejected: a pattern that fits none.
    """
    return selected(steps(), patterns, what="step")


def commission(
    arm: Arm,
    person: Person,
    *,
    only: Sequence[str] = (),
    on_begin: Callable[[CommissioningStep], None] | None = None,
    on_end: Callable[[CommissioningReport], None] | None = None,
) -> CommissioningReport:
    """Measure, step by step, whether the robot does what the virtual cabinet assumes.

    A simulator that this program has started is put into T1 first, and into AUT afterwards.

    Args:
        arm: in control of the robot, in T1.
        person: beside the robot.
        only: names, groups or patterns of names; none: all.
        on_begin: called before each step.
        on_end: called after each step with the report so far, so that an interrupted run keeps what it measured.

    Raises:
        CommandRejected: a pattern that fits no step.
        ModeConflict: the robot is not in T1.
    """
    chosen = find_steps(only)
    outcomes: list[StepOutcome] = []
    before = arm.speed

    def report() -> CommissioningReport:
        date = datetime.datetime.now().astimezone().isoformat(timespec="seconds")
        return CommissioningReport(
            arm.robot.title, arm.cabinet, arm.software, date, arm.is_virtual, tuple(outcomes)
        )

    if has_operator(arm):
        arm.operator.choose("t1")
        arm.wait_until(lambda s: s.safety.mode is OperationMode.T1, timeout=20.0)
    try:
        check_mode(arm)
        for step in chosen:
            if on_begin is not None:
                on_begin(step)
            outcomes.append(_try(step, arm, person))
            if on_end is not None:
                on_end(report())
    finally:
        arm.speed = before
        if has_operator(arm):
            for words in ("clear", "push 0 0 0", "release", "aut"):
                arm.operator.do(words)
    return report()


def check_mode(arm: Arm) -> None:
    """Check that the robot is in T1.

    Raises:
        ModeConflict: it is not.
    """
    mode = arm.state.safety.mode
    if mode is not OperationMode.T1:
        raise ModeConflict(
            f"operation mode must be T1 for the commissioning run, got {mode.name}",
            parameter="mode",
            value=mode.name,
            allowed="T1",
            hint="turn the key switch of the smartPAD to T1; at the terminal of `heptarm sim`, type t1 and enable",
        )


def _try(step: CommissioningStep, arm: Arm, person: Person) -> StepOutcome:
    lacks = [name for name in step.needs if name not in arm.capabilities]
    if lacks:
        return StepOutcome(step, Agreement.SKIPPED, text=f"this cabinet lacks {', '.join(lacks)}")
    if not arm.connected:
        arm.reconnect()
    if step.movement is not None:
        check_mode(arm)  # its error ends the run: nobody turns the key switch by accident
    try:
        if step.movement is not None:
            if not person.agrees(announcement(step, arm)):
                return StepOutcome(step, Agreement.SKIPPED, text="not wanted")
            prepare(arm, person)
            arm.speed = step.movement.ceiling
        comparisons = step.measure(arm, person)
    except Unfit as error:
        text = f"{PROVES} ({error.text})" if arm.is_virtual else error.text
        return StepOutcome(step, Agreement.SKIPPED, text=text)
    except NotReady as error:
        return StepOutcome(step, Agreement.SKIPPED, text=f"the robot is not ready: {error}")
    except ConnectionLost as error:  # the cabinet has stopped the arm; this settles nothing
        return StepOutcome(step, Agreement.SKIPPED, text=str(error))
    except HeptarmError as error:
        return StepOutcome(step, Agreement.DIFFERS, text=f"{type(error).__name__}: {error}")
    agrees = all(comparison.agrees for comparison in comparisons)
    return StepOutcome(step, Agreement.AGREES if agrees else Agreement.DIFFERS, comparisons)


def announcement(step: CommissioningStep, arm: Arm) -> str:
    """What is about to move, how far, how fast; empty movement: nothing moves."""
    assert step.movement is not None
    away = float(np.degrees(np.abs(arm.state.q - HOME).max()))
    approach = ""
    if away > np.degrees(_AT_HOME):
        approach = (
            f"First all axes go to 0 30 0 -90 0 60 0 deg, up to {away:.0f} deg away, at {REAL_SPEED:.0%} of their "
            "speed. "
        )
    moves = step.movement
    return f"{step.name}: {step.question} {approach}{moves.what} moves {moves.far}, {moves.fast}. Go on?"


def prepare(arm: Arm, person: Person) -> None:
    """Bring the arm to rest at its home position, ready to move.

    Raises:
        NotReady: it does not get ready.
        Unfit: nobody can hold the enabling switch.
    """
    arm.stop()
    arm.wait_for_rest(timeout=20.0)
    arm.speed = REAL_SPEED
    if not arm.state.safety.ready_to_move:
        person.does(PersonTask.HOLD)
        recovery = arm.recover(timeout=PATIENCE)
        if not recovery.done:
            raise NotReady(f"the robot does not get ready: {'; '.join(recovery.remaining)}")
    if np.abs(arm.state.q - HOME).max() > _AT_HOME:
        arm.move(ptp(HOME), timeout=_APPROACH)
    arm.wait_for_rest(timeout=20.0)
