"""The look for texts that repeat themselves finds them."""

from __future__ import annotations

import pytest

from heptarm.errors import HeptarmError
from tests import doubled


@pytest.mark.parametrize(
    ("text", "repeated"),
    [
        ("no connection: the cabinet is silent: the cabinet is silent (check the cable)", "the cabinet is silent"),
        ("refused since the arm is far away, and refused since the arm is far", "refused since the arm is"),
        ("A1 is limited to 3 rad; A2 is limited to 3 rad (slow down)", ""),
        ("must be a condition, got 'io.a io.a io.a io.a io.a io.a io.a io.a io.a io.a'", ""),
        ("error: error", ""),
    ],
)  # fmt: skip
def test_what_is_repeated_is_found(text: str, repeated: str) -> None:
    assert doubled.doubled(text) == repeated


def test_an_error_of_this_process_is_looked_at() -> None:
    str(HeptarmError("the arm is far away", hint="the arm is far away"))
    assert doubled._found == ["'the arm is far away': the arm is far away (the arm is far away)"]
    doubled._found.clear()
