"""FRI: wire formats, session, guard and policy without a socket or a clock; and the names that users need.

`Client` is for a cabinet that runs somebody else's FRI application; `Arm.fri` is for one that runs heptarm's.

::

    from heptarm.fri import Client

    with Client(30200) as client:
        client.wait("COMMANDING_ACTIVE")
        for s in client:
            client.command(q=s.q_ipo + 0.01 * np.sin(s.t))
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from heptarm.fri.limits import Limits
    from heptarm.fri.messages import CommandMode, Quality, SessionState
    from heptarm.fri.policy import Missing, Policy
    from heptarm.fri.pose_guard import PoseLimits
    from heptarm.rt import Client, Output, Params, State, Stats

__all__ = [
    "Client",
    "CommandMode",
    "Limits",
    "Missing",
    "Output",
    "Params",
    "Policy",
    "PoseLimits",
    "Quality",
    "SessionState",
    "State",
    "Stats",
]

#: Where the names live. The client has a process and a socket, which nothing else in this package may know of, so that
#: names are imported when they are used.
_HOMES = {
    "Limits": "fri.limits",
    "CommandMode": "fri.messages",
    "Quality": "fri.messages",
    "SessionState": "fri.messages",
    "Missing": "fri.policy",
    "Policy": "fri.policy",
    "PoseLimits": "fri.pose_guard",
}


def __getattr__(name: str) -> Any:
    """A public name, imported at its first use."""
    if name not in __all__:
        raise AttributeError(f"module 'heptarm.fri' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"heptarm.{_HOMES.get(name, 'rt')}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The public names."""
    return sorted(__all__)
