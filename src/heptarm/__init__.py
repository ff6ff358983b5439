"""Control a KUKA LBR iiwa from Python, with or without a robot on the desk.

::

    import heptarm as ha

    with ha.connect("sim://iiwa14") as arm:
        arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)))
"""

from __future__ import annotations

import lazy_loader

__version__ = "0.1.0"

# Names are imported at their first use, so that `import heptarm` is quick; __init__.pyi lists them.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
