"""The FRI loop in a process of its own, and the client that talks to it through shared memory.

::

    from heptarm.rt import Client

    with Client(30200) as client:
        for s in client:
            client.command(q=s.q_ipo + 0.01 * np.sin(s.t))
"""

from heptarm.rt.client import Client, Stats
from heptarm.rt.state import Output, Params, State

__all__ = ["Client", "Output", "Params", "State", "Stats"]
