"""Workspaces: frozen values, checked where they are made."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import heptarm as ha

BOX = ((0.3, -0.5, 0.05), (0.8, 0.5, 0.9))


def test_a_workspace_is_a_frozen_value() -> None:
    one = ha.Workspace(BOX, joints=(np.full(7, -1.0), np.full(7, 1.0)), mode="refuse", frame="cell")
    assert one == ha.Workspace(BOX, joints=([-1.0] * 7, [1.0] * 7), mode="refuse", frame="cell")
    assert hash(one) == hash(ha.Workspace(BOX, joints=([-1] * 7, [1] * 7), mode="refuse", frame="cell"))
    assert one != ha.Workspace(BOX)
    assert one.box is not None and not one.box.flags.writeable
    with pytest.raises(AttributeError):
        one.mode = "clamp"  # type: ignore[misc]
    assert str(ha.Workspace(BOX)) == "Workspace: box [[0.3, -0.5, 0.05], [0.8, 0.5, 0.9]] m in base; clamp"


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        ({}, "a box, joints, or both"),
        ({"box": (0.3, 0.8)}, "two lists of 3 numbers"),
        ({"box": (BOX[1], BOX[0])}, "0.8 and 0.3 m for x.*lower corner first"),
        ({"box": ((0, 0, 0), (1, 1, float("nan")))}, "finite"),
        ({"joints": ([0.0] * 6, [1.0] * 6)}, "two lists of 7 numbers"),
        ({"joints": ([0.0] * 7, [1.0] * 6 + [0.0])}, "A7"),
        ({"box": BOX, "mode": "stop"}, "mode must be one of"),
        ({"box": BOX, "frame": ""}, "frame must be a name"),
        ({"box": "everywhere"}, "box must be"),
    ],
)
def test_what_is_no_workspace_is_refused(settings: dict[str, Any], word: str) -> None:
    with pytest.raises(ha.CommandRejected, match=word):
        ha.Workspace(**settings)
