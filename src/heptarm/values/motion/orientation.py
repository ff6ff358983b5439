"""Orientation control: how the orientation changes along a path."""

from __future__ import annotations

from dataclasses import dataclass

from heptarm.errors import CommandRejected
from heptarm.values.checks import Value, shown

#: From the start's to the end's orientation; the start's throughout; interpolated from the neighbours in a spline; as
#: the joints turn it in a PTP. In the order of the protocol.
TYPES = ("variable", "constant", "ignore", "joint")
#: The frame that the orientation is interpolated in: the base, or the tangent of the path.
REFERENCES = ("base", "path")


@dataclass(frozen=True, slots=True, eq=False)
class Orientation(Value):
    """How the orientation changes along a path.

    Attributes:
        type: "variable", "constant", "ignore" (segments of a spline only) or "joint".
        reference: "base" or "path".

    Raises:
        CommandRejected: another word, or "joint" with the reference "path".
    """

    type: str = "variable"
    reference: str = "base"

    def __post_init__(self) -> None:
        for name, value, allowed in (
            ("orientation", self.type, TYPES),
            ("reference", self.reference, REFERENCES),
        ):
            if not isinstance(value, str) or value not in allowed:
                raise CommandRejected(
                    f"{name} must be one of {', '.join(map(repr, allowed))}, got {shown(value)}",
                    code=2,
                    parameter=name,
                    value=value,
                    allowed=", ".join(allowed),
                )
        if self.type == "joint" and self.reference == "path":
            raise CommandRejected(
                'the orientation "joint" follows the joints and has no reference "path"',
                parameter="reference",
                value=self.reference,
                allowed="base",
                hint='leave reference out, or give orientation="variable" or "constant"',
            )


#: The default.
VARIABLE = Orientation()


def orientation_of(kind: str, reference: str, *, segment: bool = False) -> Orientation:
    """An orientation control; only a segment of a spline may have the kind "ignore".

    Raises:
        CommandRejected: another word, or "ignore" outside a spline.
    """
    result = Orientation(kind, reference)
    if kind == "ignore" and not segment:
        raise CommandRejected(
            'orientation must not be "ignore" outside a spline',
            parameter="orientation",
            value=kind,
            allowed=", ".join(kind for kind in TYPES if kind != "ignore"),
            hint="use it in spl(...)",
        )
    return result
