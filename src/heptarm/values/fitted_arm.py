"""What was identified of one arm, in a file that a person can read: friction, stiffness, errors of its sensors.

The file is TOML, one table per quantity, each with its standard deviation, its source and its date::

    robot = "iiwa14"

    [coulomb]                    # Coulomb friction of A1 to A7 [Nm]
    value = [0.48, 0.51, 0.25, 0.26, 0.17, 0.06, 0.06]
    sigma = [0.01, 0.01, 0.01, 0.01, 0.01, 0.01, 0.01]
    source = "excitation.mcap: 598 s"
    date = "2026-11-28T11:20:00+00:00"

A quantity that the file lacks is left as the virtual cabinet assumes it. `[[contradictions]]` has what the same arm did
that these numbers do not explain, and what a commissioning run found to differ.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from heptarm.errors import CommandRejected, LimitError
from heptarm.values.checks import Array, Value, array, choice, frozen, instance, within, word
from heptarm.values.files import path_of, read_text, refuse_existing, unwritable
from heptarm.values.robot import Body, Friction, RobotModel, robot
from heptarm.values.text import lines

try:
    import tomllib
except ModuleNotFoundError:  # Python 3.10
    import tomli as tomllib  # type: ignore[no-redef]

_AXES = 7
_WHAT, _HINT = "a fitted arm", "`heptarm calibrate arm RUN.mcap --save FILE` writes one"
_KEYS = ("value", "sigma", "source", "date")
#: The table of remarks of a file, and its texts.
_CONTRADICTIONS, _TEXT = "contradictions", "text"


@dataclass(frozen=True, slots=True)
class Quantity:
    """A quantity that can be identified.

    Attributes:
        title: in the words of the field.
        unit: SI; empty: a fraction.
        low: least value.
        high: largest one.
        size: how many numbers it has: one for each axis, or a single one.
    """

    title: str
    unit: str
    low: float
    high: float
    size: int = _AXES


#: All quantities by their names in the file. A load is its mass [kg], its first moments [kg m], and its inertia about
#: the flange xx yy zz xy xz yz [kg m²].
QUANTITIES: dict[str, Quantity] = {
    "coulomb": Quantity("Coulomb friction", "Nm", 0.0, 100.0),
    "breakaway": Quantity("breakaway friction", "Nm", 0.0, 100.0),
    "viscous": Quantity("viscous friction", "Nm s/rad", 0.0, 100.0),
    "asymmetry": Quantity("friction of the positive direction beyond the mean", "Nm", -100.0, 100.0),
    "transition": Quantity("speed of the transition of Coulomb friction", "rad/s", 1e-4, 1.0, 1),
    "stribeck": Quantity("speed at which breakaway friction fades", "rad/s", 1e-4, 1.0, 1),
    "stiffness": Quantity("stiffness in position control", "Nm/rad", 500.0, 45000.0),
    "rotor": Quantity("inertia of the rotors", "kg m²", 0.02, 10.0),
    "torque_offset": Quantity("offset of the torque sensors", "Nm", -50.0, 50.0),
    "torque_gain": Quantity("error of gain of the torque sensors", "", -0.2, 0.2),
    "torque_noise": Quantity("noise of the torque sensors", "Nm", 0.0, 10.0),
    "position_noise": Quantity("noise of the measured positions", "rad", 0.0, 0.01),
    "state_delay": Quantity("delay of the measured states", "s", 0.0, 0.05, 1),
    "fri_command_delay": Quantity("delay of FRI commands, beyond their interpolation", "s", 0.0, 0.1, 1),
    "load": Quantity("load that the load data lacked", "kg, kg m, kg m²", -50.0, 50.0, 10),
}


@dataclass(frozen=True, slots=True, eq=False)
class FittedNumbers(Value):
    """One quantity of an arm.

    Attributes:
        name: of `QUANTITIES`.
        value: shape (n,) with the size of the quantity.
        sigma: standard deviations, shape (n,); NaN: unknown.
        source: where it comes from, such as a recording.
        date: when it was measured, ISO 8601.

    Raises:
        CommandRejected: there is no quantity of that name.
        ShapeError: wrong shapes.
        LimitError: a value outside its range.
    """

    name: str
    value: Array
    sigma: Array
    source: str = ""
    date: str = ""

    def __post_init__(self) -> None:
        kind = QUANTITIES[word(self.name, "name", tuple(QUANTITIES))]
        values = array(self.value, kind.size, self.name)
        for index, value in enumerate(values.tolist()):
            within(value, f"{self.name}[{index}]", kind.low, kind.high, unit=kind.unit)
        object.__setattr__(self, "value", values)
        sigma = array(self.sigma, kind.size, f"sigma of {self.name}", nan=True)
        if (sigma < 0.0).any():
            raise LimitError(
                f"sigma of {self.name} must not be negative, got {float(np.nanmin(sigma)):g} {kind.unit}",
                code=2,
                parameter="sigma",
            )
        object.__setattr__(self, "sigma", sigma)
        for text in ("source", "date"):
            instance(getattr(self, text), str, text)

    def __str__(self) -> str:
        """Values with their standard deviations and the unit."""
        kind = QUANTITIES[self.name]
        pairs = zip(self.value.tolist(), self.sigma.tolist(), strict=True)
        texts = [f"{value:.4g}" + ("" if np.isnan(sigma) else f" ± {sigma:.1g}") for value, sigma in pairs]
        return f"{'  '.join(texts)} {kind.unit}".rstrip()

    @property
    def toml(self) -> str:
        """Its table in the file."""
        kind = QUANTITIES[self.name]
        of = " of A1 to A7" if kind.size == _AXES else ""
        sigma = ", ".join("nan" if np.isnan(value) else f"{value:.3g}" for value in self.sigma)
        return (
            f"[{self.name}]  # {kind.title}{of}{f' [{kind.unit}]' if kind.unit else ', a fraction'}\n"
            f"value = [{', '.join(f'{value:.9g}' for value in self.value)}]\n"
            f"sigma = [{sigma}]\n"
            f"source = {json.dumps(self.source)}\n"
            f"date = {json.dumps(self.date)}\n"
        )


@dataclass(frozen=True, slots=True, eq=False)
class FittedArm(Value):
    """An arm as it was measured: `sim://iiwa14?fitted=FILE` behaves like it.

    Attributes:
        robot: name of the robot with the flange with which it was recorded, such as "iiwa14" or "iiwa14+touch".
        numbers: the quantities that are known; of each name at most one.
        contradictions: what the arm did that these numbers do not explain, in sentences.

    Raises:
        CommandRejected: no such robot, or a quantity is there twice.
    """

    robot: str
    numbers: tuple[FittedNumbers, ...] = ()
    contradictions: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        robot(self.robot)
        names = [instance(numbers, FittedNumbers, "numbers").name for numbers in self.numbers]
        double = sorted({name for name in names if names.count(name) > 1})
        if double:
            raise CommandRejected(f"{double[0]} must be there once, got it twice", parameter="numbers")
        for text in self.contradictions:
            instance(text, str, "contradictions")

    def __contains__(self, name: object) -> bool:
        """Whether a quantity is known."""
        return any(numbers.name == name for numbers in self.numbers)

    def __getitem__(self, name: str) -> FittedNumbers:
        """A quantity.

        Raises:
            CommandRejected: it is not known; the text lists those that are.
        """
        return choice(name, "name", {numbers.name: numbers for numbers in self.numbers})

    def value(self, name: str, otherwise: Array | float) -> Array:
        """The values of a quantity; `otherwise` where it is not known."""
        if name in self:
            return self[name].value
        return frozen(np.broadcast_to(otherwise, QUANTITIES[name].size).copy())

    @property
    def model(self) -> RobotModel:
        """The robot."""
        return robot(self.robot)

    @property
    def friction(self) -> Friction | None:
        """Friction of the joints; None: it is not known."""
        if "coulomb" not in self:
            return None
        known = {name: float(self[name].value[0]) for name in ("transition", "stribeck") if name in self}
        coulomb = self["coulomb"].value
        return Friction(
            self.value("viscous", 0.0),
            coulomb,
            breakaway=self.value("breakaway", coulomb),
            asymmetry=self.value("asymmetry", 0.0),
            **known,
        )

    @property
    def load(self) -> Body | None:
        """Load on the flange that the load data lacked; None: none was found."""
        if "load" not in self:
            return None
        mass, moment, about = np.split(self["load"].value, [1, 4])
        com = moment / mass[0]
        shift = mass[0] * (float(com @ com) * np.eye(3) - np.outer(com, com))
        return Body(float(mass[0]), com, inertia=about - shift[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])

    def with_numbers(self, numbers: Iterable[FittedNumbers]) -> FittedArm:
        """The arm with other values of some quantities; those of the other names stay."""
        given = {numbers.name: numbers for numbers in numbers}
        kept = {numbers.name: numbers for numbers in self.numbers}
        return replace(self, numbers=tuple((kept | given).values()))

    def __str__(self) -> str:
        """All quantities with their standard deviations, and what they do not explain."""
        rows = {numbers.name: str(numbers) for numbers in self.numbers}
        known = lines(f"Fitted {self.model.title}", rows)
        return "\n".join([known, *(f"  contradicted: {text}" for text in self.contradictions)])

    @property
    def toml(self) -> str:
        """The file's content."""
        parts = [f"robot = {json.dumps(self.robot)}\n", *(numbers.toml for numbers in self.numbers)]
        for text in self.contradictions:
            parts.append(f"[[{_CONTRADICTIONS}]]\n{_TEXT} = {json.dumps(text, ensure_ascii=False)}\n")
        return "\n".join(parts)

    def save(self, path: str | Path, *, overwrite: bool = False) -> None:
        """Write the file.

        Args:
            path: the file.
            overwrite: replace one that exists.

        Raises:
            CommandRejected: it exists, or cannot be written.
        """
        file = refuse_existing(path_of(path), overwrite=overwrite)
        try:
            file.write_text(self.toml, encoding="utf-8")
        except OSError as error:
            raise unwritable(file, error) from None


def load_fitted(path: str | Path) -> FittedArm:
    """Read the file of a fitted arm.

    Raises:
        CommandRejected: it cannot be read, or is not such a file; the text names the entry.
        ShapeError: a quantity has another size.
        LimitError: a value outside its range.
    """
    file = path_of(path)
    try:
        tables = tomllib.loads(read_text(file))
    except (ValueError, RecursionError) as error:
        if isinstance(error, CommandRejected):
            raise
        raise _bad(file, f"it is not TOML: {error}") from None
    named = tables.pop("robot", None)
    remarks = tables.pop(_CONTRADICTIONS, [])
    if not isinstance(named, str):
        raise _bad(file, "it names no robot")
    if not isinstance(remarks, list) or not all(
        isinstance(remark, Mapping) and isinstance(remark.get(_TEXT), str) for remark in remarks
    ):
        raise _bad(file, f"[[{_CONTRADICTIONS}]] must have a {_TEXT} each")
    numbers = tuple(_numbers(file, name, table) for name, table in tables.items())
    fitted = FittedArm(named, numbers, tuple(remark[_TEXT] for remark in remarks))
    fitted.friction, fitted.load  # noqa: B018  # one that no body has is refused here
    return fitted


def _bad(file: Path, why: str) -> CommandRejected:
    return CommandRejected(f"{file} is not {_WHAT}: {why}", parameter="path", value=str(file), hint=_HINT)


def _numbers(file: Path, name: str, table: Any) -> FittedNumbers:
    if name not in QUANTITIES or not isinstance(table, Mapping):
        raise _bad(file, f"{name} must be a table of one of {', '.join(QUANTITIES)}")
    unknown = [key for key in table if key not in _KEYS]
    if unknown or "value" not in table:
        raise _bad(
            file, f"[{name}] must have value and may have {', '.join(_KEYS[1:])}, got {', '.join(table)}"
        )
    texts = {key: table[key] for key in ("source", "date") if key in table}
    size = QUANTITIES[name].size
    sigma = table.get("sigma", [float("nan")] * size)
    return FittedNumbers(name, table["value"], sigma, **{key: str(text) for key, text in texts.items()})
