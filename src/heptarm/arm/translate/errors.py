"""From the codes of the protocol to errors."""

from __future__ import annotations

from heptarm import errors
from heptarm.errors import CommandRejected, HeptarmError, NeedsOperator, without_java
from heptarm.wire.codes import MEANINGS
from heptarm.wire.messages import Goodbye, Refusal, Rejected


def error_of(
    code: int, text: str, *, parameter: str = "", value: str = "", allowed: str = ""
) -> HeptarmError:
    """The error of a code, with the cabinet's text and the remedy from the table of codes."""
    meaning = MEANINGS.get(code)
    kind: type[HeptarmError] = CommandRejected if meaning is None else getattr(errors, meaning.error)
    what = without_java(text) or (meaning.title if meaning is not None else f"refused with code {code}")
    if parameter and value and value not in what:
        what += f": {parameter} is {value}"
    if allowed and allowed not in what:
        what += f"; allowed is {allowed}"
    # the operator's steps are in the cabinet's text: a general hint would hide them
    hint = "" if meaning is None or issubclass(kind, NeedsOperator) else meaning.advice
    return kind(what, code=code, parameter=parameter, value=value, allowed=allowed, hint=hint)


def rejection(message: Rejected) -> HeptarmError:
    """The error of a rejected request."""
    return error_of(
        message.code,
        message.text,
        parameter=message.parameter,
        value=message.value,
        allowed=message.allowed,
    )


def refusal(message: Refusal, *, major: int, minor: int) -> HeptarmError:
    """The error of a refused session; if the versions differ, it names both."""
    text = message.text
    if message.major != major:
        text = (
            f"{text or 'the versions differ'}: the cabinet speaks protocol {message.major}.{message.minor}, "
            f"this side {major}.{minor}"
        )
    return error_of(message.code, text)


def farewell(message: Goodbye, peer: str) -> errors.ConnectionLost:
    """The error of a session that the cabinet ended."""
    meaning = MEANINGS.get(message.code)
    text = message.text or (meaning.title if meaning is not None else "no reason given")
    return errors.ConnectionLost(
        f"the cabinet at {peer} ended the session: {text}",
        code=message.code,
        hint=meaning.advice if meaning is not None else "",
    )
