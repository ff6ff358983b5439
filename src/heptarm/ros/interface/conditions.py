"""Conditions as texts, with the names of heptarm.when: `(force.along('z') > 15) | io.user_button`.

A text is parsed, never executed: it may contain signals, comparisons, & | ^ ~, and `Pose.xyz_abc(...)` as a frame.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable
from typing import Any

from heptarm.errors import CommandRejected, HeptarmError
from heptarm.values.condition.condition import Condition, check_condition
from heptarm.values.condition.force import Component, Force, Torque, force, torque
from heptarm.values.condition.reaction import Reaction, Retreat, check_reaction
from heptarm.values.condition.signals import IoSignals, Path, SignalIs, io, path
from heptarm.values.pose import Pose

#: Most characters of a text.
_LONGEST = 2000
_SIGNALS: dict[str, object] = {"force": force, "torque": torque, "io": io, "path": path}
_METHODS: dict[type, tuple[str, ...]] = {
    Force: ("along", "normal", "shear"),
    Torque: ("about",),
    Component: ("outside", "inside"),
    SignalIs: ("outside",),
    Path: ("after", "before_end"),
}
_BINARY: dict[type, Callable[[Any, Any], Any]] = {
    ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_,
    ast.BitXor: operator.xor,
}
_COMPARE: dict[type, Callable[[Any, Any], Any]] = {ast.Gt: operator.gt, ast.Lt: operator.lt}


def condition_of(text: str, parameter: str = "until") -> Condition | None:
    """Parse a condition; None: the text is empty.

    Args:
        text: such as "force > 10", or "(abs(torque[3]) > 8) | io['MediaFlange.UserButton']".
        parameter: name of the text in errors.

    Raises:
        CommandRejected: not a condition; a number out of range raises as in heptarm.when.
    """
    if not text.strip():
        return None
    try:
        if len(text) > _LONGEST:
            raise ValueError(f"at most {_LONGEST} characters are allowed, got {len(text)}")
        value = _value(ast.parse(text.strip(), mode="eval").body)
        if isinstance(value, Condition):
            return check_condition(value, parameter)
        raise ValueError("it is a signal or a number; compare it with something")
    except HeptarmError:
        raise  # a number out of range: its own text has more detail
    except (SyntaxError, ValueError, TypeError, RecursionError, MemoryError) as error:
        raise CommandRejected(
            f"{parameter} must be a condition, got {text[:80]!r}: {getattr(error, 'msg', None) or error}",
            parameter=parameter,
            value=text,
            hint="for example (force.along('z') > 15) | (abs(torque[3]) > 8) | io.user_button",
        ) from error


def reaction_of(text: str) -> Reaction | None:
    """Parse a reaction to a condition; None: the text is empty.

    Args:
        text: "stay", "relax", or "retreat" with a distance [m], as in "retreat 0.005".

    Raises:
        CommandRejected: something else; a distance out of range raises as `Retreat` does.
    """
    kind, _, distance = text.strip().partition(" ")
    if not kind:
        return None
    if kind in ("stay", "relax") and not distance:
        return check_reaction(kind)
    try:
        if kind != "retreat":
            raise ValueError
        metres = float(distance)
    except ValueError:
        raise CommandRejected(
            f"then must be 'stay', 'relax' or 'retreat DISTANCE', got {text[:80]!r}",
            parameter="then",
            value=text,
            hint="for example then: 'retreat 0.005' [m]",
        ) from None
    return Retreat(metres)


def _value(node: ast.expr) -> Any:
    """Evaluate a part of the text.

    Raises:
        ValueError: not allowed in a condition.
        TypeError: operands that do not fit together.
    """
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float | str):
        return node.value
    if isinstance(node, ast.Name) and node.id in _SIGNALS:
        return _SIGNALS[node.id]
    if isinstance(node, ast.UnaryOp):
        inner = _value(node.operand)
        if isinstance(node.op, ast.USub) and isinstance(inner, int | float):
            return -inner
        if isinstance(node.op, ast.Invert) and isinstance(inner, Condition):
            return ~inner
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        return _BINARY[type(node.op)](_condition(node.left), _condition(node.right))
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _COMPARE:
        return _COMPARE[type(node.ops[0])](_value(node.left), _value(node.comparators[0]))
    if isinstance(node, ast.Subscript):
        whole = _value(node.value)
        if isinstance(whole, Torque | IoSignals):
            return whole[_value(node.slice)]
    if isinstance(node, ast.Attribute) and not node.attr.startswith("_") and _value(node.value) is io:
        return getattr(io, node.attr)
    if isinstance(node, ast.Call):
        return _call(node)
    raise ValueError(f"{ast.unparse(node)!r} is not allowed in a condition")


def _condition(node: ast.expr) -> Condition:
    value = _value(node)
    if not isinstance(value, Condition):
        raise ValueError(f"{ast.unparse(node)!r} is not a condition; put comparisons in brackets")
    return value


def _call(node: ast.Call) -> Any:
    given = [_value(arg) for arg in node.args]
    named = {keyword.arg: _value(keyword.value) for keyword in node.keywords if keyword.arg is not None}
    if len(named) != len(node.keywords):
        raise ValueError("** is not allowed in a condition")
    called = node.func
    if isinstance(called, ast.Name) and called.id == "abs" and len(given) == 1 and not named:
        if isinstance(given[0], Component):
            return abs(given[0])
    elif isinstance(called, ast.Name) and called.id in ("force", "torque"):
        return (force if called.id == "force" else torque)(*given, **named)
    elif ast.unparse(called) == "Pose.xyz_abc":
        return Pose.xyz_abc(*given, **named)
    elif isinstance(called, ast.Attribute):
        whole = _value(called.value)
        if called.attr in _METHODS.get(type(whole), ()):
            return getattr(whole, called.attr)(*given, **named)
    raise ValueError(f"{ast.unparse(node)!r} is not allowed in a condition")
