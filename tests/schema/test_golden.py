"""Golden bytes: written by an independent walk over the schema, read by Python and Java."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.schema.python_side import recoded

VECTORS = [
    (load["message"], load["type"], bytes.fromhex(load["body"]))
    for load in json.loads((Path(__file__).resolve().parents[2] / "schema/golden/vectors.json").read_text())
]


@pytest.mark.parametrize(("name", "number", "body"), VECTORS, ids=[name for name, *_ in VECTORS])
def test_python_reads_and_writes_the_golden_bytes(name: str, number: int, body: bytes) -> None:
    assert recoded(number, body) == f"{body.hex()} ok"


def test_java_reads_and_writes_the_golden_bytes(recode: Callable[..., list[str]]) -> None:
    answers = recode([(number, body) for _, number, body in VECTORS])
    assert answers == [f"{body.hex()} ok" for *_, body in VECTORS]
