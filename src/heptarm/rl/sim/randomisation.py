"""Domain randomisation: properties of the robots, drawn at random so that a policy does not depend on them.

A precise policy trained without it oscillates around its target when the robot answers later than the
simulation did.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, asdict, dataclass, replace
from math import ceil, floor, inf, isfinite, log
from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.values.checks import Array, instance, integer, numbers, shown, within
from heptarm.values.fitted_arm import FittedArm

#: Largest relative error of a velocity.
_NOISIEST = 0.99
#: Most decisions by which a command may be late.
LATEST = 8


@dataclass(frozen=True, slots=True)
class Randomisation:
    """Ranges of the properties of simulated robots; a range is (lowest, highest).

    Attributes:
        latency: decisions by which commands come late, drawn for each episode.
        bandwidth: of the servo that follows the commands [rad/s], drawn for each episode, log-uniform.
        velocity_noise: measured velocities are multiplied by 1 +- this, drawn for each decision.
        payload: mass at the flange that the controller does not know [kg], drawn for each robot.
        stiffness: of joint impedance [Nm/rad], drawn for each robot, log-uniform; inf: position control.

    Raises:
        LimitError: a range is empty or exceeds its bounds.
        ShapeError: something else than numbers.
    """

    _: KW_ONLY
    latency: tuple[int, int] = (0, 0)
    bandwidth: tuple[float, float] = (20.0, 20.0)
    velocity_noise: float = 0.0
    payload: tuple[float, float] = (0.0, 0.0)
    stiffness: tuple[float, float] = (inf, inf)

    def __post_init__(self) -> None:
        bounds = {
            "latency": (0, LATEST),
            "bandwidth": (1.0, 200.0),
            "payload": (0.0, 15.0),
            "stiffness": (10.0, inf),
        }
        for name, (least, most) in bounds.items():
            low, high = _range(getattr(self, name), name)
            if not least <= low <= high <= most:
                raise LimitError(
                    f"{name} must be two ascending numbers in [{least:g}, {most:g}], got ({low}, {high})",
                    code=2,
                    parameter=name,
                    value=(low, high),
                    allowed=f"[{least:g}, {most:g}]",
                )
        for end in self.latency:
            integer(end, "latency", 0, LATEST)
        if isfinite(self.stiffness[0]) != isfinite(self.stiffness[1]):
            raise LimitError(
                f"stiffness must have two finite ends or none, got {self.stiffness}",
                code=2,
                parameter="stiffness",
            )
        within(self.velocity_noise, "velocity_noise", 0.0, _NOISIEST)

    @staticmethod
    def of_arm(arm: FittedArm, *, period: float, base: Randomisation | None = None) -> Randomisation:
        """Ranges about a measured arm: two standard deviations of what is known of it.

        Args:
            arm: the fitted arm, see `heptarm.calibration.simulator`.
            period: of the decisions [s].
            base: the other ranges, and those of what the arm does not have; None: `MILD`.

        Raises:
            LimitError: a period outside its range.
        """
        instance(arm, FittedArm, "arm")
        every = within(period, "period", 0.0, 1.0, above=True, unit="s")
        found = replace(MILD if base is None else instance(base, Randomisation, "base"))
        if "state_delay" in arm:
            late = arm["state_delay"]
            ends = late.value[0] + 2.0 * np.array([-1.0, 1.0]) * np.nan_to_num(late.sigma[0])
            low, high = max(floor(ends[0] / every), 0), min(ceil(ends[1] / every), LATEST)
            found = replace(found, latency=(min(low, high), high))
        if "load" in arm:
            mass, sigma = float(arm["load"].value[0]), float(np.nan_to_num(arm["load"].sigma[0]))
            found = replace(found, payload=(max(mass - 2.0 * sigma, 0.0), mass + 2.0 * sigma))
        return found

    def of_servo(self) -> Randomisation:
        """Only what concerns the servo: latency and bandwidth."""
        return Randomisation(latency=self.latency, bandwidth=self.bandwidth)

    def draw_latency(self, random: np.random.Generator, count: int) -> npt.NDArray[np.int64]:
        """Decisions, shape (count,)."""
        return random.integers(self.latency[0], self.latency[1] + 1, count)

    def draw_bandwidth(self, random: np.random.Generator, count: int) -> Array:
        """[rad/s], shape (count,)."""
        return _logarithmic(random, self.bandwidth, count)

    def draw_payload(self, random: np.random.Generator, count: int) -> Array:
        """[kg], shape (count,)."""
        return random.uniform(*self.payload, count)

    def draw_stiffness(self, random: np.random.Generator, count: int) -> Array:
        """[Nm/rad], shape (count,)."""
        return _logarithmic(random, self.stiffness, count)

    def as_dict(self) -> dict[str, Any]:
        """For a file."""
        return asdict(self)


def _range(value: npt.ArrayLike, name: str) -> tuple[float, float]:
    ends = numbers(value, name, "two numbers")
    if ends.shape != (2,):
        raise ShapeError(f"{name} must be two numbers, got {shown(value)}", parameter=name, value=value)
    return float(ends[0]), float(ends[1])


def _logarithmic(random: np.random.Generator, bounds: tuple[float, float], count: int) -> Array:
    low, high = log(bounds[0]), log(bounds[1])
    return np.exp(random.uniform(low, high, count))


#: One known robot.
NONE = Randomisation()
#: A robot with roughly known data.
MILD = Randomisation(latency=(0, 1), bandwidth=(10.0, 40.0), velocity_noise=0.2, payload=(0.0, 1.0))
#: Enough for late networks and compliant control.
STRONG = Randomisation(latency=(0, 3), bandwidth=(5.0, 40.0), velocity_noise=0.5, payload=(0.0, 3.0))

LEVELS = {"none": NONE, "mild": MILD, "strong": STRONG}


def level(name: str) -> Randomisation:
    """The randomisation of that name.

    Raises:
        CommandRejected: it does not exist.
    """
    try:
        return LEVELS[name]
    except KeyError:
        raise CommandRejected(
            f"randomisation must be one of {', '.join(LEVELS)}, got {name!r}",
            parameter="randomisation",
            value=name,
        ) from None
