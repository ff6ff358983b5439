"""Result of the Python codec for a body, in the format of the Java program."""

from __future__ import annotations

from heptarm.wire.codec import DecodeError, Violation
from heptarm.wire.messages import MESSAGES, Message


def verdict(message: Message) -> str:
    """ok, or code and path of the first violation."""
    try:
        message.validate()
    except Violation as violation:
        return f"{violation.code}:{violation.parameter}"
    return "ok"


def recoded(number: int, body: bytes) -> str:
    """The body encoded again and validated, or "undecodable", or "unknown"."""
    if number not in MESSAGES:
        return "unknown"
    try:
        message = MESSAGES[number].decode(body)
    except DecodeError:
        return "undecodable"
    return f"{message.encode().hex()} {verdict(message)}"
