"""Where the scenarios play: the home of the arm, and a simulator with a table, signals and tools."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import urlencode

from heptarm.arm.arm import Arm
from heptarm.errors import CommandRejected
from heptarm.values.checks import Array, instance, within
from heptarm.values.pose import deg
from heptarm.values.robot import robot

#: Where every scenario begins: the elbow bent at a right angle, the flange pointing down.
HOME: Array = deg(0, 30, 0, -90, 0, 60, 0)
#: How high the table before the simulated robot is, and how far below the flange at home a real one may be [m].
TABLE = 0.2
DEEPEST = 0.3
#: How fast a scenario moves: fractions of the axes' maxima.
VIRTUAL_SPEED, REAL_SPEED = 1.0, 0.1
#: Simulated seconds per second at most.
FASTEST = 1000.0


def stage(*, model: str = "iiwa14", speed: float = 1.0, sensors: str = "ideal") -> str:
    """Target of a private simulator on which every scenario can play.

    Args:
        model: "iiwa7", "iiwa14", "med7" or "med14".
        speed: simulated seconds per second.
        sensors: "ideal", "noisy" or "noisy:SEED".

    Raises:
        CommandRejected: unknown model.
        LimitError, ShapeError: another value that means nothing.
    """
    robot(model)
    within(speed, "speed", 0.0, FASTEST, above=True)
    instance(sensors, str, "sensors")
    options = {
        "speed": f"{speed:g}",
        "sensors": sensors,
        "box": f"0.6,0,{TABLE / 2},0.4,0.8,{TABLE}",
        "project": str(Path(__file__).with_name("stage.xml")),
    }
    return f"sim://{model}?{urlencode(options)}"


def has_operator(arm: Arm) -> bool:
    """Whether this program can play the person beside the robot."""
    try:
        return arm.operator is not None
    except CommandRejected:
        return False
