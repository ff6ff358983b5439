"""Control a KUKA LBR iiwa from Python, with or without a robot on the desk.

::

    import heptarm as ha

    with ha.connect("sim://iiwa14") as arm:
        arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)))
"""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

import lazy_loader

__version__ = "0.1.0"

# Names are imported at their first use, so that `import heptarm` is quick; __init__.pyi lists them.
_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    """A public name at its first use; a module or a mistyped name is told apart in the error."""
    try:
        return _load(name)
    except AttributeError as error:
        from difflib import get_close_matches

        text = f"heptarm has no attribute {name!r}"
        if not name.startswith("_") and find_spec(f"{__name__}.{name}") is not None:
            text += f"; it is a module: from heptarm import {name}"
        elif near := get_close_matches(name, __all__, n=1):
            text += f"; did you mean {near[0]!r}?"
        raise AttributeError(text, name=name, obj=error.obj) from None
