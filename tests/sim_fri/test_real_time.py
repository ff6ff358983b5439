"""The stand-alone controller in its own process, in real time, with a client that knows only its port."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from heptarm.fri.protocol.version import Version, recognise
from tests.sim_fri.rig import State
from tests.sim_fri.test_udp import Peer

ROOT = Path(__file__).parents[2]
PROGRAM = """
import sys, threading
from heptarm.fri.protocol.version import Version
from heptarm.sim.fri.settings import SessionConfiguration
from heptarm.sim.fri.settings import describe
from heptarm.sim.runtime.standalone_fri import StandaloneSettings, Standalone
from tests.sim_fri.rig import Arm

client = ("127.0.0.1", int(sys.argv[1]))
settings = StandaloneSettings(configuration=SessionConfiguration(Version.V2_7, 10), client=client, port=0)
standalone = Standalone(Arm(), settings, listener=lambda event: print(describe(event)))
threading.Thread(target=lambda: (sys.stdin.read(), standalone.stop()), daemon=True).start()
standalone.run()
print("end", flush=True)
"""


def test_it_runs_until_it_is_stopped_and_sends_goodbye() -> None:
    peer = Peer(Version.V2_7)
    peer.socket.settimeout(60.0)
    command = [sys.executable, "-c", PROGRAM, str(peer.address[1])]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, cwd=ROOT) as process:
        assert process.stdin is not None and process.stdout is not None
        for _ in range(6000):  # at most a minute, also on a busy machine
            peer.turn()
            connection = peer.client.seen[-1].connection
            assert connection is not None
            if connection.state is State.COMMANDING_ACTIVE:
                break
        assert connection.state is State.COMMANDING_ACTIVE and connection.period_ms == 10
        process.stdin.close()
        while connection is not None and connection.state is not State.IDLE:
            peer.turn()
            connection = peer.client.seen[-1].connection
        said = process.stdout.read().splitlines()
        assert process.wait(60) == 0
    peer.socket.close()
    assert recognise(peer.datagram) is Version.V2_7
    assert said[0] == "session IDLE -> MONITORING_WAIT" and said[-2:] == [
        "session MONITORING_READY -> IDLE",
        "end",
    ]
    assert "session COMMANDING_WAIT -> COMMANDING_ACTIVE" in said and "overlay ended: closed" in said
