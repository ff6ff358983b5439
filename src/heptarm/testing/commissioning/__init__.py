"""Commissioning: the first run on a real robot, which settles what the virtual cabinet only assumes.

`docs/explanation/fidelity.md` lists each assumption and names the step here that settles it. A step announces what will
move, compares what it measures with what the virtual cabinet has, and ends as "agrees", "differs" or "skipped".
`heptarm check --commission` runs the steps and writes the report; `commission` does the same in a program.
"""

from heptarm.testing.commissioning.person import AskedPerson, Person, PersonTask, SimulatedPerson
from heptarm.testing.commissioning.report import Agreement, CommissioningReport, StepOutcome
from heptarm.testing.commissioning.run import commission, find_steps, steps
from heptarm.testing.commissioning.step import CommissioningStep, Comparison, Movement

__all__ = [
    "Agreement",
    "AskedPerson",
    "CommissioningReport",
    "CommissioningStep",
    "Comparison",
    "Movement",
    "Person",
    "PersonTask",
    "SimulatedPerson",
    "StepOutcome",
    "commission",
    "find_steps",
    "steps",
]
