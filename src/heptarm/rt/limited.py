"""What the guards have limited, in the shared memory: the loop leaves it, the user's process reads it."""

from __future__ import annotations

from heptarm.fri.guard import AXES, Report
from heptarm.fri.pose_guard import PARTS, PoseReport
from heptarm.rt import layout as at


def publish(layout: at.Layout, report: Report | PoseReport) -> None:
    """Leave what a guard has limited so far."""
    ints, floats = layout.block.ints, layout.block.floats
    size, (counts, worst, allowed) = _places(report)
    for kind in range(len(report.counts)):
        start, end = size * kind, size * (kind + 1)
        ints[counts + start : counts + end] = report.counts[kind]
        floats[worst + start : worst + end] = report.worst[kind]
        floats[allowed + start : allowed + end] = report.allowed[kind]


def lines(layout: at.Layout) -> list[str]:
    """What was left, in words."""
    found: list[str] = []
    ints, floats = layout.block.ints, layout.block.floats
    for report in (Report(), PoseReport()):
        size, (counts, worst, allowed) = _places(report)
        for kind in range(len(report.counts)):
            start, end = size * kind, size * (kind + 1)
            report.counts[kind] = ints[counts + start : counts + end].tolist()
            report.worst[kind] = floats[worst + start : worst + end].tolist()
            report.allowed[kind] = floats[allowed + start : allowed + end].tolist()
        found += report.lines
    return found


def _places(report: Report | PoseReport) -> tuple[int, tuple[int, int, int]]:
    """Numbers of a kind, and where counts, worst and allowed values begin."""
    if isinstance(report, Report):
        return AXES, (at.LIMITED_COUNTS, at.LIMITED_WORST, at.LIMITED_ALLOWED)
    return len(PARTS), (at.POSE_COUNTS, at.POSE_WORST, at.POSE_ALLOWED)
