"""The floor of a reply: what this machine needs to send a datagram back, measured with a bare echo in C.

The echo is a process with the priority of a loop and measures as the loop does, from the kernel's time of receipt until
the reply is sent; it only does nothing in between.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
import sys
import time

import numpy as np

from heptarm.errors import ConnectFailed, system_errors
from heptarm.fri.loop.native import library
from heptarm.fri.loop.process import request_realtime
from heptarm.io.udp import UdpSocket
from heptarm.values.checks import Array

_HERE = "127.0.0.1"
#: Longest wait for the next datagram, after which the echo ends [s].
_PATIENCE = 2.0
#: Size of a monitoring message [bytes].
_SIZE = 469
#: The first replies do not count: processor and caches are not awake yet.
_WARM_UP = 20


def floor(seconds: float, *, period: float, cpu: int | None = None) -> Array:
    """Measure the echo.

    Args:
        seconds: how long.
        period: time between two datagrams [s].
        cpu: processor of the echo; None for any.

    Returns:
        Time from receipt to reply of each datagram, shape (n,) [s].

    Raises:
        Unavailable: the compiled part is missing.
        ConnectFailed: the echo did not start.
    """
    library()  # loaded here, so that its error is raised here
    count = max(1, round(seconds / period)) + _WARM_UP
    folders = os.pathsep.join(entry or os.getcwd() for entry in sys.path)
    command = [sys.executable, "-m", "heptarm.fri.loop.echo", str(count), "" if cpu is None else str(cpu)]
    environment = {**os.environ, "PYTHONPATH": folders}
    with system_errors("the echo cannot be started", kind=ConnectFailed):
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    with process as echo:
        assert echo.stdout is not None
        port = echo.stdout.readline().strip()
        if not port:
            raise ConnectFailed("the echo did not start")
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.connect((_HERE, int(port)))
            due = time.monotonic()
            for _ in range(count):
                with contextlib.suppress(
                    ConnectionRefusedError
                ):  # it has ended after a long pause of this process
                    sender.send(bytes(_SIZE))
                due += period
                time.sleep(max(0.0, due - time.monotonic()))
        took: list[int] = json.loads(echo.stdout.read())
    return np.array(took[_WARM_UP:]) * 1e-9


def main(count: int, cpu: int | None) -> None:
    """Run the echo: write its port, then the times of its replies [ns]."""
    request_realtime(cpu=cpu)
    took = np.zeros(count, dtype=np.int64)
    sock = UdpSocket(0, host=_HERE, patience=_PATIENCE)
    sys.stdout.write(f"{sock.port}\n")
    sys.stdout.flush()
    found = library().fri_echo(sock.sock.fileno(), count, took.ctypes.data)
    sys.stdout.write(json.dumps(took[:found].tolist()))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]) if sys.argv[2] else None)
