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
from heptarm.fri.limits import Limits
from heptarm.fri.messages import SessionState
from heptarm.fri.policy import Missing, Policy
from heptarm.fri.pose_guard import PoseLimits
from heptarm.fri.version import Version
from heptarm.io.shared import Block
from heptarm.io.udp import Address, UdpSocket
from heptarm.rt import layout as at
from heptarm.rt import realtime
from heptarm.rt.cycle import Cycle, Law
from heptarm.rt.native import BROKEN, CALL_LAW, GIVEN_BACK, LOOK, TIMEOUT, Native, Unavailable
from heptarm.rt.output import Output
from heptarm.rt.params import Params
from heptarm.rt.state import State

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
            pose_limits=PoseLimits(**config["pose_limits"]),
            policy=Policy(
                Missing(config["policy"]["missing"]), config["policy"]["patience"], config["policy"]["over"]
            ),
            law=law or _imported(config["law"]),
            params=Params(np.zeros(config["size"]), schema),
        )
        self._parent: int = config["parent"]
        self._peer: Address | None = None
        self._deadline = 0
        self._last = b""

    def run(self) -> None:
        """Answer until the user's process ends it or is gone, and the arm stands."""
        try:
            native = Native(self.cycle)
        except Unavailable as reason:
            self.cycle.record.tell(time.monotonic_ns(), f"the loop runs in pure Python: {reason}")
            self._run_in_python()
        else:
            self.layout.header[at.NATIVE] = 1
            self._run_native(native)

    def _run_native(self, native: Native) -> None:
        """The native part answers what is plain; the rest comes back to be handled here."""
        header, cycle, states = self.layout.header, self.cycle, self.layout.states
        run, send, now_ns = native.library.hf_run, native.library.hf_send, time.monotonic_ns
        memory, reference = native.memory, native.reference
        out = Output.on(memory.out_q, memory.out_tau, memory.out_wrench)
        native.listen(self.socket.sock, None)
        history = len(states.ints)
        while True:
            code = run(reference, _LOOK, native.sender)
            if code == CALL_LAW:
                cycle.ask(State(states.floats[header[at.STATES] % history]), out, memory.received)
                memory.is_ending = cycle.is_ending
                send(reference)
                code = LOOK if header[at.STOP] else CALL_LAW
            elif code == GIVEN_BACK:
                native.take()
                datagram, sender = native.datagram, native.heard
                received = memory.t_received
                if sender != self._peer and not self._accept(sender, received):
                    native.give(self._last)
                    continue
                native.listen(self.socket.sock, sender)
                octets = cycle.turn(datagram, received)
                if octets is not None:
                    self.socket.send(octets, sender)
                cycle.finish(now_ns())
                if cycle.session.sample is not None and cycle.session.received == received:
                    self._last = datagram
                if self._last:
                    native.give(self._last)
                code = LOOK if header[at.STOP] else GIVEN_BACK
            elif code == BROKEN:
                raise ConnectionLost(
                    f"UDP port {self.socket.port} fails: {os.strerror(memory.t_size).lower()}"
                )
            if code == TIMEOUT:
                cycle.idle(now_ns())
                gc.collect()
            if code in (TIMEOUT, LOOK) and (
                self._deadline or header[at.STOP] or os.getppid() != self._parent
            ):
                native.take()
                if self._is_over(now_ns()):
                    return
                if self._last:
                    native.give(self._last)

    def _run_in_python(self) -> None:
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
            if session.state is not SessionState.IDLE and now - session.received < SILENT:
                return False
            session.restart()
        self._peer = sender
        self.cycle.record.tell(now, f"listening to {sender[0]}:{sender[1]}")
        return True

    def _is_over(self, now: int) -> bool:
        """Whether the loop may end; asks the cycle to brake if it should."""
        if not self._deadline:
            if not self.layout.header[at.STOP] and os.getppid() == self._parent:
                return False
            self.cycle.end()
            self._deadline = now + round(BRAKING * 1e9)
        silent = now - self.cycle.session.received > 5 * PATIENCE * 1e9
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
        has_port = not isinstance(error, ConnectFailed) or error.parameter != "port"
        header[at.STATUS] = at.Status.FAILED if has_port else at.Status.NO_PORT
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
