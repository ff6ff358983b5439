"""A step of the commissioning run: an assumption about the real cabinet, and the measurement that settles it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from heptarm.arm.arm import Arm
from heptarm.testing.commissioning.person import Person
from heptarm.testing.stage import REAL_SPEED


@dataclass(frozen=True, slots=True)
class Movement:
    """What moves in a step; the person reads it before anything does.

    Attributes:
        what: moves.
        far: how far, with a unit.
        fast: how fast at most, with a unit.
        ceiling: of the speed of every axis in this step, a fraction of its maximum in (0, 1].
    """

    what: str
    far: str
    fast: str
    ceiling: float = REAL_SPEED


@dataclass(frozen=True, slots=True)
class Comparison:
    """A measured value beside the one that the virtual cabinet has.

    Attributes:
        quantity: what was measured.
        expected: by the virtual cabinet, with a unit.
        measured: on this cabinet, with a unit.
        agrees: whether the measured value is the expected one.
        value: the measured number or text, for programs.
        unit: of a number; empty: none.
    """

    quantity: str
    expected: str
    measured: str
    agrees: bool
    value: float | str
    unit: str = ""


def near(quantity: str, value: float, wanted: float, by: float, unit: str = "") -> Comparison:
    """Compare a number with one that it should be close to.

    Args:
        quantity: what was measured.
        value: on this cabinet.
        wanted: in the virtual cabinet.
        by: largest difference that counts as agreement.
        unit: of all of them.
    """
    expected = f"{wanted:.4g} {unit}".rstrip() + f" within {by:.3g}"
    return Comparison(
        quantity,
        expected,
        f"{value:.4g} {unit}".rstrip(),
        bool(abs(value - wanted) <= by),
        float(value),
        unit,
    )


def at_most(quantity: str, value: float, limit: float, unit: str = "") -> Comparison:
    """Compare a number with an upper limit."""
    measured = f"{value:.4g} {unit}".rstrip()
    return Comparison(
        quantity, f"at most {limit:.4g} {unit}".rstrip(), measured, bool(value <= limit), float(value), unit
    )


def at_least(quantity: str, value: float, limit: float, unit: str = "") -> Comparison:
    """Compare a number with a lower limit."""
    measured = f"{value:.4g} {unit}".rstrip()
    return Comparison(
        quantity, f"at least {limit:.4g} {unit}".rstrip(), measured, bool(value >= limit), float(value), unit
    )


def same(quantity: str, value: str, wanted: str) -> Comparison:
    """Compare a word or a text with the expected one."""
    return Comparison(quantity, wanted, value, value == wanted, value)


def largest(values: npt.ArrayLike) -> float:
    """The largest absolute value of an array of any shape."""
    return float(np.max(np.abs(np.asarray(values, dtype=np.float64))))


@dataclass(frozen=True, slots=True)
class CommissioningStep:
    """Settles one assumption.

    Attributes:
        name: group and name, as in "drives.following_error"; `docs/explanation/fidelity.md` names it in the row of the
            assumption.
        question: that it answers, one sentence.
        measure: compares; raises Unfit where there is nothing to compare here.
        movement: what moves meanwhile; None: nothing.
        needs: capabilities of the cabinet that it uses.
    """

    name: str
    question: str
    measure: Callable[[Arm, Person], tuple[Comparison, ...]]
    movement: Movement | None
    needs: tuple[str, ...]

    @property
    def group(self) -> str:
        """What is before the point of its name."""
        return self.name.partition(".")[0]


#: All steps by name.
STEPS: dict[str, CommissioningStep] = {}
_Measure = Callable[[Arm, Person], tuple[Comparison, ...]]


def step(*, movement: Movement | None = None, needs: tuple[str, ...] = ()) -> Callable[[_Measure], _Measure]:
    """Make a step of a function: its module and name are the step's, its docstring's first line the question.

    Args:
        movement: what moves meanwhile; None: nothing.
        needs: capabilities of the cabinet.
    """

    def made(measure: _Measure) -> _Measure:
        name = f"{measure.__module__.rpartition('.')[2]}.{measure.__name__}"
        question = (measure.__doc__ or "").strip().partition("\n")[0]
        STEPS[name] = CommissioningStep(name, question, measure, movement, needs)
        return measure

    return made
