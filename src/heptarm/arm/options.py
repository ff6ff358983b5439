"""How to talk to the cabinet."""

from __future__ import annotations

from dataclasses import dataclass

from heptarm.arm.groups import GROUPS


@dataclass(frozen=True, slots=True)
class Options:
    """Options of a connection; see `connect`.

    Attributes:
        name: what others see of this client.
        key: pre-shared key.
        timeout: how long an answer may take [s].
        rate: states per second [Hz]; 0: none.
        groups: what a state contains.
        finishes: what runs goes on to its end when the connection is lost, instead of stopping.
        watchdog: the cabinet counts this client as lost after so much silence [s].
    """

    name: str = "heptarm"
    key: bytes | None = None
    timeout: float = 5.0
    rate: float = 100.0
    groups: tuple[str, ...] = GROUPS
    finishes: bool = False
    watchdog: float = 0.5
