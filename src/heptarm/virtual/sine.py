"""The overlaid force of Cartesian sine impedance: a constant part and a sine in each direction, risen and fallen.

All four patterns are of this kind: a constant force has no sine; a Lissajous figure and a spiral have one in each of
two directions, the spiral's rising and falling.
"""

from __future__ import annotations

from math import inf, isnan, pi

import numpy as np

from heptarm.values.arrays import Array
from heptarm.values.mode import SineImpedance

#: In this last part of the way to the position limit the force that pushes towards it fades out.
FADE = 0.2
#: In place of no limit [N, Nm, m, rad]; infinity would make NaN of it.
_NONE = 1e9


class Pattern:
    """An overlaid force over time.

    Args:
        mode: what it was ordered as.

    Attributes:
        mode: the same.
        end: when the force is gone for good [s]; infinite: never.
        stays: the motion is not to end before that.
    """

    def __init__(self, mode: SineImpedance) -> None:
        self.mode = mode
        duration = mode.duration
        self.end = inf if isnan(duration) else duration
        self.stays = mode.stay_active
        self._pulsation = 2.0 * pi * mode.frequency
        self._limited = not bool(np.isnan(mode.force_limit).all())
        self._most = np.nan_to_num(mode.force_limit, nan=_NONE)
        self._bounded = not bool(np.isnan(mode.position_limit).all())
        self._reach = np.nan_to_num(mode.position_limit, nan=_NONE)
        self._slope = 1.0 / np.maximum(FADE * self._reach, 1.0 / _NONE)

    def share(self, time: float) -> float:
        """How much of the force acts at a time since the beginning [s], 0 to 1."""
        if time < 0.0 or time >= self.end:
            return 0.0
        rise, fall, left = self.mode.rise_time, self.mode.fall_time, self.end - time
        risen = time / rise if time < rise else 1.0
        fallen = left / fall if left < fall else 1.0
        return min(risen, fallen)

    def force(self, time: float, deviation: Array) -> Array:
        """The force on the moved frame.

        Args:
            time: since the beginning [s].
            deviation: of the moved frame from its set-point, shape (6,) [m, rad].

        Returns:
            Shape (6,) [N, Nm], in the axes of the mode's frame.
        """
        share, mode = self.share(time), self.mode
        if share == 0.0:
            return np.zeros(6)
        force: Array = mode.amplitude * np.sin(self._pulsation * time + mode.phase)
        force += mode.bias
        force *= share
        if self._limited:
            np.minimum(force, self._most, out=force)
            np.maximum(force, -self._most, out=force)
        if self._bounded:
            room = np.minimum(np.maximum((self._reach - np.abs(deviation)) * self._slope, 0.0), 1.0)
            force *= np.where(force * deviation > 0.0, room, 1.0)  # what pulls back acts in full
        return force
