"""Changes of one expression in a Python source, as a slip of the keyboard or of the mind would make them.

Not changed are texts, annotations, docstrings, what is raised, what is logged, and representations: their tests would
only repeat them.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
_OPERATIONS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.MatMult: ast.Mult,
}
_NAMES = {"min": "max", "max": "min", "any": "all", "all": "any", "floor": "ceil", "ceil": "floor"}
_NAMES |= {"minimum": "maximum", "maximum": "minimum", "sin": "cos", "cos": "sin", "argmin": "argmax"}
#: Functions whose result is a text or a figure for people.
_TEXTS = {"__repr__", "__str__", "_repr_html_", "__format__", "markdown", "plot"}
#: Keyword arguments that change nothing where the program is right: `zip` checks lengths that are equal anyway.
_IDLE = {"strict", "slots", "frozen"}


@dataclass(frozen=True, slots=True)
class Mutant:
    """One change.

    Attributes:
        file: the source, relative to the root of the sources.
        function: dotted name of the function or class around it; "": of the module.
        line: its line, from 1.
        begin: where the changed expression begins in the text [bytes].
        end: where it ends.
        before: the expression.
        after: what it becomes.
        rank: by which mutants are drawn; depends on the seed, the file, the function and the change only.
    """

    file: str
    function: str
    line: int
    begin: int
    end: int
    before: str
    after: str
    rank: str

    def __str__(self) -> str:
        before, after = (" ".join(text.split()) for text in (self.before, self.after))
        return f"{self.file}:{self.line} {self.function}: {before}  ->  {after}"

    def apply(self, source: bytes) -> bytes:
        """The changed source."""
        return source[: self.begin] + self.after.encode() + source[self.end :]


def mutants(source: bytes, *, file: str = "", seed: int = 0) -> list[Mutant]:
    """Every change of a source, in the order of its text."""
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    found: list[Mutant] = []
    seen: dict[str, int] = {}
    for function, node in _expressions(ast.parse(source), ""):
        assert node.end_lineno is not None and node.end_col_offset is not None
        begin = starts[node.lineno - 1] + node.col_offset
        end = starts[node.end_lineno - 1] + node.end_col_offset
        before = source[begin:end].decode()
        for changed in _changed(node):
            after = f"({ast.unparse(changed)})" if isinstance(node, _LOOSE) else ast.unparse(changed)
            text = f"{seed}|{file}|{function}|{' '.join(before.split())}|{after}"
            seen[text] = seen.get(text, 0) + 1  # the same expression once more
            rank = hashlib.sha256(f"{text}|{seen[text]}".encode()).hexdigest()
            found.append(Mutant(file, function, node.lineno, begin, end, before, after, rank))
    return found


def drawn(root: Path, files: list[Path], *, count: int, seed: int) -> list[Mutant]:
    """So many changes of these files, drawn by their rank, in the order of files and lines."""
    every = [
        mutant
        for file in files
        for mutant in mutants(file.read_bytes(), file=str(file.relative_to(root)), seed=seed)
    ]
    return sorted(sorted(every, key=lambda one: one.rank)[:count], key=lambda one: (one.file, one.begin))


_LOOSE = (ast.BinOp, ast.BoolOp, ast.Compare, ast.IfExp, ast.UnaryOp)


def _expressions(node: ast.AST, function: str) -> Iterator[tuple[str, ast.expr]]:
    """Expressions that decide what the program does, each with the function around it."""
    if isinstance(node, ast.Raise | ast.Assert | ast.JoinedStr | ast.Import | ast.ImportFrom):
        return
    if isinstance(node, ast.If) and _name(node.test) == "TYPE_CHECKING":
        return
    if isinstance(node, ast.Call) and _is_log(node.func):
        return
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        if node.name in _TEXTS:
            return
        function = f"{function}.{node.name}".lstrip(".")
        inside: list[ast.AST] = [*node.body]
        if not isinstance(node, ast.ClassDef):
            inside += [*node.args.defaults, *filter(None, node.args.kw_defaults)]
    elif isinstance(node, ast.AnnAssign):
        inside = [node.value] if node.value is not None else []
    else:
        inside = list(ast.iter_child_nodes(node))
    if isinstance(node, ast.expr):
        yield function, node
    if isinstance(node, ast.keyword) and node.arg in _IDLE:
        return
    for one in inside:
        yield from _expressions(one, function)


def _changed(node: ast.expr) -> Iterator[ast.expr]:
    if isinstance(node, ast.Compare):
        for place, operator in enumerate(node.ops):
            operators = [*node.ops[:place], _COMPARISONS[type(operator)](), *node.ops[place + 1 :]]
            yield ast.Compare(node.left, operators, node.comparators)
    elif isinstance(node, ast.BinOp):
        texts = any(isinstance(one, ast.JoinedStr) or _is_text(one) for one in (node.left, node.right))
        if type(node.op) in _OPERATIONS and not texts:
            yield ast.BinOp(node.left, _OPERATIONS[type(node.op)](), node.right)
    elif isinstance(node, ast.BoolOp):
        yield ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)
    elif isinstance(node, ast.UnaryOp):
        if isinstance(node.op, ast.Not | ast.USub):
            yield node.operand
    elif isinstance(node, ast.IfExp):
        if not (_is_text(node.body) or isinstance(node.body, ast.JoinedStr)):
            yield ast.IfExp(node.test, node.orelse, node.body)
    elif isinstance(node, ast.Constant):
        yield from _changed_constant(node.value)
    elif isinstance(node, ast.Name) and node.id in _NAMES:
        yield ast.Name(_NAMES[node.id])
    elif isinstance(node, ast.Attribute) and node.attr in _NAMES:
        yield ast.Attribute(node.value, _NAMES[node.attr])


def _changed_constant(value: object) -> Iterator[ast.expr]:
    if isinstance(value, bool):
        yield ast.Constant(not value)
    elif isinstance(value, int):
        yield ast.Constant(value + 1)
    elif isinstance(value, float):
        yield ast.Constant(2.0 * value if value else 1.0)


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str | bytes)


def _is_log(function: ast.expr) -> bool:
    return isinstance(function, ast.Attribute) and _name(function.value) in ("_log", "logging", "warnings")


def _name(node: ast.expr) -> str:
    return node.id if isinstance(node, ast.Name) else ""
