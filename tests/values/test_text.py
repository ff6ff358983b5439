"""Values as text for people: aligned lines with units; `repr` stays exact; notebooks show the same."""

from __future__ import annotations

import html
import math
import pickle
import re
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm import do, modes
from heptarm.arm.motion.servo import ServoStats
from heptarm.skills.insertion import Insertion
from heptarm.skills.replay import Replay
from heptarm.values.condition.contact import Contact
from heptarm.values.io import SignalValues
from heptarm.values.robot import ROBOTS
from heptarm.values.state import (
    Cartesian,
    Control,
    Groups,
    Joints,
    MotionStatus,
    OperationMode,
    Safety,
    State,
    Torques,
    Wrench,
)
from heptarm.values.text import fixed, lines
from heptarm.values.tool import KnownTool
from heptarm.when import path

POSE = ha.Pose.xyz_abc(0.5, -0.1, 0.3, *ha.deg(10, 0, 180))
STATE = State(
    Groups(
        joints=Joints(10**9, ha.deg(1, -2, 3, -4, 5, -6, 7), np.zeros(7), np.full(7, math.nan)),
        torques=Torques(10**9, np.arange(7.0), np.zeros(7), np.zeros(7)),
        pose=Cartesian(10**9, POSE, POSE, ha.Redundancy()),
        wrench=Wrench(10**9, (1.0, 2.0, -3.5), (0.1, 0.2, 0.3)),  # type: ignore[arg-type]
        motion=MotionStatus(10**9, id=12, progress=0.43, queued=2),
        safety=Safety(10**9, OperationMode.T1, emergency_stop=True),
    )
)


def test_a_state_has_a_line_for_each_quantity_in_columns() -> None:
    text = str(STATE)
    rows = {line.split("  ")[1].strip(): line for line in text.splitlines()[1:]}
    assert text.startswith("State at 1.000 s of the cabinet")
    assert rows["q [deg]"].split()[2:] == ["1.00", "-2.00", "3.00", "-4.00", "5.00", "-6.00", "7.00"]
    assert rows["q [rad]"].split()[2] == "0.0175" and rows["dq [deg/s]"].split()[-1] == "-"
    assert len({len(rows[name]) for name in ("joint", "q [deg]", "q [rad]", "tau [Nm]")}) == 1
    assert "x 500.0  y -100.0  z 300.0 mm" in rows["pose"] and "(0.5000 -0.1000 0.3000 m" in rows["pose"]
    assert "force 1.00 2.00 -3.50 N" in rows["wrench"]
    assert "12, item 0, 43%, 2 waiting" in rows["motion"]
    assert "T1, not ready, emergency stop" in rows["safety"]
    assert "io" not in rows and "control" not in rows


def test_results_tools_motions_and_statistics() -> None:
    result = str(ha.Result(ha.Cause.STOPPED, STATE, 0.01, 1.5, code=9, text="somebody pressed it"))
    assert "stopped: somebody pressed it (code 9)" in result and "0.5730 deg (0.010000 rad)" in result
    assert "1.500 s" in result and "force" not in result
    contact = ha.Result(ha.Cause.CONDITION, peak_force=21.234, rest_force=3.0)
    assert "peak 21.23 N, at rest 3.00 N" in str(contact)
    tool = str(ha.Tool("gripper", mass=1.2, com=(0, 0, 0.06), tcp=ha.Pose.at(0, 0, 0.12)))
    assert tool.startswith("Tool gripper\n") and "0.0 0.0 60.0 mm" in tool and "z 120.0 mm" in tool
    motion = str(ha.lin(POSE, speed_mps=0.1, blend_m=0.02))
    assert (
        motion.splitlines()[0] == "Lin" and "0.1 m/s" in motion and "0.02 m" in motion and "nan" not in motion
    )
    assert "... 4 more" in str(ha.spline([POSE.shifted(x=0.01 * i) for i in range(10)]))
    assert "0.5 of the maximum" in str(ha.ptp(ha.deg(1, 2, 3, 4, 5, 6, 7), speed=0.5))
    assert "3 s" in str(ha.hold(3.0))
    stats = str(ServoStats(10, 99.5, 1, 20e-6, 50e-6))
    assert "20 us median" in stats and "- ms median" in stats


class _Table(HTMLParser):
    """A table as a browser reads it; fails on tags that are not closed, or not in their order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.rows: list[list[str]] = []
        self.widths: list[int] = []
        self.caption, self.texts, self.styles = "", "", ""
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        inside = {"table": [], "caption": ["table"], "tbody": ["table"], "tr": ["table", "tbody"]}
        assert self.open == inside.get(tag, ["table", "tbody", "tr"]), tag
        self.open.append(tag)
        self.styles += str(dict(attrs).get("style"))
        if tag == "tr":
            self.rows.append([])
            self.widths.append(0)
        elif tag in ("td", "th"):
            self.rows[-1].append("")
            self.widths[-1] += int(dict(attrs).get("colspan") or 1)
        else:
            assert tag in inside

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts += f" {data}"
        if self.open[-1] == "caption":
            self.caption = data
        else:
            self.rows[-1][-1] += data


def _numbers(text: str) -> list[str]:
    return sorted(re.findall(r"-?\d+(?:\.\d+)?", text))


@pytest.mark.parametrize(
    "value",
    [
        STATE,
        ha.State(),
        ha.Result(ha.Cause.CONDITION, STATE, residual=1e-4, duration=2.0, peak_force=11.0, rest_force=2.0),
        ha.Tool("gripper", mass=1.2, com=(0, 0, 0.06), tcp=ha.Pose.at(0, 0, 0.12)),
        ServoStats(10, 99.5, 1, 20e-6, 50e-6),
        ha.ptp(ha.deg(0, 35, 0, -80, 0, 60, 0), speed=0.5),
        ha.lin(POSE, speed_mps=0.1, blend_m=0.02),
        ha.spline([POSE.shifted(x=0.01 * i) for i in range(10)]),
    ],
    ids=lambda one: type(one).__name__,
)
def test_a_notebook_shows_a_table_with_the_numbers_of_the_text(value: Any) -> None:
    table, text = _Table(value._repr_html_()), str(value)
    assert table.caption == text.splitlines()[0]
    assert _numbers(table.texts) == _numbers(text)
    assert len(set(table.widths)) <= 1, "all rows reach to the edge"
    names = [line.split("  ")[1].strip() for line in text.splitlines()[1:] if line[2] != " "]
    assert [row[0] for row in table.rows] == names
    assert "inherit" in table.styles and not re.search(r"#[0-9a-f]{3}|white(?!-space)|black", table.styles)


def test_joints_have_columns_of_degrees_and_of_radians() -> None:
    rows = {name: cells for name, *cells in _Table(STATE._repr_html_()).rows}
    assert rows["joint"] == [f"A{i}" for i in range(1, 8)]
    turned, same = (np.array(rows[name], float) for name in ("q [deg]", "q [rad]"))
    np.testing.assert_allclose(np.radians(turned), same, atol=1e-4)
    (target,) = [cells for name, *cells in _Table(ha.ptp(STATE.q)._repr_html_()).rows if name == "q"]
    assert [cell.split("\n") for cell in target] == [
        [f"{a} deg", f"{b} rad"] for a, b in zip(rows["q [deg]"], rows["q [rad]"], strict=True)
    ]


def test_nothing_of_a_value_is_markup_in_a_notebook() -> None:
    name = "<script>alert('a&b')"
    for value in (ha.Tool(name, mass=1.0), ha.Workpiece("part", frames={name: POSE})):
        shown = value._repr_html_()
        assert "<script" not in shown and html.escape(name) in shown
        assert name in _Table(shown).texts
    assert ha.Recovery(False, remaining=(name,))._repr_html_() == f"<pre>not ready: {html.escape(name)}</pre>"


def test_a_text_with_rows_is_a_text() -> None:
    text = str(STATE)
    assert isinstance(text, str) and pickle.loads(pickle.dumps(text)) == text and f"{text}" == text


def test_an_insertion_is_read_and_compared() -> None:
    def found(offset: float) -> Insertion:
        return Insertion(0.03, np.array([offset, 0.0, -0.0001]), POSE, 3.456, True)

    assert str(found(0.0012)).splitlines()[:3] == [
        "Insertion",
        "  depth     30.0 mm",
        "  offset    1.20 0.00 -0.10 mm",
    ]
    assert found(0.0012) == found(0.0012) != found(0.0013)


RESULT = ha.Result(ha.Cause.FINISHED, duration=1.25)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (STATE.wrench, ["force 1.00 2.00 -3.50 N   torque 0.10 0.20 0.30 Nm"]),
        (
            Wrench(0, *np.ones((2, 3)), np.full(3, 30.0), np.zeros(3)),  # type: ignore[call-arg]
            ["force 1.00 1.00 1.00 N", "inaccurate here"],
        ),
        (modes.Position(), ["position control"]),
        (modes.JointImpedance(300.0), ["joint impedance, 300 Nm/rad, damping 0.7"]),
        (
            modes.CartesianImpedance((2000, 2000, 300, 200, 200, 200), max_force={"z": 20.0}),
            ["2000 2000 300 N/m, 200 Nm/rad, damping 0.7", "frame tool", "max_force - - 20 - - - N, Nm"],
        ),
        (
            modes.SineImpedance.sine("z", frequency=2.0, amplitude=8.0, stiffness=500.0),
            ["Cartesian impedance, ", "; overlaid force: amplitude 0 0 8 0 0 0 N, Nm, frequency "],
        ),
        (
            Contact(POSE, np.array([0.0, 0.1, -9.0]), 0.0123, ha.deg(1, 2, 3, 4, 5, 6, 7), RESULT),
            ["Contact\n", "force   0.00 0.10 -9.00 N", "travel  12.30 mm"],
        ),
        (
            ha.Trajectory.of([0.0, 2.0], [np.zeros(7), ha.deg(0, 0, 0, 0, 0, 0, 90)], robot="iiwa14"),
            ["Trajectory\n", "2.00 s, 2 points", "0.0 0.0 0.0 0.0 0.0 0.0 45.0 deg/s"],
        ),
        (Replay(RESULT, 0.01, 0.034), ["Replay\n", "finished", "0.57 deg", "34 ms"]),
        (
            SignalValues(10**9, {"Cell.Door": True, "Cell.Level": 2.5}),
            ["2 signals at 1.000 s of the cabinet", "Cell.Door   on", "Cell.Level  2.5"],
        ),
        (KnownTool("saw", 1.5, (("tip", ha.Pose.at(z=0.2)),)), ["KnownTool saw\n", "1.5 kg", "z 200.0 mm"]),
        (
            ha.MotionEvent(
                "trigger", 1, trigger=ha.Trigger(path.after(0.1), do.notify("half way")), time=0.5
            ),
            ["trigger, motion 1: notify 'half way' when 0.1 m after the start after 0.500 s"],
        ),
        (ha.MotionEvent("segment", 0, segment=3), ["segment, motion 0, segment 3"]),
        (ROBOTS["iiwa7"], ["LBR iiwa 7 R800 (iiwa7)\n", "340, 400, 400, 126 mm", "torque [Nm]"]),
    ],
)
def test_what_a_lab_prints_has_words_and_units(value: object, words: list[str]) -> None:
    text = str(value)
    assert all(one in text for one in words) and "array(" not in text and "nan" not in text


def test_a_state_has_its_mode_and_signals_in_lines_of_their_own() -> None:
    control = Control(10**9, modes.JointImpedance(300.0), "gripper", "", "tcp")
    text = str(
        STATE.with_groups(mode=control, io=SignalValues(10**9, {"Cell.Door": True, "Cell.Hot": False}))
    )
    assert "joint impedance, 300 Nm/rad, damping 0.7, gripper, motion frame tcp" in text
    assert [line.split()[-2:] for line in text.splitlines()[-2:]] == [
        ["Cell.Door", "on"],
        ["Cell.Hot", "off"],
    ]


@pytest.mark.parametrize("kind", [Insertion, ha.Recording, ha.Recovery])
def test_what_a_program_gets_back_is_readable_in_a_notebook(kind: type) -> None:
    assert callable(getattr(kind, "_repr_html_", None)) and kind.__str__ is not object.__str__


def test_repr_stays_exact() -> None:
    assert "Joints(stamp=1000000000" in repr(STATE)
    assert repr(ha.Result(ha.Cause.FINISHED)).startswith("Result(cause=<Cause.FINISHED")


@pytest.mark.parametrize(
    ("value", "text"), [(-1e-9, "0.00"), (math.nan, "-"), (1.005, "1.00"), (-2.5, "-2.50")]
)
def test_fixed_point_has_no_negative_zero(value: float, text: str) -> None:
    assert fixed(value, 2) == text


def test_rows_that_are_empty_are_left_out() -> None:
    assert lines("Title", {"a": "1", "long name": "2\n3", "none": ""}) == (
        "Title\n  a          1\n  long name  2\n             3"
    )
