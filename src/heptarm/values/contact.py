"""Contacts: where the arm touched something, and how hard."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

import numpy as np
import numpy.typing as npt

from heptarm.errors import ShapeError
from heptarm.values.arrays import Array, Value, array, frozen, within
from heptarm.values.pose import Pose
from heptarm.values.result import Result

_AXES = {
    sign + name: tuple((-1.0 if sign == "-" else 1.0) * (i == k) for k in range(3))
    for sign in ("", "+", "-")
    for i, name in enumerate("xyz")
}


def direction_of(value: str | npt.ArrayLike) -> Array:
    """A unit vector, shape (3,), from the name of an axis such as "z" or "-x", or from a vector.

    Raises:
        ShapeError: it is neither, or has no length.
    """
    if isinstance(value, str):
        if value not in _AXES:
            raise ShapeError(
                f"direction is {value!r}; allowed are 'x', '-x', 'y', '-y', 'z', '-z' and vectors",
                parameter="direction",
                value=value,
            )
        return frozen(_AXES[value])
    vector = array(value, 3, "direction")
    length = float(np.linalg.norm(vector))
    if length < 1e-9:
        raise ShapeError(
            "direction is zero; a vector with a length is wanted", parameter="direction", value=value
        )
    return frozen(vector / length)


@dataclass(frozen=True, slots=True, eq=False)
class Contact(Value):
    """Something that was touched.

    Attributes:
        pose: of the moved frame in the base when the force was felt, before the arm braked.
        force: what acted on the robot at that moment, less what acted before, base axes, shape (3,) [N].
        travel: way from the start to the contact [m].
        q: joint positions at the contact, shape (7,) [rad].
        result: how the motion towards it ended.
        first: of a double touch: the first, fast contact.
    """

    pose: Pose
    force: Array
    travel: float
    q: Array
    result: Result
    first: Contact | None = None

    @property
    def spread(self) -> float:
        """Of a double touch: distance between its two contacts [m]; NaN of a single one."""
        return nan if self.first is None else self.first.pose.distance_to(self.pose)


class TapCounter:
    """Counts taps: forces that come and go quickly, one soon after the other.

    Args:
        force: a tap is at least so strong [N].
        longest: and at most so long [s].
        gap: the next one comes within this time [s].

    Attributes:
        count: taps of the present row.
    """

    def __init__(self, *, force: float, longest: float = 0.4, gap: float = 1.0) -> None:
        self._force, self._longest, self._gap = force, longest, gap
        self._rose = nan
        self._last = nan
        self.count = 0

    def see(self, time: float, strength: float) -> int:
        """Look at a force.

        Args:
            time: of the measurement [s].
            strength: magnitude, less what acts all the time [N].

        Returns:
            Taps of the present row; it begins anew after a pause or a long push.
        """
        if self.count and self._rose != self._rose and time - self._last > self._gap:
            self.count = 0
        if self._rose != self._rose and strength >= self._force:
            self._rose = time
        elif self._rose == self._rose and strength < 0.5 * self._force:
            short = time - self._rose <= self._longest
            self.count = self.count + 1 if short else 0
            self._rose, self._last = nan, time
        return self.count


class TapWatch:
    """Counts the taps on a resting arm, by the forces that act on it.

    What acts all the time is no tap: the mean of the first forces, and whatever lasts becomes part of it.

    Args:
        force: a tap is at least so strong [N].
        gap: the next one comes within this time [s].

    Raises:
        LimitError: a value outside its range.
    """

    #: Forces whose mean is what acts before anybody taps.
    SAMPLES = 8
    #: Largest force that can be waited for [N].
    STRONGEST = 500.0
    #: A force that lasts so long is no tap any more, but what the arm bears [s].
    LASTING = 3.0

    def __init__(self, *, force: float = 8.0, gap: float = 1.0) -> None:
        strong = within(force, "force", 0.0, self.STRONGEST, above=True, unit="N")
        self._taps = TapCounter(force=strong, gap=within(gap, "gap", 0.0, 60.0, above=True, unit="s"))
        self._first: list[Array] = []
        self._bias = np.zeros(3)
        self._last = nan

    def see(self, time: float, force: Array) -> int:
        """Look at a force.

        Args:
            time: of the measurement [s].
            force: what acts on the robot, in axes that rest, shape (3,) [N].

        Returns:
            Taps of the present row; 0 while the first forces come.
        """
        if len(self._first) < self.SAMPLES:
            self._first.append(force)
            self._bias, self._last = np.mean(self._first, axis=0), time
            return 0
        self._bias = self._bias + (force - self._bias) * min(1.0, (time - self._last) / self.LASTING)
        self._last = time
        return self._taps.see(time, float(np.linalg.norm(force - self._bias)))
