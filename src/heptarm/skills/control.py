"""Control that a short silence has cost: for programs that carry out the commands of others, one after the other."""

from __future__ import annotations

from contextlib import suppress

from heptarm.arm.verbs import ArmVerbs
from heptarm.errors import NotInControl


def keep_control(arm: ArmVerbs) -> bool:
    """Take control again if it was lost, as by a heartbeat that came late, and no other client has taken it.

    Returns:
        Whether control was taken again.

    Raises:
        ConnectionLost: the cabinet cannot be reached.
    """
    if arm.in_control or arm.controller or not arm.connected:
        return False
    with suppress(NotInControl):  # another client was faster
        arm.take_control()
        return True
    return False
