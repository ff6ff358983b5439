"""How hard the arm presses: the largest force of a contact that a condition ends, and the force at rest."""

from __future__ import annotations

from collections.abc import Iterator

import heptarm as ha
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from heptarm.values.condition.reaction import Reaction
from heptarm.values.result import Result
from heptarm.when import force

TABLE = 0.2
THRESHOLD = 20.0
#: Speeds [m/s].
SPEEDS = (0.01, 0.02, 0.05)
#: Before the joints were elastic, 293 N at 50 mm/s.
HARDEST = 100.0
#: Of a touch at 20 mm/s with a threshold of 10 N.
AT_REST = 15.0


@benchmark("contact_force")
def contact_force() -> Iterator[Figure]:
    """Largest force and force at rest of motions onto a table until 20 N, for three speeds, staying and relaxing."""
    with Cabinet("--box", f"0.6,0,{TABLE / 2},0.4,0.6,{TABLE}") as cabinet, ha.connect(cabinet.target) as arm:
        for speed in SPEEDS:
            name, detail = f"{speed * 1e3:.0f}_mm_s", {"until_N": THRESHOLD}
            stays = _press(arm, speed, "stay")
            yield Figure(f"contact_peak_{name}", stays.peak_force, "N", limit=HARDEST, detail=detail)
            yield Figure(f"contact_stays_{name}", stays.rest_force, "N", detail=detail)
            relaxes = _press(arm, speed, "relax")
            yield Figure(
                f"contact_relaxes_{name}", relaxes.rest_force, "N", limit=THRESHOLD / 2, detail=detail
            )
        _above(arm)
        touch = arm.touch("-z", frame="base", distance=0.1, force=10.0, speed_mps=0.02).result
        yield Figure("touch_peak", touch.peak_force, "N")
        yield Figure("touch_rest", touch.rest_force, "N", limit=AT_REST)


def _above(arm: ha.Arm) -> None:
    """Rest 20 mm above the table."""
    arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)))
    height = float(arm.wait_for_rest().pose.xyz[2])
    arm.move(ha.lin_rel(z=TABLE + 0.02 - height, frame="base", speed_mps=0.2))


def _press(arm: ha.Arm, speed: float, then: Reaction) -> Result:
    _above(arm)
    result = arm.move(ha.lin_rel(z=-0.1, frame="base", speed_mps=speed), until=force > THRESHOLD, then=then)
    assert result.cause is ha.Cause.CONDITION, result
    return result
