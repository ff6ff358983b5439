"""Steps: what only a program on the cabinet sees, from the file that `examples/sunrise/probe` has written there.

The application SunriseProbe moves nothing. It looks at KUKA's classes by reflection, measures a few calls, and writes
lines of the form `key = value`.
"""

from __future__ import annotations

import re
from pathlib import Path

from heptarm.arm.arm import Arm
from heptarm.errors import CommandRejected
from heptarm.testing.commissioning.person import Person
from heptarm.testing.commissioning.step import Comparison, at_most, same, step
from heptarm.testing.measure import Unfit
from heptarm.values.files import read_text

#: Names in the station setup, as public projects show them.
_DEVICE = r"LBR_(iiwa|Med)_(7_R800|14_R820)_\d+"
#: Guessed signatures and constants, as the virtual cabinet has them; the keys are those of SunriseProbe.
GUESSES = {
    "IORangeCondition": "(AbstractIO, double, double)",
    "CartSineImpBuilder": "CartesianSineImpedanceControlMode$CartSineImpBuilder",
}


def _facts(person: Person) -> dict[str, str]:
    """What the probe has written.

    Raises:
        Unfit: it has not run, or its file cannot be read.
    """
    name = person.reads("Path of the file that the application SunriseProbe has written")
    if not name:
        raise Unfit("SunriseProbe has not run on this cabinet; see examples/sunrise/probe")
    try:
        text = read_text(Path(name).expanduser())
    except CommandRejected as error:
        raise Unfit(f"the file of SunriseProbe: {error.text}") from None
    found = dict(re.findall(r"^([\w.]+) = (.*?)\s*$", text, re.MULTILINE))
    if "probe" not in found:
        raise Unfit(f"{name} is no file of SunriseProbe: the line `probe = ...` is missing")
    return found


def _number(facts: dict[str, str], key: str) -> float:
    try:
        return float(facts[key])
    except (KeyError, ValueError):
        raise Unfit(f"SunriseProbe has not measured {key}: {facts.get(key, 'no such line')}") from None


@step()
def names(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Have the guessed constructors, constants and nested classes of Sunrise these names?"""
    facts = _facts(person)
    found = [same(key, facts.get(key, "missing"), expected) for key, expected in GUESSES.items()]
    missing = facts.get("missing", "not looked for")
    return (*found, same("members that the virtual cabinet offers and Sunrise lacks", missing, "none"))


@step()
def device(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Has the robot a name of the known form?"""
    name = _facts(person).get("device", "")
    expected = name if re.fullmatch(_DEVICE, name) else "LBR_iiwa_14_R820_1 and alike"
    return (same("name of the robot in the station setup", name, expected),)


@step()
def hold_zero(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Does a PositionHold of no length end at once?"""
    return (at_most("a PositionHold of 0 s lasts", _number(_facts(person), "hold_zero_ms"), 100.0, "ms"),)


@step()
def reading(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Does reading the state cost as little time as assumed?"""
    facts = _facts(person)
    return tuple(
        at_most(f"a call of {what} takes", _number(facts, key), 5.0, "ms")
        for what, key in (
            ("getCurrentJointPosition", "read_joints_ms"),
            ("getExternalForceTorque", "read_force_ms"),
        )
    )
