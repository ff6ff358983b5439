"""A plot that can be drawn, shown and saved."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from heptarm.errors import CommandRejected
from heptarm.record.plot.content import STYLES, ChartContent, Style
from heptarm.values.checks import flag, word
from heptarm.values.files import path_of, refuse_existing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SUFFIXES = (".png", ".svg", ".pdf", ".html")


@dataclass(frozen=True, eq=False)
class Chart(ChartContent):
    """A plot: what it shows, see `ChartContent`, and how it is drawn and saved."""

    def figure(self, *, style: Style = "screen") -> Figure:
        """Draw it with Matplotlib.

        Args:
            style: "screen"; "paper": one column of a journal (89 mm), small type, colours that the colour-blind can
                tell apart, no title.

        Raises:
            MissingExtra: Matplotlib is not installed.
        """
        from heptarm.record.plot.figure import draw  # needs Matplotlib: an extra

        word(style, "style", STYLES)
        return draw(self, style)

    def save(self, out: str | Path, *, style: Style = "screen", overwrite: bool = False) -> Path:
        """Write it.

        Args:
            out: the file; its suffix chooses the format: .png; .svg and .pdf, which scale without loss; .html, an
                interactive page that needs no network: zoom, values under the cursor, a legend that hides lines.
            style: as in `figure`; a page has its own style.
            overwrite: replace a file that exists.

        Raises:
            CommandRejected: another suffix, a page for paper, or the file exists or cannot be written.
            MissingExtra: Matplotlib is not installed, or plotly for a page.
        """
        path, word_of_style = path_of(out, "out"), word(style, "style", STYLES)
        suffix, allowed = path.suffix.lower(), _SUFFIXES[:-1] if word_of_style == "paper" else _SUFFIXES
        if suffix not in allowed:
            raise CommandRejected(
                f"the suffix must be one of {', '.join(allowed)}, got {path.suffix!r}",
                parameter="out",
                value=str(out),
                allowed=", ".join(allowed),
                hint="a page is for the screen: leave out the style" if suffix == ".html" else "",
            )
        refuse_existing(path, overwrite=flag(overwrite, "overwrite"), name="out")
        if suffix == ".html":
            from heptarm.record.plot.page import page  # needs plotly: an extra

            content = page(self).encode()
        else:
            from heptarm.record.plot.figure import encoded

            content = encoded(self.figure(style=style), suffix.removeprefix("."))
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        except OSError as error:
            raise CommandRejected(
                f"{path} cannot be written: {error.strerror}", parameter="out", value=str(out)
            ) from error
        return path
