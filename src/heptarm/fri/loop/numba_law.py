"""Compilation of a law by Numba: the types of its arguments, and its function with C's calling convention.

The structures of `law_interface` are one Numba type each: a pointer whose attributes are numbers and views of arrays.
Assigning an array to a member copies it, so that a law has the same meaning in Numba and in Python.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, TypeAlias

import numba
from llvmlite import ir
from numba.core import types
from numba.core.datamodel import models
from numba.core.errors import NumbaError
from numba.core.imputils import impl_ret_borrowed, lower_getattr_generic, lower_setattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import register_model
from numba.np.arrayobj import make_array, populate_array

from heptarm.errors import CommandRejected
from heptarm.fri.loop import law_interface as interface

#: Name, kind ("real" or "word"), shape and first word of each member.
_Members: TypeAlias = tuple[tuple[str, str, tuple[int, ...], int], ...]


class Structure(types.Type):
    """A structure of words.

    Args:
        what: name for errors: "state", "out", "params" or "memory".
        members: kind ("real" or "word"), shape and first word of each name.
        writable: whether the law may change its members.
    """

    def __init__(self, what: str, members: _Members, *, writable: bool) -> None:
        self.what, self.writable = what, writable
        self.members = {name: (kind, shape, start) for name, kind, shape, start in members}
        super().__init__(name=f"{what}({members})")

    def member_type(self, name: str) -> Any:
        """Numba's type of a member; None if there is none."""
        if name not in self.members:
            return None
        kind, shape, _ = self.members[name]
        scalar = types.float64 if kind == "real" else types.int64
        if not shape:
            return scalar
        # never read-only: an array that is assigned to a member must have the member's type
        return types.Array(scalar, len(shape), "C")


@register_model(Structure)
class _StructureModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Structure) -> None:
        super().__init__(manager, kind, ir.IntType(8).as_pointer())


@infer_getattr
class _StructureAttributes(AttributeTemplate):  # type: ignore[misc]
    key = Structure

    def generic_resolve(self, kind: Structure, name: str) -> Any:
        return kind.member_type(name)


def _address(builder: Any, pointer: Any, start: int, kind: Any) -> Any:
    place = builder.gep(pointer, [ir.Constant(ir.IntType(64), 8 * start)])
    return builder.bitcast(place, kind.as_pointer())


@lower_getattr_generic(Structure)  # type: ignore[untyped-decorator]
def _get(context: Any, builder: Any, kind: Structure, value: Any, name: str) -> Any:
    _, shape, start = kind.members[name]
    member = kind.member_type(name)
    element = member.dtype if shape else member
    place = _address(builder, value, start, context.get_value_type(element))
    if not shape:
        return builder.load(place)
    array = make_array(member)(context, builder)
    strides = [8] * len(shape)
    for axis in range(len(shape) - 2, -1, -1):
        strides[axis] = strides[axis + 1] * shape[axis + 1]
    constant = [context.get_constant(types.intp, length) for length in shape]
    populate_array(
        array,
        data=builder.bitcast(place, array.data.type),
        shape=constant,
        strides=[context.get_constant(types.intp, step) for step in strides],
        itemsize=context.get_constant(types.intp, 8),
        meminfo=None,
    )
    return impl_ret_borrowed(context, builder, member, array._getvalue())


def _copy(into: Any, values: Any) -> None:
    into[:] = values


@lower_setattr_generic(Structure)  # type: ignore[untyped-decorator]
def _set(context: Any, builder: Any, signature: Any, arguments: Any, name: str) -> Any:
    kind, given = signature.args
    target, value = arguments
    if not kind.writable:
        raise NumbaError(f"{kind.what}.{name} is read-only in a law")
    _, shape, start = kind.members[name]
    if shape:
        member = kind.member_type(name)
        array = _get(context, builder, kind, target, name)
        context.compile_internal(builder, _copy, types.none(member, given), (array, value))
    else:
        builder.store(value, _address(builder, target, start, value.type))
    return context.get_dummy_value()


def _table(rows: tuple[tuple[str, tuple[int, ...], str, str], ...]) -> _Members:
    members, start = [], 0
    for kind, shape, name, _ in rows:
        members.append((name, kind, shape, start))
        start += shape[0] if shape else 1
    return tuple(members)


def _fields(schema: interface.Schema) -> _Members:
    return tuple((name, "real", tuple(shape), start) for name, (shape, start) in schema.items())


def compiled(
    function: Callable[..., object], params: interface.Schema, memory: interface.Schema, *, takes_memory: bool
) -> tuple[int, object]:
    """Compile a law.

    Args:
        function: `function(state, out, params)` or `function(state, out, params, memory)`.
        params: schema of its parameters.
        memory: schema of its memory.
        takes_memory: whether it takes the memory.

    Returns:
        Address of a function with C's calling convention, which returns 0 after an exception and 1 otherwise; what
        keeps it alive.

    Raises:
        CommandRejected: Numba cannot compile it; the text has file and line, the hint a remedy.
    """
    kinds = (
        Structure("state", _table(interface.STATE), writable=False),
        Structure("out", _table(interface.COMMAND), writable=True),
        Structure("params", _fields(params), writable=False),
        Structure("memory", _fields(memory), writable=True),
    )
    try:
        inner = numba.njit(function)
        inner.compile(kinds if takes_memory else kinds[:3])
    except NumbaError as error:
        raise _refusal(function, error) from None
    made = numba.cfunc(types.int32(*kinds))(_with_status(inner, takes_memory=takes_memory))
    return int(made.address), made


def _with_status(inner: Any, *, takes_memory: bool) -> Callable[..., int]:
    """The law with a result: 1 after it has returned. Numba makes a function that raises return 0."""
    if takes_memory:

        def outer(s, out, p, m):  # type: ignore[no-untyped-def]
            inner(s, out, p, m)
            return 1

    else:

        def outer(s, out, p, m):  # type: ignore[no-untyped-def]
            inner(s, out, p)
            return 1

    return outer


def _refusal(function: Callable[..., object], error: NumbaError) -> CommandRejected:
    """The error for what Numba cannot compile: its place, its reason and a remedy."""
    code = function.__code__
    text = re.sub(r"\x1b\[[0-9;]*m", "", str(error))
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    places = re.findall(r'File "([^"]+)", line (\d+)', text)
    place = next((line for file, line in places if file.endswith(code.co_filename.rpartition("/")[2])), None)
    line = int(place) if place else getattr(getattr(error, "loc", None), "line", code.co_firstlineno)
    reason = next(
        (line for line in lines if not line.startswith(_HEADINGS)), lines[0] if lines else str(error)
    )
    reason = re.sub(r"of type (state|out|params|memory)\(.*", r"of \1", reason)
    hint = next((hint for pattern, hint in _REMEDIES if re.search(pattern, text)), _REMEDY)
    return CommandRejected(
        f"Numba cannot compile the law {function.__qualname__!r}: {code.co_filename}, line {line}: {reason}",
        parameter="law",
        hint=hint,
    )


_HEADINGS = ("Failed in nopython", "During: ", "File ", "No implementation of function")
_REMEDY = (
    "use numbers and NumPy arrays only (docs/guide/laws.md lists what a compiled law may contain), or leave out "
    "@ha.law: the law then runs in Python"
)
_REMEDIES = (
    (
        r"Unknown attribute .* of type memory\(",
        "declare it and its initial value: @ha.law(memory={...}) or memory={...} of the session",
    ),
    (
        r"Unknown attribute .* of type params\(",
        "give it and its initial value: @ha.law(params={...}) or params={...} of the session",
    ),
    (
        r"Unknown attribute .* of type state\(",
        "a compiled law sees the members of heptarm_state; signals and poses need a law in Python",
    ),
    (
        r"Unknown attribute .* of type out\(",
        "a compiled law commands q, tau, wrench, pose and e1; signals need a law in Python",
    ),
    (
        r"[Uu]ntyped global name|cannot determine Numba type",
        "let the law use constant numbers and arrays, its parameters, its memory, and functions with @numba.njit; or "
        "leave out @ha.law: the law then runs in Python",
    ),
)
