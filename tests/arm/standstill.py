"""A client in a process that the system stops for a while, in front of a cabinet that sends nothing in that time."""

from __future__ import annotations

import signal
import subprocess
import time
from collections.abc import Sequence

from heptarm.io.tcp import listening
from tests.arm.peer import Peer

#: Longer than the silence that a client allows, one second [s].
STANDSTILL = 2.5
#: Time from the end of the standstill until the cabinet speaks again [s].
AFTER = 0.3


def stand_still(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Run a client that prints "ready" when it has states and waits for a line; its output and its exit code.

    Client and cabinet stand still together, as when their machine does, and the client runs again first.
    """
    cabinet = Peer()
    with listening() as listener:
        client = subprocess.Popen(
            [*command, f"127.0.0.1:{listener.port}"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            served = cabinet.serve(listener.accept(timeout=60.0))
            assert client.stdout is not None
            assert client.stdout.readline() == "ready\n"
            served.is_mute = True
            client.send_signal(signal.SIGSTOP)
            time.sleep(STANDSTILL)
            client.send_signal(signal.SIGCONT)
            time.sleep(AFTER)
            served.is_mute = False
            said, complained = client.communicate("go on\n", timeout=60.0)
            return subprocess.CompletedProcess(command, client.returncode, said, complained)
        finally:
            client.kill()
            client.wait()
            cabinet.close()
