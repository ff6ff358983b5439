"""Writes docs/explanation/figures.md from the newest stored runs of `make bench` and bench/results/figures.toml."""

from __future__ import annotations

import json
import sys
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

try:
    import tomllib
except ModuleNotFoundError:  # Python 3.10
    import tomli as tomllib  # type: ignore[no-redef]

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "bench" / "results"
TEXTS = RESULTS / "figures.toml"
PAGE = ROOT / "docs" / "explanation" / "figures.md"

HEAD = """# Figures

```console
$ make bench                    # all figures, one JSON object per line
$ make bench GROUP=state,fri    # some groups
$ make bench ONLY=round_trip    # one benchmark
$ make bench LIST=1             # groups, names and what they measure
$ make bench STORE=1            # stores the run in bench/results as well
$ make figures                  # writes this page from the newest stored run of each benchmark
```

A figure has `name`, `group`, `value`, `unit`, `reference` (its floor, measured in the same run), `ratio`, `limit` (of
the ratio where there is a floor, otherwise of the value) and `ok`.

Times say little about another machine, ratios do. Each latency is measured beside its floor: what the machine needs
for the same with nothing of heptarm in between. Both take turns in at least five blocks, under the same placement:
all processes on one core, or both sides on one core each. The ratio is the median over the blocks; lowest and highest
stand beside it.

A block is noisy when other processes or the host take more than a tenth of a core, or when its floor is half as high
again as usual. The age of states is also noisy where the machine by itself, beside nothing else, wakes a bare real-time
thread late more often than the percentile leaves out: once in a hundred times for the 99th. Noisy blocks count, and are
counted. `ok` is `null`, *undecided*, if most blocks are noisy or their
middle half lies on both sides of the limit; `BENCH_BLOCKS=15` settles more. Counts and bounds have no floor: if the
machine was disturbed while such a limit was missed, it is undecided, too.
"""
VERDICTS = {True: "met", False: "**missed**", None: "undecided"}

Record = dict[str, Any]


def newest() -> list[Record]:
    """Each benchmark's newest figures, without the retired ones; `machine` and `date` of a figure are those of its run.

    Raises:
        FileNotFoundError: no run is stored.
    """
    runs = []
    for path in sorted(RESULTS.glob("*.jsonl")):
        head, *figures = (json.loads(line) for line in path.read_text().splitlines())
        runs.append((head["date"], path.name, head, figures))
    if not runs:
        raise FileNotFoundError("no stored run in bench/results; make one with: make bench STORE=1")
    found: list[Record] = []
    for _, _, head, figures in sorted(runs, key=lambda run: run[:2], reverse=True):
        known = {figure["run"]["benchmark"] for figure in found}
        found += [figure | head for figure in figures if figure["run"]["benchmark"] not in known]
    return [one for one in found if not any(fnmatchcase(one["name"], pattern) for pattern in retired())]


def machines(figures: list[Record]) -> list[str]:
    """The machines of some figures."""
    return sorted({f"{one['machine']['cores']} cores of {one['machine']['cpu']}" for one in figures})


def groups() -> list[Record]:
    """The text of bench/results/figures.toml for each group."""
    return list(tomllib.loads(TEXTS.read_text())["group"])


def retired() -> list[str]:
    """Names of stored figures that bench/results/figures.toml leaves out."""
    return list(tomllib.loads(TEXTS.read_text())["retired"])


def page(figures: list[Record]) -> str:
    """The whole page.

    Raises:
        KeyError: a stored figure has no description.
    """
    known = [pattern for group in groups() for pattern in group["figures"]]
    for figure in figures:
        failed = figure["name"] == f"{figure['run']['benchmark']}_failed"
        if not failed and not any(fnmatchcase(figure["name"], pattern) for pattern in known):
            raise KeyError(f"{figure['name']} has no description; add one to bench/results/figures.toml")
    return "\n".join([HEAD, *_origin(figures), *(line for one in groups() for line in _group(one, figures))])


def _origin(figures: list[Record]) -> list[str]:
    """Where the figures come from."""
    systems = sorted({f"{one['machine']['kernel']}, Python {one['machine']['python']}" for one in figures})
    has_priority = all(one["machine"]["real_time"] for one in figures)
    loads = [figure["run"]["load"] for figure in figures]
    settings = sorted(
        {f"{name}={value}" for one in figures for name, value in one["run"].get("settings", {}).items()}
    )
    lines = [
        f"This page shows the newest run of each benchmark, on {' and on '.join(machines(figures))}, with "
        f"{' and '.join(systems)}, {'all' if has_priority else 'not all'} with realtime priority. Load average before "
        f"the benchmarks: {min(loads):g} to {max(loads):g}.",
    ]
    if settings:
        lines.append(f"Some benchmarks ran with {', '.join(f'`{one}`' for one in settings)}.")
    return [*lines, ""]


def _runs(figures: list[Record]) -> str:
    """Machine, day and commit of the benchmarks of a group."""
    runs: dict[str, list[str]] = {}
    for one in figures:
        run = f"{one['machine']['cpu']}, {one['date']}, commit `{one['run']['commit']}`"
        names = runs.setdefault(run, [])
        if one["run"]["benchmark"] not in names:
            names.append(one["run"]["benchmark"])
    if len(runs) == 1:
        return f"Run on {next(iter(runs))}."
    return (
        "; ".join(f"{', '.join(f'`{name}`' for name in names)}: {run}" for run, names in runs.items()) + "."
    )


def _group(group: Record, figures: list[Record]) -> list[str]:
    here = [figure for figure in figures if figure["group"] == group["name"]]
    lines = [f"## {group['title']}", "", group["text"].strip(), ""]
    rows = []
    for pattern, text in group["figures"].items():
        found = [figure for figure in here if fnmatchcase(figure["name"], pattern)]
        if found:
            rows.append(_row(text, found))
    for figure in here:
        if figure["name"].endswith("_failed"):
            rows.append(f"| `{figure['run']['benchmark']}` did not finish | | | | {VERDICTS[figure['ok']]} |")
    if rows:
        header = "| figure | measured | floor | ratio: median, lowest to highest | limit |"
        lines += [header, "|---|---|---|---|---|", *rows, "", _runs(here), ""]
    ran = {figure["run"]["benchmark"] for figure in here}
    absent = [name for name in group["benchmarks"] if name not in ran]
    if absent:
        names = ", ".join(f"`{name}`" for name in absent)
        lines += [f"Not stored: {names} (`make bench ONLY={','.join(absent)} STORE=1`).", ""]
    return lines


def _row(text: str, found: list[Record]) -> str:
    """One row; of several figures the worst counts."""

    def badness(figure: Record) -> tuple[int, float]:
        value = figure["value"] if figure["ratio"] is None else figure["ratio"]
        sign = -1.0 if figure.get("at_least") else 1.0
        return [True, None, False].index(figure["ok"]), sign * (float("inf") if value is None else value)

    worst = max(found, key=badness)
    several = f" (worst of {len(found)})" if len(found) > 1 else ""
    measured = "" if worst["value"] is None else _quantity(worst["value"], worst["unit"])
    floor = "" if worst["reference"] is None else _quantity(worst["reference"], worst["unit"])
    return f"| {text}{several} | {measured} | {floor} | {_ratio(worst)} | {_limit(worst)} |"


def _ratio(figure: Record) -> str:
    if figure["ratio"] is None:
        return ""
    blocks, noisy = figure.get("blocks", []), figure.get("noisy", [])
    if not blocks:
        return _number(figure["ratio"])
    quiet = f"; {len(noisy)} of {len(blocks)} blocks noisy" if noisy else ""
    return f"{_number(figure['ratio'])}, {_number(min(blocks))} to {_number(max(blocks))}{quiet}"


def _limit(figure: Record) -> str:
    if figure["limit"] is None:
        return ""
    bound = "≥ " if figure.get("at_least") else "≤ "
    unit = "× floor" if figure["ratio"] is not None else figure["unit"]
    return f"{bound}{_quantity(figure['limit'], unit)}: {VERDICTS[figure['ok']]}"


def _quantity(value: float, unit: str) -> str:
    shown = {"fraction": "%", "count": "", "us": "µs"}.get(unit, unit)
    text = _number(100.0 * value if unit == "fraction" else value)
    return f"{text} {shown}".strip()


def _number(value: float) -> str:
    """Three digits that count; whole numbers whole."""
    if value == round(value) and abs(value) < 1e9:
        return f"{value:,.0f}"
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def main() -> int:
    """Write the page."""
    try:
        text = page(newest())
    except (FileNotFoundError, KeyError) as error:
        print(error.args[0], file=sys.stderr)
        return 1
    PAGE.write_text(text)
    print(PAGE.relative_to(ROOT))
    return 0


if __name__ == "__main__":
    sys.exit(main())
