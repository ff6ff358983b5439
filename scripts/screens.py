"""Draw the schematic screens of the guide to a real robot: docs/_static/screen-*.svg.

`screens.py` writes them; `screens.py --check` fails if one is out of date. They are drawings of ours: what is where,
and the order in which it is touched. A number in a circle is a step of the list below the drawing.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from scripts.diagrams import COLOURS, EDGE, MUTED, text, write

#: Sizes in pixels.
WIDTH, ROW, HEAD, GAP = 760, 26, 30, 12
CALLOUT, BAR = "#c2410c", "#e6ebf1"


class Row(NamedTuple):
    """A line of a pane.

    Attributes:
        label: its text; one blank at its beginning indents it by one level.
        kind: "text", "field" with a value, "tick", "button", or "file" of a tree.
        step: number in a circle; 0: none.
        value: of a field.
    """

    label: str
    kind: str = "text"
    step: int = 0
    value: str = ""


class Pane(NamedTuple):
    """A part of a screen: its title, its lines, and its fraction of the width."""

    title: str
    rows: tuple[Row, ...]
    fraction: float = 1.0


class Screen(NamedTuple):
    """A window: its title, and panes side by side."""

    title: str
    panes: tuple[Pane, ...]


SCREENS = {
    "project": Screen(
        "Sunrise.Workbench: new Sunrise project",
        (
            Pane(
                "New Sunrise project",
                (
                    Row("Address of the controller", "field", 1, "172.31.1.147"),
                    Row("Name", "field", 0, "lab"),
                    Row("Template: the robot", "field", 2, "LBR iiwa 14 R820"),
                    Row("Media flange", "field", 3, "Touch electrical"),
                    Row("Finish", "button", 4),
                ),
                1.4,
            ),
            Pane(
                "Package Explorer, afterwards",
                (
                    Row("lab", "file"),
                    Row(" src", "file"),
                    Row(" RoboticsAPI.data.xml", "file"),
                    Row(" StationSetup.cat", "file", 5),
                    Row(" SafetyConfiguration.sconf", "file"),
                ),
            ),
        ),
    ),
    "station": Screen(
        "Sunrise.Workbench: StationSetup.cat",
        (
            Pane(
                "Topology",
                (
                    Row("Controller", "file"),
                    Row(" LBR_iiwa_14_R820_1", "file", 1),
                    Row(" Mounting A, B, C", "field", 2, "0, 0, 0"),
                ),
                1.1,
            ),
            Pane(
                "Software",
                (
                    Row("LBR iiwa support", "tick"),
                    Row("Human Robot Collaboration", "tick", 3),
                    Row("Smart Servo, Direct Servo", "tick", 3),
                    Row("Fast Robot Interface", "tick", 3),
                    Row("Hand-Guiding Support", "tick", 3),
                ),
                1.1,
            ),
            Pane(
                "Installation",
                (Row("Save", "button", 4), Row("Install", "button", 5), Row("The cabinet restarts.")),
            ),
        ),
    ),
    "import": Screen(
        "Sunrise.Workbench: File, Import",
        (
            Pane(
                "Import",
                (
                    Row("General", "file"),
                    Row(" Archive File", "file", 1),
                    Row("From archive", "field", 2, "heptarm-sources.zip"),
                    Row("Into folder", "field", 3, "lab/src"),
                    Row("Finish", "button", 4),
                ),
                1.4,
            ),
            Pane(
                "Package Explorer, afterwards",
                (
                    Row("lab", "file"),
                    Row(" src", "file"),
                    Row("  heptarm.app", "file", 5),
                    Row("  heptarm.core", "file"),
                    Row(" RoboticsAPI.data.xml", "file", 6),
                ),
            ),
        ),
    ),
    "synchronize": Screen(
        "Sunrise.Workbench: Synchronize project",
        (
            Pane("Toolbar", (Row("Synchronize project", "button", 1),), 0.8),
            Pane(
                "Project synchronization",
                (
                    Row("Applications: workstation to cabinet", "tick", 2),
                    Row("Process data: look at both sides", "tick", 3),
                    Row("Execute", "button", 4),
                ),
                1.2,
            ),
        ),
    ),
    "safety": Screen(
        "Sunrise.Workbench: SafetyConfiguration.sconf, and the smartPAD",
        (
            Pane(
                "Safety configuration",
                (
                    Row("Emergency stop of the smartPAD", "tick"),
                    Row("Emergency stop, gate at X11: wired?", "tick", 1),
                    Row("Cartesian speed monitoring", "tick", 2),
                    Row("Collision detection", "tick", 2),
                    Row("Tool as safety-oriented tool", "tick", 3),
                ),
                1.4,
            ),
            Pane(
                "smartPAD: Safety, Activation",
                (
                    Row("User", "field", 4, "Safety maintenance"),
                    Row("Activate", "button", 5),
                    Row("Position referencing", "button", 6),
                    Row("Torque referencing", "button", 6),
                ),
                1.1,
            ),
        ),
    ),
    "start": Screen(
        "smartPAD: start the application",
        (
            Pane(
                "Operation mode",
                (Row("Turn the key, choose T1", "button", 1), Row("Turn the key back")),
                0.9,
            ),
            Pane(
                "Applications",
                (
                    Row("HeptarmApplication", "file", 2),
                    Row("Hold the enabling switch", "button", 3),
                    Row("Start", "button", 4),
                ),
            ),
            Pane(
                "Log",
                (
                    Row("heptarm 0.1.0", "text", 5),
                    Row("(sources 3f29a1c07b5d)", "text", 5),
                    Row("listens on 0.0.0.0:30001"),
                ),
                1.1,
            ),
        ),
    ),
}


def drawing(screen: Screen) -> str:
    """A screen as SVG."""
    deepest = max(len(pane.rows) for pane in screen.panes)
    height = 2 * HEAD + ROW * deepest + 3 * GAP
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}" '
        f'font-family="system-ui, sans-serif">',
        f'<rect x="0.5" y="0.5" width="{WIDTH - 1}" height="{height - 1}" rx="6" fill="#ffffff" stroke="{EDGE}"/>',
        f'<path d="M1 {HEAD} H{WIDTH - 1}" stroke="{EDGE}"/>',
        text(GAP, 20, screen.title, size=13, weight=600, anchor="start"),
    ]
    unit = (WIDTH - GAP * (len(screen.panes) + 1)) / sum(pane.fraction for pane in screen.panes)
    x = float(GAP)
    for pane in screen.panes:
        width = unit * pane.fraction
        out += _pane(pane, x, HEAD + GAP, width, height - HEAD - 2 * GAP)
        x += width + GAP
    return "\n".join([*out, "</svg>", ""])


def _pane(pane: Pane, x: float, y: int, width: float, height: int) -> list[str]:
    out = [
        f'<rect x="{x:.0f}" y="{y}" width="{width:.0f}" height="{height}" rx="4" fill="#ffffff" stroke="{EDGE}"/>',
        f'<rect x="{x:.0f}" y="{y}" width="{width:.0f}" height="24" rx="4" fill="{BAR}" stroke="{EDGE}"/>',
        text(round(x) + 8, y + 16, pane.title, size=12, weight=600, anchor="start"),
    ]
    for number, row in enumerate(pane.rows):
        out += _row(row, round(x) + 10, y + HEAD + ROW * number, round(width) - 20)
    return out


def _row(row: Row, x: int, y: int, width: int) -> list[str]:
    label = row.label.lstrip()
    indent = 16 * (len(row.label) - len(label))
    x, width = x + indent, width - indent
    base, out = y + 17, []
    if row.kind == "button":
        out.append(
            f'<rect x="{x}" y="{y + 2}" width="{width - 34}" height="{ROW - 5}" rx="4" fill="{COLOURS[0]}" '
            f'stroke="{EDGE}"/>'
        )
        out.append(text(x + (width - 34) / 2, base, label, size=12))
    elif row.kind == "field":
        out.append(text(x, base, label, size=11, colour=MUTED, anchor="start"))
        left = x + max(64, round(6.2 * len(label)) + 6)
        wide = width - 30 - (left - x)
        out.append(
            f'<rect x="{left}" y="{y + 3}" width="{wide}" height="{ROW - 7}" fill="#ffffff" stroke="{EDGE}"/>'
        )
        out.append(text(left + 5, base, row.value, size=11, anchor="start"))
    else:
        if row.kind == "tick":
            out.append(f'<path d="M{x} {y + 7} h11 v11 h-11 z m2 5 l3 4 l5 -8" fill="none" stroke="{EDGE}"/>')
        elif row.kind == "file":
            out.append(f'<path d="M{x} {y + 7} h5 l2 2 h5 v9 h-12 z" fill="{COLOURS[2]}" stroke="{EDGE}"/>')
        out.append(text(x if row.kind == "text" else x + 18, base, label, size=12, anchor="start"))
    if row.step:
        right = x + width - 12
        out.append(f'<circle cx="{right}" cy="{y + 13}" r="10" fill="{CALLOUT}"/>')
        out.append(text(right, base, str(row.step), size=12, weight=600, colour="#ffffff"))
    return out


def main(arguments: list[str]) -> int:
    """Write the screens, or check them."""
    drawings = {f"screen-{name}.svg": drawing(screen) for name, screen in SCREENS.items()}
    return write(drawings, arguments, by="scripts/screens.py")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
