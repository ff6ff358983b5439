"""What a client wants of the robot in one answer."""

from __future__ import annotations

from dataclasses import dataclass

from heptarm.errors import CommandRejected
from heptarm.fri import messages as m


@dataclass(slots=True)
class Setpoint:
    """What the user wants in COMMANDING_ACTIVE; what is None is filled with what does nothing.

    Attributes:
        q: joint position [rad]; None mirrors the interpolator.
        tau: superposed joint torques [Nm]; None is zero. TORQUE only.
        wrench: superposed wrench [N, Nm]; None is zero. WRENCH only.
        pose: Cartesian pose [mm, quaternion]; None mirrors the interpolator. CARTESIAN_POSE only.
        redundancy: of the pose; None mirrors the interpolator.
        io: outputs to set.
        transformations: values of the requested transformations.
    """

    q: m.Joints | None = None
    tau: m.Joints | None = None
    wrench: tuple[float, ...] | None = None
    pose: m.Transformation | None = None
    redundancy: m.Redundancy | None = None
    io: tuple[m.IoValue, ...] = ()
    transformations: tuple[m.Transformation, ...] = ()

    @property
    def is_plain(self) -> bool:
        """It has no outputs and no transformations."""
        return not self.io and not self.transformations

    def check(self, full: m.Monitoring) -> None:
        """Check outputs and transformations against what the controller offers.

        Args:
            full: the message that is answered.

        Raises:
            CommandRejected: a name that it does not offer so; the text lists those that it does.
        """
        signals = {one.name: one for one in (full.monitor.io if full.monitor is not None else ())}
        for value in self.io:
            offered = signals.get(value.name)
            if offered is None or offered.direction is not m.IoDirection.OUTPUT:
                outputs = [name for name, one in signals.items() if one.direction is m.IoDirection.OUTPUT]
                raise CommandRejected(
                    f"{value.name!r} is no output of this FRI session",
                    parameter=value.name,
                    allowed=", ".join(outputs) or "none",
                    hint="register the signal in the cabinet's FRI configuration",
                )
            if offered.type is not value.type:
                raise CommandRejected(
                    f"{value.name!r} is {offered.type.name}, not {value.type.name}", parameter=value.name
                )
        wanted = [one.name for one in full.requested]
        for one in self.transformations:
            if one.name not in wanted:
                raise CommandRejected(
                    f"the controller asks for no transformation {one.name!r}",
                    parameter=one.name,
                    allowed=", ".join(wanted) or "none",
                )


#: Mirrors the interpolator.
NOTHING = Setpoint()
