"""The service that puts a collision guard in force and takes it off."""

from __future__ import annotations

from typing import Any

from heptarm.arm.collision import THRESHOLD
from heptarm.bridge.service import Offer, Service, Told, scalar
from heptarm.errors import CommandRejected
from heptarm.values.impedance import JointImpedance

#: How an arm gives way unless it is told otherwise [Nm/rad].
_SOFT = 100.0
_REACTIONS = ("brake", "soft")


class CollisionServices(Offer):
    """The collision guard; its baseline is taken from the resting arm."""

    def collision_guard(self, request: Any) -> Told:
        """Put a guard in force, or take it off."""
        driver = self._driver
        if request.disable:
            driver.collisions.off()
            driver.guard = driver.guard  # a servo topic is followed again
            return Told(True, "no collision guard")
        reaction = request.reaction or "brake"
        if reaction not in _REACTIONS:
            raise CommandRejected(
                f"there is no reaction {reaction!r}",
                parameter="reaction",
                value=reaction,
                hint=f"choose from {', '.join(_REACTIONS)}",
            )
        soft = (request.stiffness or _SOFT) if reaction == "soft" else None
        if soft is not None:
            JointImpedance(soft)  # said now, if it is none
        self._rest()
        guard = self._arm.collision_guard(
            scalar(request.threshold, THRESHOLD), margin=scalar(request.margin, 0.0)
        )
        driver.collisions.on(guard, soft=soft)
        driver.guard = driver.guard
        watched = "this node" if guard.is_moving else "the cabinet"
        return Told(
            True, f"{watched} watches; at a collision: {reaction}", {"baseline": guard.baseline.tolist()}
        )


#: All of them.
COLLISIONS = (
    Service("~/collision_guard", "heptarm_msgs/SetCollisionGuard", CollisionServices.collision_guard),
)
