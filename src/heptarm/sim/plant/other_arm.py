"""Another arm in the world of one: where its base is, and what it carries. Its posture is set, it is not simulated."""

from __future__ import annotations

from dataclasses import dataclass

from heptarm.sim.plant.carried import CarriedShapes
from heptarm.values.checks import Value
from heptarm.values.pose import Pose


@dataclass(frozen=True, slots=True, eq=False)
class OtherArm(Value):
    """Another arm.

    Attributes:
        name: of the arm; its bodies are named "NAME/link_1".
        robot: name of its robot.
        pose: of its base in the base of the arm whose world it is.
        carried: shapes of its tool and of what that holds.
    """

    name: str
    robot: str
    pose: Pose
    carried: tuple[CarriedShapes, ...] = ()
