"""Interface of a compiled law: the members of its state and of its output, its parameters and its memory.

schema/generate.py writes include/heptarm_law.h from these tables, so C, C++ and Numba see the same structures. Every
member has words of eight bytes; parameters and memory are structures of doubles in the order of their dictionaries.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import prod
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from heptarm.errors import ShapeError, UnknownSetting
from heptarm.fri.loop.parameters import Param
from heptarm.fri.protocol.messages import JOINTS
from heptarm.values.checks import finite_entries, numbers, shown
from heptarm.values.pose import Pose
from heptarm.values.sealed import meant

Floats = npt.NDArray[np.float64]
#: What a member of the memory is given; a pose is x y z [m] and its quaternion x y z w, shape (7,).
Given: TypeAlias = npt.ArrayLike | Pose
#: What a parameter is given initially: a value, or its declaration with one.
Initial: TypeAlias = Given | Param
#: Shape and first word of each member, by name.
Schema: TypeAlias = Mapping[str, tuple[tuple[int, ...], int]]

#: Version of the interface; a law that was built for another one is refused.
VERSION = 1

#: `struct heptarm_state`: type, shape, name, meaning.
STATE: tuple[tuple[str, tuple[int, ...], str, str], ...] = (
    ("real", (), "t", "controller's time since commands became effective [s]"),
    ("real", (), "dt", "command period [s]"),
    ("real", (), "tracking", "tracking performance, 0 to 1"),
    ("real", (JOINTS,), "q", "measured positions [rad]"),
    ("real", (JOINTS,), "dq", "velocities by the difference to the previous message [rad/s]"),
    ("real", (JOINTS,), "tau", "measured torques [Nm]"),
    ("real", (JOINTS,), "tau_cmd", "torques commanded by the controller [Nm]"),
    ("real", (JOINTS,), "tau_ext", "external torques [Nm]"),
    ("real", (JOINTS,), "q_cmd", "positions commanded by the controller [rad]; FRI 1.x"),
    ("real", (JOINTS,), "q_ipo", "interpolator's positions [rad]"),
    ("real", (6,), "wrench", "external wrench on the flange [N, Nm]; estimated before FRI 2.7"),
    ("word", (), "sequence", "controller's counter"),
    ("word", (), "stamp", "controller's clock [ns since 1970]; 0 if it sends no time"),
    ("word", (), "received", "time of receipt, this machine's monotonic clock [ns]"),
    ("word", (), "session", "state of the session; 4: COMMANDING_ACTIVE"),
    ("word", (), "quality", "0 poor to 3 excellent"),
    ("word", (), "mode", "1 position, 2 wrench, 3 torque, 4 pose"),
    ("word", (), "safety", "0 normal, 1 to 3 stops; -1 unknown"),
    ("word", (), "operation_mode", "0 T1, 1 T2, 2 AUT; -1 unknown"),
    ("word", (), "control_mode", "0 position, 1 Cartesian, 2 joint impedance; -1 unknown"),
)
#: `struct heptarm_command`, in the order of the native loop's out_ members.
COMMAND: tuple[tuple[str, tuple[int, ...], str, str], ...] = (
    ("real", (JOINTS,), "q", "positions [rad]; initially the interpolator's"),
    ("real", (JOINTS,), "tau", "superposed torques [Nm]; initially zero"),
    ("real", (6,), "wrench", "superposed wrench [N, Nm]; initially zero"),
    ("real", (JOINTS,), "pose", "x y z [m], quaternion x y z w; initially the interpolator's"),
    ("real", (), "e1", "redundancy angle of the pose [rad]; initially the interpolator's"),
)


def flat(values: Mapping[str, Initial], what: str) -> tuple[Floats, dict[str, tuple[tuple[int, ...], int]]]:
    """Flatten numbers and arrays by name into words and their schema.

    Args:
        values: numbers, arrays and poses by name, or declarations of parameters.
        what: "params" or "memory", for the text of an error.

    Raises:
        ShapeError: a value is neither a number nor an array of numbers.
    """
    if not isinstance(values, Mapping):
        raise ShapeError(
            f"{what} must be numbers and arrays by name, got {shown(values)}",
            parameter=what,
            value=values,
        )
    parts: list[Floats] = []
    schema: dict[str, tuple[tuple[int, ...], int]] = {}
    start = 0
    for name, value in values.items():
        given = (
            value.value
            if isinstance(value, Param)
            else _numbers(value, name, "a number or an array of numbers")
        )
        schema[name] = (given.shape, start)
        parts.append(given.reshape(-1))
        start += given.size
    return (np.concatenate(parts) if parts else np.zeros(0)), schema


def _numbers(value: Given, name: str, wanted: str = "numbers") -> Floats:
    """The numbers of a value, of any shape; raises as `numbers` does."""
    return numbers(value.array if isinstance(value, Pose) else value, name, wanted)


def size(schema: Schema) -> int:
    """Number of words of a schema."""
    return max((start + prod(shape) for shape, start in schema.values()), default=0)


def dtype(schema: Schema) -> np.dtype[np.void]:
    """Structured type of a schema: one member of doubles a name."""
    return np.dtype([(name, np.float64, shape) for name, (shape, _) in schema.items()])


class Fields:
    """Numbers and arrays by name on a vector of words.

    Args:
        values: all words.
        schema: shape and first word of each name.
        what: "parameter" or "member", for the text of an error.
    """

    __slots__ = ("_schema", "_values", "_what")

    _schema: dict[str, tuple[tuple[int, ...], int]]
    _values: Floats
    _what: str

    def __init__(self, values: Floats, schema: Schema, what: str) -> None:
        object.__setattr__(self, "_values", values)
        object.__setattr__(self, "_schema", dict(schema))
        object.__setattr__(self, "_what", what)

    def _view(self, name: str) -> Any:
        """A number, or a view of an array."""
        try:
            shape, start = self._schema[name]
        except KeyError:
            raise self._unknown(name) from None
        if not shape:
            return float(self._values[start])
        return self._values[start : start + prod(shape)].reshape(shape)

    def _unknown(self, name: str) -> UnknownSetting:
        known = ", ".join(self._schema) or "none"
        return UnknownSetting(
            f"no {self._what} {name!r}; there are {known}",
            parameter=name,
            allowed=known,
            hint=meant(name, self._schema),
        )

    def _checked(self, values: Mapping[str, Given]) -> list[tuple[int, Floats]]:
        """First word and numbers of each value, checked."""
        found = []
        for name, value in values.items():
            given = finite_entries(_numbers(value, name), name, nan=True)
            if name not in self._schema:
                raise self._unknown(name)
            shape, start = self._schema[name]
            if given.shape != tuple(shape):
                raise ShapeError(
                    f"{name} must have shape {tuple(shape)}, as initially, got {given.shape}",
                    parameter=name,
                )
            found.append((start, given.reshape(-1)))
        return found


class Memory(Fields):
    """Memory of a law, as the law sees it: numbers and arrays that keep their values from call to call.

    Arrays may be changed in place (`m.x[:] = ...`) or assigned (`m.x = ...`), numbers are assigned.

    Args:
        values: all words, in the process of the loop.
        schema: shape and first word of each name.
    """

    __slots__ = ()

    def __init__(self, values: Floats, schema: Schema) -> None:
        super().__init__(values, schema, "member of the memory")

    def __getattr__(self, name: str) -> Any:
        return self._view(name)

    def __setattr__(self, name: str, value: Given) -> None:
        if name not in self._schema:
            raise self._unknown(name)
        shape, start = self._schema[name]
        given = value.array if isinstance(value, Pose) else value
        self._values[start : start + prod(shape)].reshape(shape)[...] = given


class LiveMemory(Fields):
    """Memory of a running law, as the user's process sees it: read it and write it while the law runs.

    Every read takes the newest complete snapshot; a write takes effect before the law's next call.

    Args:
        initial: values until the first call, shape (n,).
        schema: shape and first word of each name.
        newest: returns the words after the last call, None before the first one.
        write: sends the words and the count of writes of each one, shape (2n,).
    """

    __slots__ = ("_newest", "_write", "_written")

    _newest: Callable[[], Floats | None]
    _write: Callable[[Floats], None]
    _written: Floats

    def __init__(
        self,
        initial: Floats,
        schema: Schema,
        *,
        newest: Callable[[], Floats | None],
        write: Callable[[Floats], None],
    ) -> None:
        super().__init__(initial, schema, "member of the law's memory")
        object.__setattr__(self, "_newest", newest)
        object.__setattr__(self, "_write", write)
        object.__setattr__(self, "_written", np.zeros(len(initial)))

    def snapshot(self) -> dict[str, Any]:
        """All values after one call of the law, by name: numbers, and copies of arrays."""
        found = self._newest()
        words = Fields((self._values if found is None else found).copy(), self._schema, self._what)
        return {name: words._view(name) for name in self._schema}

    def __getattr__(self, name: str) -> Any:
        found = self.snapshot()
        if name not in found:
            raise self._unknown(name)
        return found[name]

    def __setattr__(self, name: str, value: Given) -> None:
        self.set(**{name: value})

    def set(self, **values: Given) -> None:
        """Write several values at once: the law sees all of them or none.

        Raises:
            ShapeError: a value has a different shape than initially.
            AttributeError: the memory has no such member.
        """
        for start, given in self._checked(values):
            self._values[start : start + given.size] = given
            self._written[start : start + given.size] += 1.0
        self._write(np.concatenate([self._values, self._written]))
