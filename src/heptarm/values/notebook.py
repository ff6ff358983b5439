"""Values as tables of notebooks: the same rows and numbers as their text, escaped, in the colours of the page."""

from __future__ import annotations

import html
from collections.abc import Mapping

_LINE = "border:none;border-bottom:1px solid rgba(127,127,127,0.3);padding:0.15em 0.6em;"
#: Colours are those of the page, dark or light; notebooks stripe tables and align them to the right by themselves.
_STYLES = {
    "table": "border-collapse:collapse;border:none;color:inherit;background:transparent",
    "caption": "caption-side:top;text-align:left;font-weight:bold;color:inherit;padding:0.15em 0",
    "tr": "background:transparent",
    "th": f"{_LINE}text-align:left;vertical-align:top;font-weight:normal;opacity:0.75;white-space:nowrap",
    "text": f"{_LINE}text-align:left;vertical-align:top;white-space:pre-wrap",
    "cell": f"{_LINE}text-align:right;vertical-align:top;white-space:pre;font-variant-numeric:tabular-nums",
}


class Listing(str):
    """A title and aligned rows as one text, which still has them apart; made by `heptarm.values.text.lines`.

    Attributes:
        heading: the first line.
        rows: the other lines by their names.
    """

    heading: str
    rows: Mapping[str, str]


class Cells(str):
    """Several numbers as one text, which still has them apart.

    Attributes:
        cells: each of them; a second line of one is the same in another unit.
    """

    cells: tuple[str, ...]


def as_html(text: str) -> str:
    """A text for a notebook: of a `Listing` a table, otherwise the text itself."""
    if not isinstance(text, Listing):
        return f"<pre>{html.escape(text)}</pre>"
    width = max((len(_cells(row)) for row in text.rows.values()), default=1)
    rows = "".join(
        f'<tr style="{_STYLES["tr"]}"><th scope="row" style="{_STYLES["th"]}">{html.escape(name)}</th>'
        f"{_columns(row, width)}</tr>"
        for name, row in text.rows.items()
    )
    title = f'<caption style="{_STYLES["caption"]}">{html.escape(text.heading)}</caption>'
    return f'<table style="{_STYLES["table"]}">{title}<tbody>{rows}</tbody></table>'


def _cells(row: str) -> tuple[str, ...]:
    return row.cells if isinstance(row, Cells) else (row,)


def _columns(row: str, width: int) -> str:
    """The cells of a row; the last one reaches to the table's edge."""
    cells = _cells(row)
    style = _STYLES["cell" if len(cells) > 1 else "text"]
    spans = [1] * (len(cells) - 1) + [width - len(cells) + 1]
    found = ""
    for cell, span in zip(cells, spans, strict=True):
        wide = f' colspan="{span}"' if span > 1 else ""
        found += f'<td style="{style}"{wide}>{html.escape(cell)}</td>'
    return found
