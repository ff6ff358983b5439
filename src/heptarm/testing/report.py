"""What became of the scenarios: as a table, as JSON, as JUnit XML."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Any
from xml.etree import ElementTree

from heptarm.testing.scenario import Scenario


class Verdict(Enum):
    """How a scenario ended."""

    SHOWN = "shown"  # every measurement was as it should be
    FAILED = "failed"  # a measurement, or an error, said otherwise
    LEFT_OUT = "left out"  # it was not tried; the text gives the reason


@dataclass(frozen=True, slots=True)
class Outcome:
    """How one scenario ended.

    Attributes:
        scenario: which one.
        verdict: how.
        text: why it failed or was left out.
        seconds: how long it took here [s].
        measured: what was measured, in words.
    """

    scenario: Scenario
    verdict: Verdict
    text: str = ""
    seconds: float = 0.0
    measured: tuple[str, ...] = ()

    @property
    def data(self) -> dict[str, Any]:
        """As plain data."""
        scenario = self.scenario
        return {
            "scenario": scenario.name,
            "title": scenario.title,
            "rows": list(scenario.rows),
            "line": scenario.line,
            "verdict": self.verdict.value,
            "text": self.text,
            "seconds": round(self.seconds, 3),
            "measured": list(self.measured),
        }


@dataclass(frozen=True, slots=True)
class Report:
    """How a run of scenarios went.

    Attributes:
        robot: what they ran on.
        outcomes: one for each, in order.
    """

    robot: str
    outcomes: tuple[Outcome, ...]

    @property
    def ok(self) -> bool:
        """Whether none has failed and at least one was shown."""
        return self._count(Verdict.FAILED) == 0 and self._count(Verdict.SHOWN) > 0

    def _count(self, verdict: Verdict) -> int:
        return sum(outcome.verdict is verdict for outcome in self.outcomes)

    @property
    def summary(self) -> str:
        """One sentence."""
        counts = ", ".join(f"{self._count(verdict)} {verdict.value}" for verdict in Verdict)
        return f"{self.robot}: {counts} of {len(self.outcomes)}"

    def table(self) -> str:
        """As lines of text: what failed with what was measured, everything else in short."""
        return "\n".join([*self._lines(), self.summary])

    def _lines(self) -> Iterator[str]:
        for outcome in self.outcomes:
            scenario = outcome.scenario
            yield f"{outcome.verdict.value:8}  {scenario.name:32} {outcome.seconds:6.2f} s  {scenario.title}"
            if outcome.text:
                yield f"{'':10}{outcome.text}"
            if outcome.verdict is Verdict.FAILED:
                yield from (f"{'':12}{measured}" for measured in outcome.measured)

    def junit(self) -> str:
        """As JUnit XML, for CI systems."""
        suite = ElementTree.Element(
            "testsuite",
            name=f"heptarm on {self.robot}",
            tests=str(len(self.outcomes)),
            failures=str(self._count(Verdict.FAILED)),
            skipped=str(self._count(Verdict.LEFT_OUT)),
            time=f"{sum(outcome.seconds for outcome in self.outcomes):.3f}",
        )
        for outcome in self.outcomes:
            case = ElementTree.SubElement(
                suite,
                "testcase",
                classname=outcome.scenario.group,
                name=outcome.scenario.name,
                time=f"{outcome.seconds:.3f}",
            )
            if outcome.verdict is Verdict.FAILED:
                ElementTree.SubElement(case, "failure", message=outcome.text)
            elif outcome.verdict is Verdict.LEFT_OUT:
                ElementTree.SubElement(case, "skipped", message=outcome.text)
            if outcome.measured:
                ElementTree.SubElement(case, "system-out").text = "\n".join(outcome.measured)
        return ElementTree.tostring(suite, encoding="unicode", xml_declaration=True)
