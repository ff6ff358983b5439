"""All states of a session and all ways between them, as data. The file does not know which side we are."""

from __future__ import annotations

import enum

from heptarm.wire.messages import Message


class SessionState(enum.Enum):
    """Where a session is; both sides pass through the same states."""

    START = "start"  # connected, nothing said
    HELLO = "hello"  # the client has said who it is
    CHALLENGED = "challenged"  # the cabinet wants a proof of the key
    PROVED = "proved"  # the client has sent its proof
    OPEN = "open"  # the session stands
    CLOSED = "closed"  # nothing more may be sent; what comes is ignored


_S = SessionState

#: State, then what is sent or received, then the new state. Handshake messages and Goodbye stand under
#: their names, all others under their kinds. What is missing is illegal.
TRANSITIONS: dict[SessionState, dict[str, SessionState]] = {
    _S.START: {"Hello": _S.HELLO, "Refusal": _S.CLOSED, "Goodbye": _S.CLOSED},
    _S.HELLO: {
        "Challenge": _S.CHALLENGED,
        "Welcome": _S.OPEN,
        "Refusal": _S.CLOSED,
        "Goodbye": _S.CLOSED,
    },
    _S.CHALLENGED: {"Proof": _S.PROVED, "Refusal": _S.CLOSED, "Goodbye": _S.CLOSED},
    _S.PROVED: {"Welcome": _S.OPEN, "Refusal": _S.CLOSED, "Goodbye": _S.CLOSED},
    _S.OPEN: {
        "request": _S.OPEN,
        "answer": _S.OPEN,
        "oneway": _S.OPEN,
        "event": _S.OPEN,
        "state": _S.OPEN,
        "link": _S.OPEN,
        "Goodbye": _S.CLOSED,
    },
    _S.CLOSED: {},
}


def symbol(kind: type[Message]) -> str:
    """The name under which a message stands in the table."""
    if kind.KIND == "handshake" or kind.__name__ == "Goodbye":
        return kind.__name__
    return kind.KIND


def markdown() -> str:
    """The table for people; docs/reference/session.md holds it, and a test compares them."""
    names = [name for row in TRANSITIONS.values() for name in row]
    columns = list(dict.fromkeys(names))
    lines = [
        f"| in state | {' | '.join(columns)} |",
        f"|---|{'---|' * len(columns)}",
    ]
    for state, row in TRANSITIONS.items():
        cells = (row[name].value if name in row else "" for name in columns)
        lines.append(f"| **{state.value}** | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"
