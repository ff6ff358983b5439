"""The tree of errors."""

from __future__ import annotations

import inspect
import pickle
from pathlib import Path

import pytest

from heptarm import errors
from heptarm.errors import HeptarmError, LimitError, MissingExtra, MotionAborted, NeedsOperator, require
from heptarm.values.result import Cause, Result
from heptarm.wire.codes import MEANINGS

ALL = [kind for _, kind in inspect.getmembers(errors, inspect.isclass) if issubclass(kind, HeptarmError)]


@pytest.mark.parametrize("kind", ALL)
def test_documented_in_the_tree(kind: type[HeptarmError]) -> None:
    assert kind.__name__ in (errors.__doc__ or "")
    assert kind.__doc__


@pytest.mark.parametrize("kind", ALL)
def test_carries_its_details(kind: type[HeptarmError]) -> None:
    error = kind("it failed", code=2, parameter="q[3]", value=4.0, allowed="[0, 1]", hint="do less")
    assert str(error) == "it failed (do less)"
    assert (error.code, error.parameter, error.value, error.allowed) == (2, "q[3]", 4.0, "[0, 1]")
    assert str(kind("plain")) == "plain"


def test_each_code_has_its_row_in_the_documentation() -> None:
    page = (Path(__file__).parents[1] / "docs/reference/errors.md").read_text(encoding="utf-8")
    for code in MEANINGS:
        address, _, anchor = HeptarmError("it failed", code=code).page.partition("#")
        assert address.endswith("/docs/reference/errors.md") and f'<a id="{anchor}"></a>{code} ' in page
    assert "#" not in HeptarmError("found here").page


@pytest.mark.parametrize(
    ("kind", "builtin"),
    [
        ("ConnectFailed", ConnectionError),
        ("ConnectionLost", ConnectionError),
        ("CommandRejected", ValueError),
        ("Timeout", TimeoutError),
        ("MissingExtra", ImportError),
    ],
)
def test_python_may_catch_them_too(kind: str, builtin: type[Exception]) -> None:
    assert issubclass(getattr(errors, kind), builtin)


def test_motion_errors_carry_their_result() -> None:
    error = MotionAborted("stopped", result=Result(Cause.SAFETY), history=[1, 2])
    assert error.cause is Cause.SAFETY
    assert error.state is None
    assert error.history == (1, 2)
    assert MotionAborted("stopped").cause is None


def test_operator() -> None:
    assert NeedsOperator("e-stop", hint="release it").instructions == "release it"
    assert NeedsOperator("e-stop").instructions == "e-stop"


def test_require() -> None:
    import math

    assert require("math", extra="sim") is math
    with pytest.raises(MissingExtra, match=r"is not installed .pip install 'heptarm\[sim\]'"):
        require("heptarm_no_such_module", extra="sim")


def test_require_reports_broken_from_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "heptarm_broken_module.py").write_text("import heptarm_not_there_either")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(MissingExtra, match="cannot be imported .No module named 'heptarm_not_there_either'"):
        require("heptarm_broken_module", extra="sim")


@pytest.mark.parametrize("kind", ALL)
def test_pickled(kind: type[HeptarmError]) -> None:
    error = pickle.loads(pickle.dumps(kind("it failed", code=3, hint="do less")))
    assert type(error) is kind
    assert (str(error), error.code) == ("it failed (do less)", 3)


def test_limit_errors_are_value_errors() -> None:
    assert issubclass(LimitError, ValueError)


def test_an_error_of_an_element_names_it_from_the_outside_to_the_inside() -> None:
    error = errors.LimitError("q[3] must be at most 2.0 rad, got 2.5 rad", parameter="q[3]", hint="move it")
    assert error.inside("") is error and str(error) == "q[3] must be at most 2.0 rad, got 2.5 rad (move it)"
    error.inside("segments[2]").inside("motions[1]")
    assert error.parameter == "motions[1].segments[2].q[3]"
    assert str(error) == "motions[1].segments[2]: q[3] must be at most 2.0 rad, got 2.5 rad (move it)"
    assert error.text == error.args[0]
    assert errors.CommandRejected("no").inside("motions[1]").parameter == "motions[1]"


def test_a_block_names_an_element() -> None:
    with (
        pytest.raises(errors.CommandRejected, match=r"^b\[1\]\.a\[0\]: no$") as found,
        errors.inside("b[1]"),
        errors.inside("a[0]"),
    ):
        raise errors.CommandRejected("no", parameter="x")
    assert found.value.parameter == "b[1].a[0].x"
