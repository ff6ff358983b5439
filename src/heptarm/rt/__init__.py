"""The FRI loop in a process of its own, and the client that talks to it through shared memory.

::

    from heptarm.rt import Client

    with Client(30200) as client:
        for s in client:
            client.command(q=s.q_ipo + 0.01 * np.sin(s.t))
"""

from heptarm.rt.client import Client
from heptarm.rt.output import Output
from heptarm.rt.params import Params
from heptarm.rt.state import State
from heptarm.rt.stats import Stats

__all__ = ["Client", "Output", "Params", "State", "Stats"]
