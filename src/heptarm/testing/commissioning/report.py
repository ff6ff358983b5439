"""What a commissioning run has found: for people as Markdown, for programs as JSON."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from enum import Enum
from typing import Any

from heptarm.testing.commissioning.step import CommissioningStep, Comparison


class Agreement(Enum):
    """Whether the real cabinet does what the virtual one does."""

    AGREES = "agrees"
    DIFFERS = "differs"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class StepOutcome:
    """How one step ended.

    Attributes:
        step: which one.
        verdict: on all of its comparisons.
        comparisons: expected and measured values.
        text: why it was skipped or what failed; empty otherwise.
    """

    step: CommissioningStep
    verdict: Agreement
    comparisons: tuple[Comparison, ...] = ()
    text: str = ""

    @property
    def data(self) -> dict[str, Any]:
        """As plain data; a number that is not finite is None."""
        return {
            "step": self.step.name,
            "question": self.step.question,
            "verdict": self.verdict.value,
            "text": self.text,
            "comparisons": [
                {
                    "quantity": comparison.quantity,
                    "expected": comparison.expected,
                    "measured": comparison.measured,
                    "agrees": comparison.agrees,
                    "value": None
                    if isinstance(comparison.value, float) and not math.isfinite(comparison.value)
                    else comparison.value,
                    "unit": comparison.unit,
                }
                for comparison in self.comparisons
            ],
        }


@dataclass(frozen=True, slots=True)
class CommissioningReport:
    """What a run has found.

    Attributes:
        robot: title of the robot.
        cabinet: name of the cabinet.
        software: version of heptarm's application in the cabinet.
        date: of the run, ISO 8601.
        is_simulated: the robot is virtual: the report proves the run, not the robot.
        outcomes: of the steps, in order.
    """

    robot: str
    cabinet: str
    software: str
    date: str
    is_simulated: bool
    outcomes: tuple[StepOutcome, ...]

    def count(self, verdict: Agreement) -> int:
        """Number of steps with a verdict."""
        return sum(outcome.verdict is verdict for outcome in self.outcomes)

    @property
    def ok(self) -> bool:
        """Whether nothing differs and at least one step agrees."""
        return self.count(Agreement.DIFFERS) == 0 and self.count(Agreement.AGREES) > 0

    @property
    def summary(self) -> str:
        """One sentence."""
        counts = ", ".join(f"{self.count(verdict)} {verdict.value}" for verdict in Agreement)
        return f"{self.robot}{' (simulated)' if self.is_simulated else ''}: {counts} of {len(self.outcomes)} steps"

    def json(self) -> str:
        """As JSON."""
        data = {
            "robot": self.robot,
            "cabinet": self.cabinet,
            "software": self.software,
            "date": self.date,
            "simulated": self.is_simulated,
            "counts": {verdict.value: self.count(verdict) for verdict in Agreement},
            "steps": [outcome.data for outcome in self.outcomes],
        }
        return json.dumps(data, ensure_ascii=False, indent=1) + "\n"

    def markdown(self) -> str:
        """As Markdown: a table of all comparisons, and the reasons of what was skipped or failed."""
        lines = [
            f"# Commissioning of {self.robot}",
            "",
            f"{self.date}, cabinet {self.cabinet or 'without a name'}, heptarm {self.software}.",
            f"{self.summary}.",
            "",
        ]
        if self.is_simulated:
            lines += ["**Simulated: this report proves the run, not the robot.**", ""]
        lines += ["| step | quantity | expected | measured | verdict |", "|---|---|---|---|---|"]
        for outcome in self.outcomes:
            if not outcome.comparisons:
                lines.append(_row(outcome.step.name, outcome.step.question, "", "", outcome.verdict.value))
            for comparison in outcome.comparisons:
                verdict = Agreement.AGREES if comparison.agrees else Agreement.DIFFERS
                lines.append(
                    _row(
                        outcome.step.name,
                        comparison.quantity,
                        comparison.expected,
                        comparison.measured,
                        verdict.value,
                    )
                )
        reasons = [outcome for outcome in self.outcomes if outcome.text]
        if reasons:
            lines += ["", "## Reasons", ""]
            lines += [f"- `{reason.step.name}` {reason.verdict.value}: {reason.text}" for reason in reasons]
        return "\n".join(lines) + "\n"


def _row(*cells: str) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"
