"""The person beside the robot: confirms, presses what has to be pressed, and reads what no program can read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from heptarm.arm.arm import Arm
from heptarm.errors import HeptarmError
from heptarm.testing.measure import Unfit
from heptarm.testing.stage import has_operator
from heptarm.values.state import State

#: Longest wait for what a person is asked to do [s].
PATIENCE = 180.0
#: What a step that a simulator cannot settle reports there.
PROVES = "simulated: proves the run, not the robot"


class PersonTask(Enum):
    """What a person is asked to do: in words, and as the command of a simulated operator."""

    HOLD = ("Hold the enabling switch; press Start if the smartPAD asks for it.", "enable")
    RELEASE = ("Release the enabling switch.", "release")
    PRESS_STOP = ("Press the emergency stop of the smartPAD.", "emergency_stop")
    RELEASE_STOP = (
        "Turn the emergency stop to release it, acknowledge it at the smartPAD, hold the enabling switch.",
        "clear",
    )
    HANG = (
        "Hang a weight of 1 kg by a string on the flange, let it come to rest, and take your hands off.",
        "push 0 0 -9.81",
    )
    DROP = ("Let the weight drop: cut the string, or open your knot.", "push 0 0 0")
    PLACE_BLOCK = ("Put a firm block, a pile of books for example, 5 to 30 cm below the flange.", "")
    FIND_DRIVE_ERROR = ("Does the smartPAD show an error of a drive now?", "drive_error 3")

    @property
    def words(self) -> str:
        """For a person."""
        return self.value[0]

    @property
    def command(self) -> str:
        """For a simulated operator; empty: the stage has it already."""
        return self.value[1]


class Person(Protocol):
    """Somebody beside the robot."""

    def agrees(self, question: str) -> bool:
        """Whether the robot may do what the question describes."""

    def does(self, action: PersonTask) -> None:
        """Ask for an action; returns at once or when it is done, so wait for its effect.

        Raises:
            Unfit: nobody here can do it.
        """

    def finds(self, action: PersonTask) -> bool:
        """Whether something is the case; a simulated person makes it so."""

    def reads(self, question: str) -> str:
        """What is written in a document or on the smartPAD; empty: not known."""


@dataclass(frozen=True, slots=True)
class SimulatedPerson:
    """Agrees to everything, and operates the simulator that this program has started.

    Attributes:
        arm: connected to a simulator.
    """

    arm: Arm

    def agrees(self, question: str) -> bool:
        """Yes."""
        return True

    def does(self, action: PersonTask) -> None:
        """Operate the simulator.

        Raises:
            Unfit: it is not this program's own.
        """
        if not has_operator(self.arm):
            raise Unfit(f"only a person beside this simulator can do that: {action.words}")
        if action.command:
            self.arm.operator.do(action.command)

    def finds(self, action: PersonTask) -> bool:
        """Make it so."""
        self.does(action)
        return True

    def reads(self, question: str) -> str:
        """There is no document."""
        return ""


@dataclass(frozen=True, slots=True)
class AskedPerson:
    """Answers in words, as at a terminal.

    Attributes:
        ask: returns the answer to a question; empty: none.
        show: shows a text.
    """

    ask: Callable[[str], str]
    show: Callable[[str], None]

    def agrees(self, question: str) -> bool:
        """Whether the answer is yes."""
        return self.ask(f"{question} [y/N] ").strip().lower() in ("y", "yes")

    def does(self, action: PersonTask) -> None:
        """Show what to do."""
        self.show(f">>> {action.words}")

    def finds(self, action: PersonTask) -> bool:
        """Whether the answer is yes."""
        return self.agrees(action.words)

    def reads(self, question: str) -> str:
        """The answer."""
        return self.ask(f"{question} (empty: not known) ").strip()


def number(person: Person, question: str, unit: str) -> float | None:
    """A number that a person reads somewhere; None: not known.

    Raises:
        Unfit: the answer is no number.
    """
    said = person.reads(f"{question} [{unit}]")
    try:
        return float(said.replace(",", ".")) if said else None
    except ValueError:
        raise Unfit(f"{question}: the answer must be a number in {unit}, got {said!r}") from None


def expect(
    arm: Arm, person: Person, action: PersonTask, condition: Callable[[State], object], what: str
) -> State:
    """Ask for an action and wait for its effect on the state.

    Args:
        arm: shows the effect.
        person: does it.
        action: that is asked for.
        condition: of the state after it.
        what: the effect in words.

    Raises:
        Unfit: the effect does not show in time, or nobody can do it.
    """
    person.does(action)
    try:
        return arm.wait_until(condition, timeout=PATIENCE)
    except HeptarmError as error:
        raise Unfit(f"{what} within {PATIENCE:g} s: not seen ({error})") from error
