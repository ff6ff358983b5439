"""Scenarios: measurements of what a robot can do, on the virtual cabinet and, with care, on a robot.

::

    import heptarm as ha
    from heptarm import testing

    with ha.connect(testing.stage()) as arm:
        report = testing.run(arm, only=["motions.*"])
    print(report.table())

`heptarm check` does the same from the command line.
"""

from heptarm.testing.measure import NotShown, Unfit
from heptarm.testing.report import Outcome, Report, Verdict
from heptarm.testing.runner import find, run, scenarios
from heptarm.testing.scenario import Risk, Scenario
from heptarm.testing.stage import HOME, stage

__all__ = [
    "HOME",
    "NotShown",
    "Outcome",
    "Report",
    "Risk",
    "Scenario",
    "Unfit",
    "Verdict",
    "find",
    "run",
    "scenarios",
    "stage",
]
