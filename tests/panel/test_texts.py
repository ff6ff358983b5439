"""The panel's readouts: numbers in the units of the shop floor, and no HTML from outside."""

from __future__ import annotations

import numpy as np
import pytest

import heptarm as ha
from heptarm.panel import texts
from heptarm.panel.model import Advice, Readout
from heptarm.panel.points import PointList, TaughtPoint
from heptarm.values.robot import robot
from heptarm.values.state import Groups, Joints, State, Torques, Wrench

ROBOT = robot("iiwa14")
Q = ha.deg(10, 20, 30, -40, 50, 60, 70)
EVIL = '<img src=x onerror="alert(1)">'


def readout(**changes: object) -> Readout:
    given: dict[str, object] = {
        "title": "LBR",
        "cabinet": "",
        "is_virtual": True,
        "state": None,
        "tcp": None,
        "wrench": None,
        "undeclared": 0.0,
        "is_connected": True,
        "in_control": False,
        "controller": "",
        "is_jogging": False,
        "slowed": "",
        "running": "",
        "target": None,
        "stands": (),
        "last_stop": None,
        "message": None,
        "recording": "",
    }
    return Readout(**(given | changes))  # type: ignore[arg-type]


def test_joints_have_degrees_speeds_torques_and_places_between_their_limits() -> None:
    tau = 0.9 * ROBOT.tau_max
    state = State(
        Groups(
            joints=Joints(1, q=Q, q_cmd=Q, dq=np.full(7, np.pi / 180)),
            torques=Torques(1, tau=tau, tau_ext=tau, tau_cmd=tau),
        )
    )
    html = texts.joints(state, ROBOT)
    place = 100 * (Q[0] - ROBOT.q_min[0]) / (ROBOT.q_max[0] - ROBOT.q_min[0])
    assert ">10.0<" in html and ">-40.0<" in html and ">1.0<" in html and f"left:{place:.1f}%" in html
    assert html.count("#fa5252") == 7, "all joints are near their largest torque"
    assert "no state" in texts.joints(None, ROBOT)


def test_the_place_is_in_millimetres_and_degrees() -> None:
    html = texts.place(ha.Pose.xyz_abc(0.5123, -0.1, 0.3, *ha.deg(90, 0, 180)), State())
    assert "512.3" in html and "-100.0" in html and "90.0" in html


def test_the_force_is_its_size_and_its_parts() -> None:
    load = Wrench(1, np.array([3.0, 0.0, -4.0]), np.zeros(3))
    html = texts.wrench(load, 0.0)
    assert ">5.0<" in html and "-4.0" in html and "attach" not in html
    assert "the tool's 9.8 N: attach it" in texts.wrench(load, 9.81)
    assert texts.wrench(None, 0.0) == ""


def test_nothing_from_outside_is_html() -> None:
    advice = Advice(EVIL, EVIL, "error")
    shown = readout(
        title=EVIL,
        controller=EVIL,
        running=EVIL,
        stands=(advice,),
        last_stop=advice,
        message=advice,
        recording=EVIL,
    )
    points = PointList(ROBOT)
    points.add(TaughtPoint(EVIL, Q, ha.Pose.at()))
    for html in (
        texts.head(shown),
        texts.safety(shown),
        texts.signals({EVIL: True}),
        texts.program(points, "", ""),
    ):
        assert "<img" not in html and "&lt;img" in html


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"is_connected": False}, "connection to the cabinet is lost"),
        ({"stands": (Advice("Emergency stop", "Release it."),)}, "Release it."),
        ({"last_stop": Advice("Safeguard open", at=1.0)}, "Last stop"),
        ({"message": Advice("refused", "do that", "error")}, "do that"),
    ],
)
def test_reasons_come_with_their_remedy(changes: dict[str, object], words: str) -> None:
    assert words in texts.safety(readout(**changes))


def test_long_lists_of_signals_are_cut() -> None:
    html = texts.signals({f"Group.In{number}": float(number) for number in range(texts.MOST_SIGNALS + 7)})
    assert "and 7 more" in html and "no inputs" in texts.signals({})
