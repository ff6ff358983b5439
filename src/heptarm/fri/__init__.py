"""FRI client: wire formats, session, guards and the realtime loop.

`Client` connects to a cabinet that runs any other FRI application; use `Arm.fri` where heptarm's own runs.

::

    from heptarm.fri import Client

    with Client(30200) as client:
        client.wait("COMMANDING_ACTIVE")
        for s in client:
            client.command(q=s.q_ipo + 0.01 * np.sin(s.t))
"""

from __future__ import annotations

import lazy_loader

# lazy: the protocol can be imported without the process and the socket of the client
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
