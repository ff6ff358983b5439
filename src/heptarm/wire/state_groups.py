"""The groups of an encoded state, each decoded when it is asked for.

To decode all groups takes 16 us, several times as long after a pause; a loop at 1 kHz often reads the joints alone.
"""

from __future__ import annotations

from functools import lru_cache
from struct import Struct
from typing import Any, NamedTuple

from heptarm.wire.codec import DecodeError
from heptarm.wire.messages import READ_GROUP, STATE_LAYOUT, Groups, State

_MASK = Struct(">H")
_FIXED = sum(bit for _, bit, _ in STATE_LAYOUT)
_KNOWN = sum(Groups)


class _Layout(NamedTuple):
    """Where the groups of a mask are in a body.

    Attributes:
        places: of the groups with a fixed size, by their names.
        stamps: time stamps of the groups that have a known place.
        size: of the groups that have a fixed size, with the mask [bytes].
        least: of a body with these groups [bytes].
        rest: mask of the groups behind them; 0: there are none.
        others: names of these groups.
    """

    places: dict[str, int]
    stamps: Struct
    size: int
    least: int
    rest: int
    others: frozenset[str]


@lru_cache(maxsize=256)
def _layout(mask: int) -> _Layout:
    if mask & ~_KNOWN:
        raise DecodeError(f"unknown state groups {mask:#x}")
    places, stamps, end = {}, ">2x", 2
    for name, bit, fields in STATE_LAYOUT:
        if mask & bit:
            begin = end
            end += sum(int(code[2:]) * count for _, code, count in fields)
            places[name] = begin
            stamps += f"q{end - begin - 8}x"
    rest = mask & ~_FIXED
    is_one = rest > 0 and rest & (rest - 1) == 0
    known = Struct(stamps + "q" if is_one else stamps)
    others = frozenset(name for name in READ_GROUP if rest & Groups[name.upper()])
    return _Layout(places, known, end, max(end, known.size), rest, others)


class StateGroups:
    """The groups of a received state.

    Args:
        body: of a State message.

    Attributes:
        body: the bytes.
        stamp: cabinet time of the newest group [ns]; 0 without any.

    Raises:
        DecodeError: the bytes have another length than their groups.
    """

    __slots__ = ("_layout", "_rest", "body", "stamp")

    def __init__(self, body: bytes) -> None:
        if len(body) < _MASK.size:
            raise DecodeError(f"a state has at least {_MASK.size} bytes, got {len(body)}")
        layout = _layout(body[0] << 8 | body[1])
        if len(body) < layout.least or (len(body) > layout.least and not layout.rest):
            raise DecodeError(f"a state with these groups has {layout.least} bytes, got {len(body)}")
        self.body, self._layout = body, layout
        self._rest: State | None = None
        stamps = layout.stamps.unpack_from(body)
        if layout.rest and layout.stamps.size == layout.size:  # the place of the last stamp has to be found
            stamps += tuple(group.stamp for group in (self.get("io"), self.get("mode")) if group is not None)
        self.stamp: int = max(stamps) if stamps else 0

    def place(self, name: str) -> int | None:
        """Where a group of a fixed size begins in the body; None: the state has none of that name."""
        return self._layout.places.get(name)

    def get(self, name: str) -> Any:
        """The message of a group; None: the state has none of that name.

        Raises:
            DecodeError: its bytes are no such message.
        """
        layout, place = self._layout, self.place(name)
        if place is not None:
            return READ_GROUP[name](self.body, place)[0]
        if name not in layout.others:
            return None
        if self._rest is None:
            self._rest = State.decode(_MASK.pack(layout.rest) + self.body[layout.size :])
        return getattr(self._rest, name)
