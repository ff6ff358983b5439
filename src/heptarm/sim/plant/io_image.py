"""The virtual cabinet's IO image: inputs and outputs by name, their values in memory shared with Java."""

from __future__ import annotations

import threading

from heptarm.values.checks import Array


class IoImage:
    """Inputs and outputs of the simulated cabinet.

    On a robot the project defines them; here each is created at its first use.

    Args:
        values: of the signals by index, shape (n,).

    Attributes:
        values: the same array.
    """

    def __init__(self, values: Array) -> None:
        self.values = values
        self._places: dict[tuple[str, bool], int] = {}
        self._lock = threading.Lock()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all signals, "Group.Name"."""
        return tuple(name for name, _ in self._places)

    def place(self, name: str, *, is_output: bool) -> int:
        """Index of a signal; created if there is none.

        Raises:
            ValueError: the image is full.
        """
        with self._lock:
            place = self._places.setdefault((name, is_output), len(self._places))
            if place >= len(self.values):
                del self._places[name, is_output]
                raise ValueError(f"the IO image is full: at most {len(self.values)} signals")
            return place

    def find(self, name: str) -> int:
        """Index of a signal by its name, or by the part after the point where that is unique; ignores case.

        Raises:
            ValueError: there is none, or more than one.
        """
        found = [
            place
            for (known, _), place in self._places.items()
            if name.casefold() in (known.casefold(), known.rpartition(".")[2].casefold())
        ]
        exact = [place for (known, _), place in self._places.items() if known == name]
        if len(exact or found) != 1:
            raise ValueError(
                f"signal {name!r} is unknown or ambiguous; signals are: {', '.join(self.names) or 'none'}"
            )
        return (exact or found)[0]

    def get(self, name: str) -> float:
        """Value of a signal. Raises as `find` does."""
        return float(self.values[self.find(name)])

    def set(self, name: str, value: float) -> None:
        """Set the value of a signal; 0 or 1 of a boolean. Raises as `find` does."""
        self.values[self.find(name)] = value
