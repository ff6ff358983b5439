"""Cartesian impedance with an overlaid force: constant, sinusoidal, a Lissajous figure, a spiral.

Where a direction is given by its name, rotations have KUKA's names: "a" is about z, "b" about y, "c" about x.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isnan, nan, pi

import numpy as np

from heptarm.errors import CommandRejected, ShapeError
from heptarm.values.checks import Array, Value, choice, finite, flag, optional, shown
from heptarm.values.mode.directions import (
    DIRECTIONS,
    FORCE,
    LENGTH,
    PLANES,
    Directional,
    at,
    limit,
    one,
    put,
    six,
)
from heptarm.values.mode.impedance import NO_FORCE, STIFFEST, STRONGEST, UNLIMITED, CartesianImpedance
from heptarm.values.text import listing

#: Highest frequency of an overlaid force [Hz].
FASTEST = 15.0
#: Second over first frequency of a Lissajous pattern, and the second one's phase [rad].
LISSAJOUS_RATIO = 0.4
LISSAJOUS_PHASE = pi / 2

_LONGEST_TIME = 1e6


@dataclass(frozen=True, slots=True, eq=False, init=False)
class SineImpedance(Value):
    """Cartesian impedance with an overlaid force: bias + amplitude * sin(2 pi frequency t + phase).

    The class methods build the four patterns; `timed` bounds one in time. The force rises linearly for `rise_time`,
    lasts for `hold_time` and falls linearly for `fall_time`; after `total_time` it is zero in any case.

    Args:
        base: the impedance without the overlaid force; None: the default one.
        amplitude: shape (6,) [N, Nm], 0 to 500.
        frequency: shape (6,) [Hz], 0 to 15.
        phase: at the beginning, shape (6,) [rad], 0 to 6.3.
        bias: constant part, shape (6,) [N, Nm], -500 to 500.
        force_limit: largest overlaid force, shape (6,) [N, Nm], 0 to 1e6; NaN or None: unlimited.
        position_limit: largest deviation from the set-point that the overlaid force may cause, shape (6,)
            [m, rad], 0 to 100; NaN or None: unlimited.
        total_time: [s], up to 1e6; NaN or None: the sum of the other times.
        rise_time: [s], up to 1e6.
        hold_time: [s], up to 1e6; NaN or None: the rest of `total_time`, without one until the motion ends.
        fall_time: [s], up to 1e6.
        stay_active: the motion does not end before the pattern ends.

    Raises:
        ShapeError: a wrong shape or type.
        LimitError: a value outside its range.
        CommandRejected: times that contradict each other.
    """

    base: CartesianImpedance
    amplitude: Array
    frequency: Array
    phase: Array
    bias: Array
    force_limit: Array
    position_limit: Array
    total_time: float
    rise_time: float
    hold_time: float
    fall_time: float
    stay_active: bool

    def __init__(
        self,
        base: CartesianImpedance | None = None,
        *,
        amplitude: Directional = NO_FORCE,
        frequency: Directional = (0.0,) * 6,
        phase: Directional = (0.0,) * 6,
        bias: Directional = NO_FORCE,
        force_limit: Directional | None = None,
        position_limit: Directional | None = None,
        total_time: float | None = None,
        rise_time: float = 0.0,
        hold_time: float | None = None,
        fall_time: float = 0.0,
        stay_active: bool = False,
    ) -> None:
        put(self, "base", _base(base))
        put(self, "amplitude", six(amplitude, "amplitude", 0.0, STRONGEST, FORCE))
        put(self, "frequency", six(frequency, "frequency", 0.0, FASTEST, ("Hz", "Hz")))
        put(self, "phase", six(phase, "phase", 0.0, 6.3, ("rad", "rad")))
        put(self, "bias", six(bias, "bias", -STRONGEST, STRONGEST, FORCE))
        put(self, "force_limit", limit(force_limit, "force_limit", UNLIMITED, FORCE))
        put(self, "position_limit", limit(position_limit, "position_limit", 100.0, LENGTH))
        put(self, "total_time", _time(total_time, "total_time"))
        put(self, "rise_time", one(rise_time, "rise_time", 0.0, _LONGEST_TIME, "s"))
        put(self, "hold_time", _time(hold_time, "hold_time"))
        put(self, "fall_time", one(fall_time, "fall_time", 0.0, _LONGEST_TIME, "s"))
        put(self, "stay_active", flag(stay_active, "stay_active"))
        ramps = self.rise_time + self.fall_time
        if ramps > self.total_time:
            raise CommandRejected(
                f"total_time must be at least rise_time + fall_time = {ramps:g} s, got {self.total_time:g} s",
                code=2,
                parameter="total_time",
                value=self.total_time,
                hint="give a longer total_time",
            )
        if self.stay_active and isnan(self.duration):
            raise CommandRejected(
                "stay_active must not be set for a pattern without an end",
                code=2,
                parameter="stay_active",
                hint="give a total_time or a hold_time",
            )

    def __str__(self) -> str:
        """One line: the impedance, and the force overlaid on it."""
        quantities = (
            ("amplitude", self.amplitude, "N, Nm"),
            ("frequency", self.frequency, "Hz"),
            ("bias", self.bias, "N, Nm"),
        )
        parts = [f"{name} {listing(values, unit)}" for name, values, unit in quantities if values.any()]
        parts += [] if isnan(self.duration) else [f"for {self.duration:g} s"]
        return f"{self.base}; overlaid force: {', '.join(parts) or 'none'}"

    @property
    def duration(self) -> float:
        """Time when the overlaid force ends [s]; NaN: it lasts as long as the motion."""
        return float(np.fmin(self.total_time, self.rise_time + self.hold_time + self.fall_time))

    @classmethod
    def force(
        cls,
        *,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        a: float = 0.0,
        b: float = 0.0,
        c: float = 0.0,
        stiffness: float | None = None,
        base: CartesianImpedance | None = None,
    ) -> SineImpedance:
        """Pattern of a constant force.

        Args:
            x: force along x [N], as y and z.
            y: see x.
            z: see x.
            a: torque about z [Nm].
            b: torque about y [Nm].
            c: torque about x [Nm].
            stiffness: of the directions in which a force acts [N/m or Nm/rad]; None: the base's.
            base: the impedance without the overlaid force; None: the default one.

        Raises:
            LimitError: a value outside its range.
        """
        acting = zip("xyzcba", (x, y, z, c, b, a), strict=True)
        bias = six([finite(value, name) for name, value in acting], "bias", -STRONGEST, STRONGEST, FORCE)
        return cls(_with(base, stiffness, np.flatnonzero(bias).tolist()), bias=bias)

    @classmethod
    def sine(
        cls,
        direction: str,
        *,
        frequency: float,
        amplitude: float,
        phase: float = 0.0,
        bias: float = 0.0,
        stiffness: float | None = None,
        base: CartesianImpedance | None = None,
    ) -> SineImpedance:
        """Pattern of a sinusoidal force in one direction.

        Args:
            direction: "x", "y", "z", or a torque: "a" (about z), "b" (about y), "c" (about x).
            frequency: [Hz], up to 15.
            amplitude: [N], of a torque [Nm], up to 500.
            phase: at the beginning [rad].
            bias: constant part [N], of a torque [Nm].
            stiffness: of that direction [N/m or Nm/rad]; None: the base's.
            base: the impedance without the overlaid force; None: the default one.

        Raises:
            ShapeError: no such direction.
            LimitError: a value outside its range.
        """
        index = choice(direction, "direction", DIRECTIONS)
        return cls(
            _with(base, stiffness, [index]),
            amplitude=at([index], [amplitude]),
            frequency=at([index], [frequency]),
            phase=at([index], [phase]),
            bias=at([index], [bias]),
        )

    @classmethod
    def lissajous(
        cls,
        plane: str,
        *,
        frequency: float,
        amplitude: float,
        stiffness: float | None = None,
        base: CartesianImpedance | None = None,
    ) -> SineImpedance:
        """Pattern of a force that follows a Lissajous figure; the second axis has 0.4 times the frequency.

        Args:
            plane: "xy", "xz" or "yz".
            frequency: along the plane's first axis [Hz], up to 15.
            amplitude: along both axes [N], up to 500.
            stiffness: along both axes [N/m]; None: the base's.
            base: the impedance without the overlaid force; None: the default one.

        Raises:
            ShapeError: no such plane.
            LimitError: a value outside its range.
        """
        axes = choice(plane, "plane", PLANES)
        first = one(frequency, "frequency", 0.0, FASTEST, "Hz")
        return cls(
            _with(base, stiffness, axes),
            amplitude=at(axes, [amplitude, amplitude]),
            frequency=at(axes, [first, LISSAJOUS_RATIO * first]),
            phase=at(axes, [0.0, LISSAJOUS_PHASE]),
        )

    @classmethod
    def spiral(
        cls,
        plane: str,
        *,
        frequency: float,
        amplitude: float,
        total_time: float,
        stiffness: float | None = None,
        base: CartesianImpedance | None = None,
    ) -> SineImpedance:
        """Pattern of a force that follows a spiral: outwards for half of its time, then back.

        Args:
            plane: "xy", "xz" or "yz".
            frequency: turns in a second [Hz], up to 15.
            amplitude: of the outermost turn [N], up to 500.
            total_time: [s], up to 1e6.
            stiffness: along both axes [N/m]; None: the base's.
            base: the impedance without the overlaid force; None: the default one.

        Raises:
            ShapeError: no such plane.
            LimitError: a value outside its range.
        """
        axes = choice(plane, "plane", PLANES)
        time = one(total_time, "total_time", 0.0, _LONGEST_TIME, "s", above=True)
        return cls(
            _with(base, stiffness, axes),
            amplitude=at(axes, [amplitude, amplitude]),
            frequency=at(axes, [frequency, frequency]),
            phase=at(axes, [pi / 2, 0.0]),
            total_time=time,
            rise_time=0.5 * time,
            fall_time=0.5 * time,
        )

    def timed(
        self,
        *,
        rise_time: float = 0.0,
        hold_time: float | None = None,
        fall_time: float = 0.0,
        total_time: float | None = None,
        stay_active: bool = False,
    ) -> SineImpedance:
        """The same pattern with these times, see the class.

        Raises:
            LimitError: a time outside its range.
            CommandRejected: times that contradict each other.
        """
        return replace(
            self,
            rise_time=rise_time,
            hold_time=nan if hold_time is None else hold_time,
            fall_time=fall_time,
            total_time=nan if total_time is None else total_time,
            stay_active=stay_active,
        )


def _time(value: float | None, name: str) -> float:
    if isinstance(value, float) and isnan(value):
        return nan
    return optional(value, name, 0.0, _LONGEST_TIME, unit="s")


def _base(value: CartesianImpedance | None) -> CartesianImpedance:
    if value is None:
        return CartesianImpedance()
    if not isinstance(value, CartesianImpedance):
        raise ShapeError(
            f"base must be a CartesianImpedance, got {shown(value)}", parameter="base", value=value
        )
    return value


def _with(
    base: CartesianImpedance | None, stiffness: float | None, directions: Sequence[int]
) -> CartesianImpedance:
    """The impedance with another stiffness in some directions."""
    under = _base(base)
    if stiffness is None:
        return under
    most, unit = (STIFFEST[1], "Nm/rad") if any(index > 2 for index in directions) else (STIFFEST[0], "N/m")
    stiffness = one(stiffness, "stiffness", 0.0, most, unit)
    changed = under.stiffness.tolist()
    for index in directions:
        changed[index] = stiffness
    return replace(under, stiffness=changed)
