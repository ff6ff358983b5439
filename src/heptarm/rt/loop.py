"""The process of the loop: waits for the controller's datagrams and answers them, whatever the user's process does."""

from __future__ import annotations

import gc
import importlib
import json
import os
import signal
import sys
import time
from typing import Any

import numpy as np

from heptarm.errors import ConnectFailed, ConnectionLost
from heptarm.fri.guard import Limits
from heptarm.fri.messages import SessionState
from heptarm.fri.policy import Missing, Policy
from heptarm.fri.version import Version
from heptarm.io.shared import Block
from heptarm.io.udp import Address, UdpSocket
from heptarm.rt import layout as at
from heptarm.rt import realtime
from heptarm.rt.cycle import Cycle, Law
from heptarm.rt.state import Params

#: A datagram is waited for this long before the loop looks around [s].
PATIENCE = 0.05
#: Another sender is listened to when the one before has been silent for this long [ns].
SILENT = 1_000_000_000
#: An end that is asked for waits this long for the arm to stand [s].
BRAKING = 3.0
#: The user's process is looked for every that many datagrams.
_LOOK = 256


class Loop:
    """Socket, turn, shared memory.

    Args:
        layout: the shared memory.
        config: as `heptarm.rt.client` leaves it.
        law: overrides the one that the configuration names.
    """

    def __init__(self, layout: at.Layout, config: dict[str, Any], *, law: Law | None = None) -> None:
        self.layout, self.config = layout, config
        self.socket = UdpSocket(config["port"], host=config["host"], patience=PATIENCE)
        layout.header[at.PORT] = self.socket.port
        schema = {name: (tuple(shape), start) for name, (shape, start) in config["params"].items()}
        version = config["version"]
        self.cycle = Cycle(
            layout,
            version=None if version is None else Version(version),
            limits=_limits(config["limits"]),
            policy=Policy(
                Missing(config["policy"]["missing"]), config["policy"]["patience"], config["policy"]["over"]
            ),
            law=law or _imported(config["law"]),
            params=Params(np.zeros(config["size"]), schema),
        )
        self._parent: int = config["parent"]
        self._peer: Address | None = None
        self._heard = 0
        self._deadline = 0

    def run(self) -> None:
        """Answer until the user's process ends it or is gone, and the arm stands."""
        header, cycle, receive, send = self.layout.header, self.cycle, self.socket.receive, self.socket.send
        now_ns, turns = time.monotonic_ns, 0
        while True:
            got = receive()
            if got is None:
                now = now_ns()
                cycle.idle(now)
                gc.collect()
                if self._is_over(now):
                    return
                continue
            datagram, received, sender = got
            if sender != self._peer and not self._accept(sender, received):
                continue
            self._heard = received
            octets = cycle.turn(datagram, received)
            if octets is not None:
                send(octets, sender)
            now = now_ns()
            cycle.finish(now)
            turns += 1
            if (header[at.STOP] or turns % _LOOK == 0) and self._is_over(now):
                return

    def _accept(self, sender: Address, now: int) -> bool:
        """Whether to listen to another sender: only when the one before has ended or fallen silent."""
        remote = self.config["remote"]
        if remote is not None and sender[0] != remote:
            return False
        session = self.cycle.session
        if self._peer is not None:
            if session.state is not SessionState.IDLE and now - self._heard < SILENT:
                return False
            session.restart()
        self._peer = sender
        self.cycle.tell(now, f"listening to {sender[0]}:{sender[1]}")
        return True

    def _is_over(self, now: int) -> bool:
        """Whether the loop may end; asks the cycle to brake if it should."""
        if not self._deadline:
            if not self.layout.header[at.STOP] and os.getppid() == self._parent:
                return False
            self.cycle.end()
            self._deadline = now + round(BRAKING * 1e9)
        silent = now - self._heard > 5 * PATIENCE * 1e9
        return self.cycle.may_end or silent or now > self._deadline

    def close(self) -> None:
        """Give the port back."""
        self.socket.close()


def _imported(name: str | None) -> Law | None:
    """The law "module:function"."""
    if name is None:
        return None
    module, _, function = name.partition(":")
    found: Any = importlib.import_module(module)
    for part in function.split("."):
        found = getattr(found, part)
    law: Law = found
    return law


def _limits(plain: dict[str, Any]) -> Limits:
    made: dict[str, Any] = {name: tuple(v) if isinstance(v, list) else v for name, v in plain.items()}
    return Limits(**made)


def main(path: str, law: Law | None = None) -> int:
    """Run a loop.

    Args:
        path: of the shared memory, whose configuration is already written.
        law: for a forked process; a fresh one imports what the configuration names.
    """
    block = Block(path=path)
    header = block.view(0, at.LATENCY)

    def stop(number: int, frame: object) -> None:
        header[at.STOP] = 1

    signal.signal(signal.SIGTERM, stop)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the user's process, which then ends this one
    first = at.Layout(block, history=header[at.HISTORY], params=header[at.SIZE])
    config = json.loads(first.config.read() or "{}")
    header[at.PID] = os.getpid()
    try:
        loop = Loop(first, config, law=law)
    except (ConnectFailed, ImportError, AttributeError) as error:
        first.trouble.write(str(error))
        header[at.STATUS] = at.Status.FAILED
        return 1
    refused = realtime.ask(cpu=config["cpu"], lock=config["lock"]) if config["realtime"] else []
    first.refused.write("\n".join(refused))
    header[at.STATUS] = at.Status.RUNNING
    try:
        loop.run()
    except ConnectionLost as error:
        first.trouble.write(str(error))
        header[at.STATUS] = at.Status.FAILED
        return 1
    finally:
        loop.close()
    header[at.STATUS] = at.Status.ENDED
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
