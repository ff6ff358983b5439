"""The signals that an FRI session carries: found by name, told apart by direction, checked before they are written."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence

from heptarm.errors import CommandRejected, LimitError
from heptarm.fri import messages as m
from heptarm.values.io import Signal, SignalValue, find_name

_KINDS = {m.IoType.BOOLEAN: "boolean", m.IoType.DIGITAL: "unsigned", m.IoType.ANALOG: "analog"}
_RANGES = {"boolean": (0.0, 1.0), "unsigned": (0.0, 2.0**64 - 1), "analog": (-math.inf, math.inf)}


class Signals:
    """Signals of a session, in the order of its messages.

    Args:
        signals: all of them.

    Attributes:
        names: "Group.Signal" of each.
    """

    __slots__ = ("_signals", "names")

    def __init__(self, signals: Iterable[Signal] = ()) -> None:
        self._signals = tuple(signals)
        self.names = tuple(one.name for one in self._signals)

    @classmethod
    def of(cls, values: Iterable[m.IoValue]) -> Signals:
        """Those of a message."""
        return cls(
            _signal(one.name, _KINDS[one.type], is_output=one.direction is m.IoDirection.OUTPUT) for one in values
        )

    def __len__(self) -> int:
        return len(self._signals)

    @property
    def text(self) -> str:
        """For the shared memory."""
        return json.dumps([(one.name, one.kind, one.is_output) for one in self._signals])

    @classmethod
    def read(cls, text: str) -> Signals:
        """Those that `text` has told."""
        return cls(_signal(name, kind, is_output=is_output) for name, kind, is_output in json.loads(text))

    def values(self, numbers: Sequence[float], *, is_output: bool | None = None) -> dict[str, SignalValue]:
        """Values by name.

        Args:
            numbers: one a signal.
            is_output: only outputs, or only inputs; None: all.
        """
        return {
            one.name: one.value(number)
            for one, number in zip(self._signals, numbers, strict=False)
            if is_output is None or one.is_output is is_output
        }

    def output(self, name: str, value: SignalValue) -> tuple[str, int | float]:
        """Full name of an output, and a value that it can have.

        Raises:
            CommandRejected: this session has none of that name, or it is an input.
            LimitError: it cannot have the value.
        """
        outputs = ", ".join(one.name for one in self._signals if one.is_output) or "none"
        try:
            signal = self._signals[find_name(name, self.names)]
        except CommandRejected as error:
            raise CommandRejected(
                f"{error.text} in this FRI session",
                parameter="io",
                value=name,
                allowed=outputs,
                hint="name it where the session is opened, as in arm.fri(..., io=[...]); a cabinet that runs another "
                "application registers it in its FRI configuration",
            ) from None
        if not signal.is_output:
            raise CommandRejected(
                f"{signal.name} is an input of the cabinet, so that FRI cannot write it",
                parameter="io",
                value=name,
                allowed=outputs,
            )
        number = float(value)
        low, high = signal.low, signal.high
        whole = signal.kind == "analog" or number == round(number) if math.isfinite(number) else False
        if not (low <= number <= high) or not whole:
            allowed = {"boolean": "True or False", "unsigned": "0, 1, 2, ..."}.get(signal.kind, "a finite number")
            raise LimitError(
                f"{signal.name} is {signal.kind}; it cannot be {value!r}",
                parameter=signal.name,
                value=value,
                allowed=allowed,
            )
        return signal.name, number if signal.kind == "analog" else int(value)


def _signal(name: str, kind: str, *, is_output: bool) -> Signal:
    low, high = _RANGES[kind]
    return Signal(name, is_output, kind, low, high)


class Outputs:
    """Outputs as a law writes them: `out.io["LEDBlue"] = True`.

    Attributes:
        signals: of the session.
        wanted: by full name, what was written in this cycle.
    """

    __slots__ = ("signals", "wanted")

    def __init__(self) -> None:
        self.signals = Signals()
        self.wanted: dict[str, int | float] = {}

    def __setitem__(self, name: str, value: SignalValue) -> None:
        """Write one. Raises as `Signals.output` does."""
        full, number = self.signals.output(name, value)
        self.wanted[full] = number
