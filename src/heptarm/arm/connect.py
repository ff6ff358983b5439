"""The one way in: from a target to an arm."""

from __future__ import annotations

import logging
import os
import socket
from typing import Literal

from heptarm.arm.arm import Arm
from heptarm.arm.connection import Connection
from heptarm.arm.groups import GROUPS
from heptarm.arm.options import Options
from heptarm.arm.private_cabinet import PrivateCabinet
from heptarm.arm.target import parse_target, target_from_env
from heptarm.errors import ShapeError
from heptarm.io import tcp
from heptarm.io.clock import RealClock
from heptarm.io.transport import Transport
from heptarm.values.arrays import within

_log = logging.getLogger("heptarm.arm")

_LONGEST_NAME = 64


def connect(
    target: str | None = None,
    *,
    name: str | None = None,
    key: str | None = None,
    control: bool = True,
    timeout: float = 5.0,
    state_rate: float = 100.0,
    groups: tuple[str, ...] = GROUPS,
    on_disconnect: Literal["stop", "finish"] = "stop",
    watchdog: float = 0.5,
) -> Arm:
    """Connect to an arm.

    Args:
        target: "ADDRESS[:PORT]" of a cabinet; "sim://iiwa14" or "sim://iiwa7?speed=5" for a private simulator that
            ends with the arm; "sim://HOST:PORT" for a running one. None: the environment variable HEPTARM_TARGET.
        name: who is calling, shown to other clients, up to 64 octets; None: user, host and process.
        key: pre-shared key of the cabinet, if it has one.
        control: take control; otherwise observe (and stop). One client at a time controls.
        timeout: how long to wait for the connection and for the answer to each request [s].
        state_rate: states pushed per second [Hz]; 0 for none.
        groups: what a state contains: "joints", "torques", "pose", "wrench", "motion", "safety", "mode".
        on_disconnect: what the cabinet does with accepted motions when this client is lost: "stop" or "finish".
        watchdog: silence after which the cabinet counts this client as lost, [0.1, 10] s.

    Returns:
        The arm; use it in a `with` block, which leaves the arm at rest.

    Raises:
        ConnectFailed: nobody answers, or the session is refused; a wrong target shows examples.
        VersionMismatch: the two sides do not fit together.
        NotInControl: another client controls the robot; the text names it.
    """
    if on_disconnect not in ("stop", "finish"):
        raise ShapeError(
            f'on_disconnect is {on_disconnect!r}; "stop" or "finish" is wanted', parameter="on_disconnect"
        )
    if name is not None and len(name.encode()) > _LONGEST_NAME:
        raise ShapeError(
            f"name is {name!r}; at most {_LONGEST_NAME} octets are allowed", code=3, parameter="name", value=name
        )
    options = Options(
        name=name or f"{os.environ.get('USER', 'python')}@{socket.gethostname()}:{os.getpid()}",
        key=key.encode() if key else None,
        timeout=within(timeout, "timeout", 0.0, 3600.0, above=True, unit="s"),
        rate=within(state_rate, "state_rate", 0.0, 1000.0, unit="Hz"),
        groups=groups,
        finishes=on_disconnect == "finish",
        watchdog=within(watchdog, "watchdog", 0.1, 10.0, unit="s"),
    )
    chosen = parse_target(target_from_env() if target is None else target)
    private = PrivateCabinet.start(chosen) if chosen.is_private else None
    host, port = (chosen.host, chosen.port) if private is None else (private.host, private.port)

    def dial() -> Transport:
        return tcp.connect(host, port, timeout=options.timeout)

    try:
        arm = Arm(Connection(dial, options, clock=RealClock(), cabinet=private))
        try:
            arm.open(control=control)
        except BaseException:
            arm.close()
            raise
    except BaseException:
        if private is not None:
            private.close()
        raise
    _log.info("connected to %s (%s), %s", chosen, arm.robot.title, "in control" if control else "observing")
    return arm
