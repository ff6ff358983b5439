"""Conditions as texts: the same conditions as in Python, and nothing else."""

from __future__ import annotations

import pytest

from heptarm.errors import CommandRejected, LimitError
from heptarm.ros.interface.conditions import condition_of
from heptarm.values.condition.condition import Condition
from heptarm.values.condition.force import force, torque
from heptarm.values.condition.signals import io, path
from heptarm.values.pose import Pose


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("force > 10", force > 10),
        ("15 < force", force > 15),
        ("force(frame='base', tolerance=3) > 4", force(frame="base", tolerance=3) > 4),
        ("force(frame=Pose.xyz_abc(a=0.5)).along('x') > 4", force(frame=Pose.xyz_abc(a=0.5)).along("x") > 4),
        ("force.normal('x') > 2.5", force.normal("x") > 2.5),
        ("~(force.shear('z') > 2)", ~(force.shear("z") > 2)),
        ("abs(torque[3]) > 8", abs(torque[3]) > 8),
        ("torque.about('z').outside(-1, 2)", torque.about("z").outside(-1, 2)),
        ("io.user_button", io.user_button),
        ("~io['MediaFlange.UserButton'] & (io.level > 3)", ~io["MediaFlange.UserButton"] & (io.level > 3)),
        (" (force > 3) ^ (torque[0] < -2) ", (force > 3) ^ (torque[0] < -2)),
        (
            "path.after(0.1, seconds=0.5) | path.before_end(0.2)",
            path.after(0.1, seconds=0.5) | path.before_end(0.2),
        ),
    ],
)
def test_a_text_is_what_python_would_make_of_it(text: str, wanted: Condition) -> None:
    assert str(condition_of(text)) == str(wanted) and type(condition_of(text)) is type(wanted)


@pytest.mark.parametrize("text", ["", "  ", "\n"])
def test_no_text_is_no_condition(text: str) -> None:
    assert condition_of(text) is None


@pytest.mark.parametrize(
    "text",
    [
        "force",
        "3",
        "__import__('os').system('true')",
        "io.__class__",
        "io._x",
        "force.__class__ > 3",
        "force > 10 | force > 3",
        "1 < force < 3",
        "(force > 1) and (torque[1] > 2)",
        "abs(force) > 3",
        "force(*[1]) > 3",
        "force(**{}) > 3",
        "force(x=3) > 1",
        "force(frame=Pose.at(1, 2, 3)) > 1",
        "[force > 3][0]",
        "(lambda: force > 3)()",
        "force >",
        "\0",
        "~" * 1999 + "x",
        "(" * 500,
        "io.a & " * 1000,
    ],
)
def test_anything_else_is_refused_in_words(text: str) -> None:
    with pytest.raises(CommandRejected, match="must be a condition") as caught:
        condition_of(text)
    assert caught.value.parameter == "until" and "force.along" in caught.value.hint


@pytest.mark.parametrize("text", ["force > 9999", "torque[7] > 1", "torque[2].outside(3, 1)"])
def test_numbers_outside_their_ranges_are_refused_as_in_python(text: str) -> None:
    with pytest.raises(LimitError):
        condition_of(text)


def test_a_condition_that_is_too_large_for_the_cabinet_is_refused() -> None:
    with pytest.raises(LimitError, match="64"):
        condition_of(" | ".join(f"(force > {number})" for number in range(1, 70)))
