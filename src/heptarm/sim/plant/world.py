"""What stands around the arm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import mujoco

MODELS = Path(__file__).parent / "models"
_NUMBERS = 6
#: Where the arm's shapes meet the world's, as the floor's do.
_MEETS_ARM = 2
#: How boxes yield, MuJoCo's time constant [s] and damping ratio: with the arm about as a tool's mounting does.
GIVE = (0.05, 1.0)


@dataclass(frozen=True, slots=True)
class Box:
    """A box that stands still, its edges along the base's axes.

    Attributes:
        centre: in the base [m].
        size: edges along x, y, z [m].
    """

    centre: tuple[float, float, float]
    size: tuple[float, float, float]

    @staticmethod
    def of(text: str) -> Box:
        """A box from "X,Y,Z,LENGTH,WIDTH,HEIGHT": its centre and its edges [m].

        Raises:
            ValueError: the text is no box.
        """
        try:
            numbers = [float(part) for part in text.split(",")]
        except ValueError:
            numbers = []
        if len(numbers) != _NUMBERS or not all(map(isfinite, numbers)) or min(numbers[3:]) <= 0:
            raise ValueError(f"{text!r} is no box; X,Y,Z,LENGTH,WIDTH,HEIGHT in metres is wanted")
        x, y, z, length, width, height = numbers
        return Box((x, y, z), (length, width, height))


def compiled(model: str, boxes: Sequence[Box] = ()) -> mujoco.MjModel:
    """MuJoCo's model of a robot ("iiwa7" or "iiwa14") among boxes."""
    path = str(MODELS / f"{model.replace('med', 'iiwa')}.xml")
    if not boxes:
        return mujoco.MjModel.from_xml_path(path)
    spec = mujoco.MjSpec.from_file(path)
    for number, box in enumerate(boxes):
        spec.worldbody.add_geom(
            name=f"box {number}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=box.centre,
            size=[0.5 * edge for edge in box.size],
            contype=_MEETS_ARM,
            conaffinity=1,
            priority=1,
            solref=GIVE,
            rgba=[0.7, 0.6, 0.45, 1.0],
        )
    return spec.compile()
