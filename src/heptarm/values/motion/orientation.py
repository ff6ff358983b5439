"""How the orientation is led along a Cartesian path, in KUKA's terms."""

from __future__ import annotations

from dataclasses import dataclass

from heptarm.errors import CommandRejected
from heptarm.values.arrays import Value

#: From the start's to the end's orientation; the start's all the way; chosen by a spline's other points; as the
#: joints would turn it in a PTP.
TYPES = ("variable", "constant", "ignore", "joint")
#: What it is led relative to: the base, or the tangent of the path.
REFERENCES = ("base", "path")


@dataclass(frozen=True, slots=True, eq=False)
class Orientation(Value):
    """How the orientation is led.

    Attributes:
        type: "variable", "constant", "ignore" (segments of a spline only) or "joint".
        reference: "base" or "path".

    Raises:
        CommandRejected: another word.
    """

    type: str = "variable"
    reference: str = "base"

    def __post_init__(self) -> None:
        for name, value, allowed in (
            ("orientation", self.type, TYPES),
            ("reference", self.reference, REFERENCES),
        ):
            if value not in allowed:
                raise CommandRejected(
                    f"{name} is {value!r}; allowed is {', '.join(allowed)}",
                    code=2,
                    parameter=name,
                    value=value,
                    allowed=", ".join(allowed),
                )
        if self.type == "joint" and self.reference == "path":
            raise CommandRejected(
                'the orientation "joint" is led by the joints, not relative to the path',
                parameter="reference",
                hint='leave reference out, or take "variable" or "constant"',
            )


#: The usual one.
VARIABLE = Orientation()


def orientation_of(kind: str, reference: str, *, alone: bool = True) -> Orientation:
    """An orientation; `alone`: of a motion by itself, which has no neighbours to be chosen by.

    Raises:
        CommandRejected: another word, or "ignore" outside a spline.
    """
    result = Orientation(kind, reference)
    if alone and kind == "ignore":
        raise CommandRejected(
            'the orientation "ignore" belongs to points of a spline',
            parameter="orientation",
            value=kind,
            hint="use it in spl(...)",
        )
    return result
