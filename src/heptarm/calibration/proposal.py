"""What a calibration is about to move, in words, the consent to it, without which nothing moves, and its states."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TypeVar

import numpy as np

from heptarm.arm.verbs import ArmVerbs
from heptarm.errors import CommandRejected, HeptarmError, MotionAborted
from heptarm.model.kinematics import forward
from heptarm.values.checks import Array, callback, frozen
from heptarm.values.robot import RobotModel

_log = logging.getLogger("heptarm.calibration")

PlanT = TypeVar("PlanT")
#: Pushed states per second while something is measured: their means count [Hz].
RATE = 500.0


def swings(postures: Array, start: Array, axes: Iterable[int] = range(7)) -> str:
    """How far axes move from a posture, in degrees: "A4 +0 to +30, A5 -90 to +90"."""
    off = np.degrees(postures - start)
    return ", ".join(f"A{axis + 1} {off[:, axis].min():+.0f} to {off[:, axis].max():+.0f}" for axis in axes)


def flange_box(robot: RobotModel, postures: Sequence[Array] | Array) -> tuple[Array, Array]:
    """Lowest and highest coordinates of the flange in postures, in the base, shape (3,) each [m]."""
    places = np.array([forward(robot, q)[:3, 3] for q in postures])
    return frozen(places.min(axis=0)), frozen(places.max(axis=0))


def box_text(low: Array, high: Array) -> str:
    """A box in words: "x 0.50 to 0.62, y -0.10 to 0.10, z 0.30 to 0.41 m in the base"."""
    pairs = zip("xyz", low, high, strict=True)
    return ", ".join(f"{axis} {a:.2f} to {b:.2f}" for axis, a, b in pairs) + " m in the base"


def agree(plan: PlanT, confirm: Callable[[PlanT], bool] | None, what: str) -> None:
    """Log a plan, and show it to whom it concerns.

    Args:
        plan: what would move.
        confirm: called with it; None: nobody is asked.
        what: would be done, such as "measuring the load".

    Raises:
        CommandRejected: it was not confirmed.
    """
    _log.info("%s", plan)
    if confirm is not None and not callback(confirm, "confirm")(plan):
        raise CommandRejected(f"{what} was not confirmed: nothing moves", parameter="confirm")


@contextlib.contextmanager
def unhindered(what: str) -> Iterator[None]:
    """A block of motions in which nothing should touch the arm; the error of one that was ended has a remedy.

    Args:
        what: is measured, such as "the load".

    Raises:
        MotionAborted: a motion was ended.
    """
    try:
        yield
    except MotionAborted as error:
        error.hint = (
            f"{what} is not measured, and nothing is changed; if tool or arm touched something, begin with more room"
            + (f"; {error.hint}" if error.hint else "")
        )
        raise


@contextlib.contextmanager
def measuring(arm: ArmVerbs) -> Iterator[None]:
    """A block in which the arm pushes as many states as a measurement needs; afterwards as many as before."""
    before = arm.state_rate
    arm.subscribe(rate=RATE, groups=arm.groups)
    try:
        yield
    finally:
        with contextlib.suppress(HeptarmError):  # the connection is lost, which was reported
            arm.subscribe(rate=before, groups=arm.groups)
