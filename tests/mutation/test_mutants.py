"""The changes that mutation testing makes."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.mutation import run
from tests.mutation.mutants import drawn, mutants

ROOT = Path(__file__).resolve().parents[2]


def changes(text: str) -> list[tuple[str, str]]:
    return [(mutant.before, mutant.after) for mutant in mutants(text.encode())]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("x = a < b", [("a < b", "(a <= b)")]),
        ("x = a - b", [("a - b", "(a + b)")]),
        ("x = a if c else b", [("a if c else b", "(b if c else a)")]),
        ("x = a and b", [("a and b", "(a or b)")]),
        ("x = not a", [("not a", "(a)")]),
        ("x = -a", [("-a", "(a)")]),
        ("x = min(a, b)", [("min", "max")]),
        ("x = np.sin(a)", [("np.sin", "np.cos")]),
        ("x = 3", [("3", "4")]),
        ("x = 1.5", [("1.5", "3.0")]),
        ("x = True", [("True", "False")]),
        ("x = a < b <= c", [("a < b <= c", "(a <= b <= c)"), ("a < b <= c", "(a < b < c)")]),
        ("x = 'a' + b", []),
        ("x: Literal[3]", []),
        ("def f(): 'Text 1.'", []),
        ("raise Error(a < b)", []),
        ("_log.debug('x', a + b)", []),
        ("def __repr__(self): return a + b", []),
        ("x = f'{a + b}'", []),
    ],
)
def test_what_is_changed(text: str, found: list[tuple[str, str]]) -> None:
    assert changes(text) == found


def test_a_change_is_one_of_the_text_and_still_a_program() -> None:
    source = "é = 1\ndef f(a, b):\n    return (a + b) * 2  # ä\n".encode()
    for mutant in mutants(source):
        changed = mutant.apply(source)
        assert changed != source and ast.dump(ast.parse(changed)) != ast.dump(ast.parse(source))
        assert len(changed.splitlines()) == len(source.splitlines())


def test_an_edit_of_another_function_draws_the_same(tmp_path: Path) -> None:
    file, text = tmp_path / "a.py", "def f(a):\n" + "".join(f"    a = a + {n}\n" for n in range(30))
    file.write_text(text)
    before = drawn(tmp_path, [file], count=5, seed=3)
    file.write_text("def g():\n    pass\n\n\n" + text)
    after = drawn(tmp_path, [file], count=5, seed=3)
    assert [one.rank for one in before] == [one.rank for one in after]
    assert [one.line + 4 for one in before] == [one.line for one in after]
    assert [one.rank for one in drawn(tmp_path, [file], count=5, seed=4)] != [one.rank for one in before]


def test_every_package_has_its_tests() -> None:
    for package in run.PACKAGES:
        assert run.sources(ROOT, package), package
        for name in package.tests:
            assert (ROOT / name.partition("::")[0]).exists(), name
