"""Shapes of tools and workpieces as values."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm import shapes
from heptarm.errors import HeptarmError, LimitError, ShapeError
from heptarm.values.pose import Pose

UP = Pose.at(0, 0, 0.1)


def test_sizes_are_those_of_the_kind_and_what_it_has_not_is_zero() -> None:
    assert shapes.box(0.1, 0.2, 0.3, at=UP).size.tolist() == [0.1, 0.2, 0.3]
    assert shapes.cylinder(0.1, 0.2).size.tolist() == [0.1, 0.2, 0.0]
    assert shapes.capsule(0.1, 0.2).size.tolist() == [0.1, 0.2, 0.0]
    assert shapes.sphere(0.1).size.tolist() == [0.1, 0.0, 0.0]
    assert shapes.sphere(0.1).pose == Pose.at() and shapes.box(1, 1, 1, at=UP).pose == UP


def test_shapes_are_frozen_compare_by_their_numbers_and_read_in_millimetres() -> None:
    assert shapes.box(0.1, 0.1, 0.1) == shapes.box(0.1, 0.1, 0.1) != shapes.box(0.1, 0.1, 0.2)
    assert shapes.cylinder(0.1, 0.2) != shapes.capsule(0.1, 0.2)
    assert len({shapes.sphere(0.1), shapes.sphere(0.1), shapes.sphere(0.1, at=UP)}) == 2
    assert str(shapes.cylinder(0.01, 0.2, at=UP)).startswith(
        "cylinder, radius 10.0 mm, length 200.0 mm, at x"
    )
    with pytest.raises(dataclasses.FrozenInstanceError):
        shapes.sphere(0.1).kind = "box"  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        shapes.sphere(0.1).size[0] = 1.0


REFUSED: list[tuple[Callable[[], Any], type[HeptarmError], str]] = [
    (lambda: shapes.box(0.0, 1, 1), LimitError, r"x must be in \(0, 4\] m, got 0 m"),
    (lambda: shapes.box(1, 1, -1), LimitError, "z must be"),
    (lambda: shapes.sphere(50), LimitError, "did you mean 50 mm"),
    (lambda: shapes.capsule(0.1, math.nan), LimitError, "length must be"),
    (lambda: shapes.cylinder("0.1", 0.1), ShapeError, "radius must be"),  # type: ignore[arg-type]
    (lambda: shapes.box(1, 1, 1, at=(0, 0, 1)), ShapeError, "at must be a Pose"),  # type: ignore[arg-type]
    (lambda: shapes.box(1, 1, 1, at=Pose.at(0, 2.1)), LimitError, r"at.xyz\[1\] must be in \[-2, 2\] m"),
    (lambda: shapes.Shape("cone", np.ones(3)), ShapeError, "kind must be one of 'box', 'cylinder'"),  # type: ignore[arg-type]
    (lambda: shapes.Shape("box", np.ones(2)), ShapeError, "size must have shape"),
    (lambda: shapes.Shape("sphere", np.ones(3)), LimitError, r"size\[1\] of a sphere must be 0"),
    (lambda: shapes.Shape("box", np.array([1.0, 1.0, 0.0])), LimitError, r"size\[2\] must be"),
    (lambda: ha.Tool("t", shapes=shapes.sphere(0.1)), ShapeError, "shapes must be a list"),  # type: ignore[arg-type]
    (lambda: ha.Tool("t", shapes=["box"]), ShapeError, r"shapes\[0\] must be a Shape"),  # type: ignore[list-item]
    (lambda: ha.Workpiece("t", shapes=[shapes.sphere(0.1)] * 17), ShapeError, "at most 16, got 17"),
]


@pytest.mark.parametrize(("make", "error", "text"), REFUSED)
def test_bad_values_are_refused(make: Callable[[], Any], error: type[HeptarmError], text: str) -> None:
    with pytest.raises(error, match=text):
        make()


def test_a_tool_has_shapes_and_shows_them() -> None:
    tool = ha.Tool("pen", shapes=[shapes.sphere(0.01, at=UP)])
    assert tool.shapes == (shapes.sphere(0.01, at=UP),) and "sphere, radius 10.0 mm" in str(tool)
    assert tool != ha.Tool("pen") and ha.Tool("pen").shapes == ()


def test_a_height_map_has_columns_where_its_table_has_them() -> None:
    columns = shapes.height_map([[0.1, 0.1, 0.0], [0.0, 0.0, 0.2]], cell=0.1)
    assert [tuple(one.size.round(9)) for one in columns] == [(0.2, 0.1, 0.1), (0.1, 0.1, 0.2)]
    assert [tuple(one.pose.xyz.round(9)) for one in columns] == [(-0.05, -0.05, 0.05), (0.1, 0.05, 0.1)]
