"""The groups of a state: what the cabinet samples and pushes together."""

from __future__ import annotations

from collections.abc import Sequence

from heptarm.errors import CommandRejected
from heptarm.wire import messages as wire

#: What a state contains unless something else is asked for.
GROUPS = ("joints", "torques", "pose", "wrench", "motion", "safety", "mode")


def groups_of(names: Sequence[str], offered: wire.Groups) -> wire.Groups:
    """Groups by their names.

    Raises:
        CommandRejected: one that the cabinet does not offer; the text lists them.
    """
    chosen = wire.Groups.NONE
    for name in names:
        group = wire.Groups.__members__.get(str(name).upper(), wire.Groups.NONE)
        if not group & offered:
            known = ", ".join(one.name.lower() for one in wire.Groups if one & offered and one.name)
            raise CommandRejected(
                f"no group {name!r}",
                parameter="groups",
                value=name,
                allowed=known,
                hint=f"choose from {known}",
            )
        chosen |= group
    return chosen
