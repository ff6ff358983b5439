"""Classes that another release of Sunrise or Java has elsewhere: sources are read as if they named today's place."""

from __future__ import annotations

import re
from collections.abc import Callable, Set
from functools import cache

_MOTIONS = "com.kuka.connectivity.motionModel"
_OLD_MOTIONS = "com.kuka.roboticsAPI.motionModel"
_SMART_SERVO = (
    "SmartServo ServoMotion ServoMotionJP ISmartServoRuntime IServoRuntime IServoOnGoalReachedEvent"
)
_FRI = (
    "FRISession FRIConfiguration FRIJointOverlay FRIChannelInformation IFRISessionListener ClientCommandMode"
)

#: Former package, package of today, and the classes: of Sunrise 1.5 to 1.9, then of Java's runtime.
MOVED = (
    (_OLD_MOTIONS, f"{_MOTIONS}.smartServo", _SMART_SERVO),
    (_OLD_MOTIONS, f"{_MOTIONS}.smartServoLIN", "SmartServoLIN ISmartServoLINRuntime"),
    (_OLD_MOTIONS, f"{_MOTIONS}.directServo", "DirectServo IDirectServoRuntime"),
    ("com.kuka.connectivity.fri", "com.kuka.connectivity.fastRobotInterface", _FRI),
    (
        "com.kuka.roboticsAPI.userInterface",
        "com.kuka.connectivity.userInterface.smartServo",
        "ServoMotionUtilities",
    ),
    ("com.kuka.roboticsAPI.applicationModel.tasks", "com.kuka.task", "ITaskLogger"),
    ("sun.reflect.generics.reflectiveObjects", "heptarm.doubles.jre", "NotImplementedException"),
    ("sun.misc", "heptarm.doubles.jre", "BASE64Encoder BASE64Decoder"),
    ("com.sun.istack.internal", "heptarm.doubles.jre", "NotNull Nullable"),
)


@cache
def _by_old_name() -> dict[str, str]:
    return {f"{old}.{name}": f"{new}.{name}" for old, new, names in MOVED for name in names.split()}


@cache
def _pattern() -> re.Pattern[str]:
    names = "|".join(map(re.escape, _by_old_name()))
    packages = "|".join(sorted({re.escape(old) for old, _, _ in MOVED}))
    return re.compile(rf"(?P<wild>\bimport\s+(?P<package>{packages})\.\*\s*;)|(?P<name>\b(?:{names})\b)")


def renamed(text: str, own: Set[str], without_comments: Callable[[str], str]) -> str:
    """A source with the names of today; every line keeps its number.

    Args:
        text: of the source.
        own: full names of the project's classes, which stay.
        without_comments: removes comments.
    """
    if not any(old in text for old, _, _ in MOVED):
        return text
    used = frozenset(re.findall(r"\w+", without_comments(text)))

    def replaced(match: re.Match[str]) -> str:
        if match["name"]:
            return match[0] if match[0] in own else _by_old_name()[match[0]]
        found = {
            name: new
            for old, new, names in MOVED
            if old == match["package"]
            for name in names.split()
            if name in used and f"{old}.{name}" not in own
        }
        return " ".join([match[0], *(f"import {new}.{name};" for name, new in found.items())])

    return _pattern().sub(replaced, text)
