"""Reports of policies as files and as text."""

from __future__ import annotations

import sys
from pathlib import Path

from heptarm.cli.output import emit
from heptarm.rl.report import EpisodeReport
from heptarm.values.files import writable_file


def refuse_reports(out: Path | None, *, overwrite: bool, film: bool) -> None:
    """Refuse, before anything runs, a name under which there is a report or cannot be one."""
    if out is not None:
        for suffix in (".npz", ".json", ".png", *([".gif"] if film else [])):
            writable_file(out.with_suffix(suffix), overwrite=overwrite, name="out")


def write_report(
    report: EpisodeReport, out: Path | None, *, film: bool, overwrite: bool, as_json: bool
) -> int:
    """Write a report with its plot, and a film, and print it; returns the exit code."""
    if out is not None:
        files = [report.save(out.with_suffix(ending), overwrite=overwrite) for ending in (".npz", ".json")]
        files.append(report.plot(out.with_suffix(".png"), overwrite=overwrite))
        if film:
            from heptarm.rl.film import film as draw

            files.append(draw(report, out.with_suffix(".gif"), overwrite=overwrite))
        if not as_json:
            print("written:", ", ".join(map(str, files)), file=sys.stderr)
    emit(report.as_dict()) if as_json else print(report.summary())
    return 0
