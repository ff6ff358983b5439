"""Finds scenarios and runs them one after the other, with the arm at its home and tidy before each."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.errors import HeptarmError, NotReady
from heptarm.testing.measure import NotShown, Unfit, collect
from heptarm.testing.report import Outcome, Report, Verdict
from heptarm.testing.scenario import REGISTRY, Risk, Scenario, defined, selected
from heptarm.testing.stage import HOME, REAL_SPEED, VIRTUAL_SPEED, has_operator
from heptarm.values.motion.ptp import ptp

#: Modules of this package that define scenarios, in the order in which they run.
GROUPS = (
    "model",
    "state",
    "link",
    "motions",
    "paths",
    "programs",
    "modes",
    "patterns",
    "conditions",
    "servo",
    "laws",
    "tools",
    "signals",
    "contact",
    "guiding",
    "safety",
    "applications",
)


def scenarios() -> tuple[Scenario, ...]:
    """All of them, group by group."""
    return defined(REGISTRY, "heptarm.testing.catalogue", GROUPS)


def find(patterns: Sequence[str] = ()) -> tuple[Scenario, ...]:
    """Scenarios by name, group, or pattern such as "motions.*"; without any: all.

    Raises:
        CommandRejected: a pattern that fits none.
    """
    return selected(scenarios(), patterns, what="scenario")


#: At home the joints are within this [rad].
_AT_HOME = 1e-3
#: How long tidying up may wait for the arm [s].
_PATIENCE = 20.0


def run(
    arm: Arm,
    *,
    only: Sequence[str] = (),
    contact: bool = False,
    faults: bool = False,
    ask: Callable[[str], bool] | None = None,
    on_begin: Callable[[Scenario], None] | None = None,
    on_end: Callable[[Outcome], None] | None = None,
) -> Report:
    """Run scenarios; the arm goes to its home before each of them that moves.

    On a robot no axis is faster than a tenth of its maximum, or than `arm.speed` if that is lower; whatever moves is
    asked for before; what needs contact, or lets something go wrong, is left out unless it is wanted.

    Args:
        arm: in control of the robot.
        only: names, groups or patterns of names; none: all.
        contact: on a robot, also those that touch something.
        faults: on a robot, also those in which something goes wrong.
        ask: on a robot, called with a question before anything moves; without it nothing does.
        on_begin: called before each scenario that is tried.
        on_end: called after each one.

    Returns:
        What became of each of them; a scenario that fails ends nothing.

    Raises:
        CommandRejected: a pattern that fits no scenario.
        HeptarmError: at the end the arm cannot be brought home.
    """
    chosen = find(only)
    before = arm.speed
    arm.speed = min(before, VIRTUAL_SPEED if arm.is_virtual else REAL_SPEED)
    outcomes = []
    try:
        for scenario in chosen:
            why = _unfit(scenario, arm, contact=contact, faults=faults)
            if not why and scenario.moves and not arm.is_virtual:
                why = _unwanted(scenario, arm, ask)
            if why:
                outcome = Outcome(scenario, Verdict.LEFT_OUT, why)
            else:
                if on_begin is not None:
                    on_begin(scenario)
                outcome = _try(scenario, arm)
            outcomes.append(outcome)
            if on_end is not None:
                on_end(outcome)
        if any(outcome.verdict is not Verdict.LEFT_OUT and outcome.scenario.moves for outcome in outcomes):
            tidy(arm, home=True)
    finally:
        arm.speed = before
    return Report(f"{arm.robot.title}{' (virtual)' if arm.is_virtual else ''}", tuple(outcomes))


def _unfit(scenario: Scenario, arm: Arm, *, contact: bool, faults: bool) -> str:
    """Why a scenario cannot play here; empty: it can."""
    lacks = [name for name in scenario.needs if name not in arm.capabilities]
    lacks += [name for name in scenario.signals if name not in tuple(arm.io)]
    if lacks:
        return f"this cabinet lacks {', '.join(lacks)}"
    if scenario.operator and not has_operator(arm):
        return "only in a simulator that this program has started"
    if arm.is_virtual:
        return ""
    if scenario.virtual:
        return "only in a simulator"
    if scenario.risk is Risk.CONTACT and not contact:
        return "it touches something; nobody asked for that"
    if scenario.risk is Risk.FAULT and not faults:
        return "it lets something go wrong; nobody asked for that"
    return ""


def _unwanted(scenario: Scenario, arm: Arm, ask: Callable[[str], bool] | None) -> str:
    if ask is None:
        return "nobody was asked whether the robot may move"
    away = np.degrees(np.abs(arm.state.q - HOME).max())
    approach = f"go home, {away:.0f} deg away, then " if away > np.degrees(_AT_HOME) else ""
    words = f"{approach}move within {scenario.space:g} m of home at {arm.speed:.0%} of the full speed"
    return (
        ""
        if ask(f"{scenario.name}: {scenario.title}. The {arm.robot.title} will {words}. Go on?")
        else "not wanted"
    )


def _try(scenario: Scenario, arm: Arm) -> Outcome:
    began = time.perf_counter()
    measured = collect()

    def ended(verdict: Verdict, text: str = "") -> Outcome:
        return Outcome(scenario, verdict, text, time.perf_counter() - began, tuple(measured))

    try:
        tidy(arm, home=scenario.moves)
        scenario.show(arm)
        return ended(Verdict.SHOWN)
    except NotShown as error:
        return ended(Verdict.FAILED, error.text)
    except Unfit as error:
        return ended(Verdict.LEFT_OUT, error.text)
    except HeptarmError as error:
        return ended(Verdict.FAILED, f"{type(error).__name__}: {error}")


def tidy(arm: Arm, *, home: bool) -> None:
    """End whatever runs, undo what a scenario has left; bring the arm home if wanted.

    Raises:
        HeptarmError: that cannot be done.
    """
    if has_operator(arm):
        for words in ("clear", "release", "let_go", "aut", "override 1", "push 0 0 0 0"):
            arm.operator.do(words)
    if not arm.connected:
        arm.reconnect()
    arm.stop()
    arm.wait_for_rest(timeout=_PATIENCE)
    state = arm.state
    if not state.safety.ready_to_move and state.safety.is_known:
        if not arm.is_virtual:  # a person has to find out why it does not move
            raise NotReady(f"the robot is not ready: {', '.join(state.safety.stops) or 'it gives no reason'}")
        arm.recover(timeout=_PATIENCE)
    if state.motion is not None and state.motion.override != 1.0:
        arm.set_override(1.0)
    if arm.is_virtual and state.tool:
        arm.detach_tool()
    if home and np.abs(state.q - HOME).max() > _AT_HOME:
        arm.move(ptp(HOME))
        arm.wait_for_rest(timeout=_PATIENCE)
