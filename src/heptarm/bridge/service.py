"""What all services of the nodes share: a row of their table, what they work with, and their answers."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from heptarm.bridge.driver import Driver
from heptarm.bridge.messages import put
from heptarm.errors import NotReady, Timeout

#: How long a motion may take to end of itself before something that it stands in the way of [s].
_PATIENCE = 2.0


@dataclass(frozen=True, slots=True)
class Answer:
    """What a service answers.

    Attributes:
        success: whether it was done.
        message: what was done, or why not.
    """

    success: bool
    message: str


@dataclass(frozen=True, slots=True)
class Told(Answer):
    """An answer with more than words.

    Attributes:
        fields: further fields of the response; those of messages are mappings.
    """

    fields: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Service:
    """A service of the nodes.

    Attributes:
        name: as in ROS 2, "~/" for the node's own.
        type: "package/Type"; its answers have `success` and `message`, and the fields of `Told`.
        work: what to do, of an instance of the class that the nodes offer; a text is a success.
        at_once: it never waits behind another one.
    """

    name: str
    type: str
    work: Callable[[Any, Any], Answer | str]
    at_once: bool = False


class Offer:
    """What services work with.

    Args:
        driver: whose arm it is.
    """

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        self._arm = driver.arm
        self._mode = contextlib.ExitStack()

    def _check_active(self) -> None:
        if not self._driver.active:
            raise NotReady("the node is not active", hint="activate it")

    def _rest(self) -> None:
        """Wait until no motion runs; a servo motion ends a moment after its last target.

        Raises:
            NotReady: the node is not active, or a motion runs on.
        """
        self._check_active()
        try:
            self._arm.wait_until(lambda state: not state.motion or not state.motion.active, timeout=_PATIENCE)
        except Timeout:
            raise NotReady("a motion is under way", hint="stop it first") from None


def fill(response: Any, answer: Answer) -> Any:
    """A response with what an answer says; None: no success, and nowhere to say so, as in a type of ROS 1's own."""
    fields: dict[str, Any] = {"success": answer.success, "message": answer.message}
    if not hasattr(response, "success"):
        if not answer.success:
            return None
        fields = {}
    if isinstance(answer, Told):
        fields.update(answer.fields)
    put(response, fields)
    return response


def scalar(values: Sequence[float], default: Any) -> Any:
    """One number as a number, several as a list, none as the default."""
    given = [float(value) for value in values]
    return given[0] if len(given) == 1 else given or default


def names(found: Sequence[str]) -> Told:
    """An answer with a list of names."""
    return Told(True, ", ".join(found) or "none", {"names": list(found)})
