"""Pushed states as they arrived, and the reading of many of them at once."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from heptarm.record.layout import STATE, Rows, column
from heptarm.values.checks import Array
from heptarm.wire import messages as wire
from heptarm.wire.messages import STATE_LAYOUT

_FIXED = sum(bit for _, bit, _ in STATE_LAYOUT)
#: Sizes of the mask of a state's groups, and of the stamp with which each of them begins [bytes].
_MASK_SIZE, _STAMP_SIZE = 2, 8


class StateSample(NamedTuple):
    """A pushed state, still encoded.

    Attributes:
        number: counts the states of the arm from 1.
        body: its bytes.
        received: our clock at its receipt [ns].
    """

    number: int
    body: bytes
    received: int


class SampleQueue:
    """A bounded queue of samples; when it is full the oldest are dropped and counted.

    Attributes:
        lost: number of dropped samples, and of those that never arrived, up to the place that the reader has reached.
    """

    __slots__ = ("_changed", "_gaps", "_lock", "_samples", "_waiting", "lost")

    def __init__(self, size: int) -> None:
        self._samples: deque[StateSample] = deque(maxlen=size)
        self._gaps: deque[tuple[int, int]] = deque()  # the number of the sample before a gap, and its size
        self._lock = threading.Lock()
        self._changed = threading.Condition(self._lock)
        self._waiting = 0
        self.lost = 0

    @property
    def is_empty(self) -> bool:
        """Whether no sample waits to be taken."""
        return not self._samples

    def put(self, sample: StateSample) -> None:
        """Append a sample."""
        with self._lock:
            if len(self._samples) == self._samples.maxlen:
                self.lost += 1
            self._samples.append(sample)
            if self._waiting:
                self._changed.notify()

    def put_before(self, samples: Sequence[StateSample], *, after: int) -> None:
        """Put older samples before those that are in the queue.

        Args:
            samples: in order; those that are in the queue already are left out.
            after: number of the last sample that is not asked for; the older ones that are missing count as lost.
        """
        with self._lock:
            there = list(self._samples)
            first = there[0].number if there else float("inf")
            older = [sample for sample in samples if after < sample.number < first]
            whole = [*older, *there]
            if whole:
                self.lost += max(0, whole[0].number - after - 1)
            self.lost += max(0, len(whole) - (self._samples.maxlen or 0))
            self._samples.clear()
            self._samples.extend(whole)

    def get(self, seconds: float) -> StateSample | None:
        """Take the oldest sample; None if none arrived in time."""
        with self._lock:
            if not self._samples and seconds > 0.0:
                self._waiting += 1
                try:
                    self._changed.wait_for(lambda: bool(self._samples), seconds)
                finally:
                    self._waiting -= 1
            if self._gaps:
                self._pass_gaps()
            return self._samples.popleft() if self._samples else None

    def take(self, most: int) -> list[StateSample]:
        """Take the oldest samples that are there, at most so many, without waiting."""
        with self._lock:
            taken = [self._samples.popleft() for _ in range(min(most, len(self._samples)))]
            self._pass_gaps()
            return taken

    def skip(self, count: int, *, after: int) -> None:
        """Note samples that were lost before they came here; the reader counts them when it comes to their place.

        Args:
            count: how many.
            after: number of the last sample before them.
        """
        with self._lock:
            self._gaps.append((after, count))

    def _pass_gaps(self) -> None:
        """Count what is missing before the sample that is taken next; the caller holds the lock."""
        while self._gaps and (not self._samples or self._gaps[0][0] < self._samples[0].number):
            self.lost += self._gaps.popleft()[1]


@cache
def _body_dtype(mask: int) -> np.dtype[Any]:
    """Type of the part of a body whose size is fixed, by the mask of its groups."""
    entries: list[Any] = [("_mask", ">u2")]
    for group, bit, fields in STATE_LAYOUT:
        if mask & bit:
            for name, code, size in fields:
                entries.append(
                    (column(group, name), code) if size == 1 else (column(group, name), code, (size,))
                )
    return np.dtype(entries)


def _mask(body: bytes) -> int:
    return int.from_bytes(body[:2], "big")


def state_rows(bodies: Sequence[bytes]) -> Rows:
    """Rows of states; groups that a state lacks are NaN, and 0 where they are integers.

    Raises:
        ValueError: a body is too short.
    """
    rows = STATE.rows(len(bodies))
    start = 0
    for head, run in groupby(bodies, key=lambda body: body[:2]):
        part = list(run)
        mask = int.from_bytes(head, "big")
        dtype, end = _body_dtype(mask), start + len(part)
        size = dtype.itemsize
        if min(map(len, part)) < size:
            raise ValueError(f"a state must have at least {size} bytes, got {min(map(len, part))}")
        read = np.frombuffer(b"".join(body[:size] for body in part), dtype)
        stamps = []
        for group, bit, fields in STATE_LAYOUT:
            if mask & bit:
                for name, _, _ in fields:
                    field = column(group, name)
                    rows[field][start:end] = read[field]
                stamps.append(read[column(group, "stamp")])
        if stamps:
            rows["stamp"][start:end] = np.max(stamps, axis=0)
        start = end
    return rows


class RestWatch:
    """Watches the groups of a state whose size varies, signals and control mode, for changes besides their stamps.

    They hardly ever change, and to decode them takes longer than to record the state; so their bytes are compared.
    """

    def __init__(self) -> None:
        self._stamps: tuple[slice, ...] = ()
        self._last = b""

    def change(self, body: bytes) -> wire.State | None:
        """Those groups of a state, if they are not the same as in the state before; None: the same, or it has none.

        Raises:
            DecodeError: bytes that are no state.
        """
        mask = _mask(body)
        if not mask & ~_FIXED:
            return None
        rest = (mask & ~_FIXED).to_bytes(2, "big") + body[_body_dtype(mask).itemsize :]
        if self._timeless(rest) == self._last:
            return None
        state = wire.State.decode(rest)
        begin_of_mode = len(rest) - len(wire.State(mode=state.mode).encode()) + _MASK_SIZE
        self._stamps = tuple(
            slice(begin, begin + _STAMP_SIZE)
            for begin, group in ((begin_of_mode, state.mode), (_MASK_SIZE, state.io))
            if group is not None
        )
        self._last = self._timeless(rest)
        return state

    def _timeless(self, rest: bytes) -> bytes:
        """Without the bytes at which the last state that was decoded had its stamps.

        Equal results belong to equal places: what decides where a stamp is, the mask and the number of signals, is
        compared as well.
        """
        for stamp in self._stamps:
            rest = rest[: stamp.start] + rest[stamp.stop :]
        return rest


#: Labels of the entries of signals by their number of entries, and by name where that is not enough.
_AXES = {
    7: tuple(f"A{i}" for i in range(1, 8)),
    3: ("x", "y", "z"),
    4: ("x", "y", "z", "w"),
    10: tuple(map(str, range(10))),
}
_POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
_WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")


def labels(name: str, size: int) -> tuple[str, ...]:
    """Labels of the entries of a signal, such as "A1"."""
    short = name.rpartition(".")[2]
    if short.startswith("pose"):
        return _POSE
    if short.startswith("wrench"):
        return _WRENCH
    return _AXES.get(size, tuple(map(str, range(size))))


def signals_of(rows: Rows) -> dict[str, npt.NDArray[Any]]:
    """Arrays by signal name: the fields of the rows, and `pose` and `wrench` put together from their parts."""
    found: dict[str, npt.NDArray[Any]] = {
        name: np.ascontiguousarray(rows[name]) for name in rows.dtype.names or () if not name.startswith("_")
    }
    for whole, parts in _WHOLES.items():
        if all(part in found for part in parts):
            found[whole] = np.concatenate([found[part] for part in parts], axis=1)
    return found


_WHOLES = {"pose": ("xyz", "quat"), "pose_cmd": ("xyz_cmd", "quat_cmd"), "wrench": ("force", "torque")}


def states_to_numpy(samples: Sequence[StateSample]) -> dict[str, npt.NDArray[Any]]:
    """Arrays by signal name of pushed states; `t` is the cabinet's time since the first one [s]."""
    signals = signals_of(state_rows([sample.body for sample in samples]))
    stamp = signals["stamp"]
    t: Array = (stamp - stamp[0]) * 1e-9 if len(stamp) else np.zeros(0)
    return {"t": t, **signals}


def to_frame(signals: dict[str, npt.NDArray[Any]], make: Callable[..., Any]) -> Any:
    """A table with a column per number: "q.A1" for the first entry of `q`; its index is `t`.

    Args:
        signals: arrays by name, `t` among them.
        make: `pandas.DataFrame`.
    """
    columns = dict(_columns(signals))
    table = make(columns)
    return table.set_index("t") if "t" in columns else table


def _columns(signals: dict[str, npt.NDArray[Any]]) -> Iterator[tuple[str, npt.NDArray[Any]]]:
    for name, values in signals.items():
        if values.ndim == 1:
            yield name, values
        else:
            for index, label in enumerate(labels(name, values.shape[1])):
                yield f"{name}.{label}", values[:, index]
