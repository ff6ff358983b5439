"""Set-points that are computed many at once are those that are computed one by one."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from heptarm.io.compiled import SWITCH
from heptarm.sim.planning.command import TICK, Order
from heptarm.sim.planning.plan import Plan
from heptarm.sim.planning.planner import plan
from heptarm.sim.planning.table import MANY, MANY_IN_PYTHON, SetPointRows, ahead_library
from heptarm.values.arrays import Array
from heptarm.values.robot import robot
from tests.sim.driving import READY

IIWA = robot("iiwa14")
START = np.array(READY)
FAR, NEAR = (1.2, 0.2, 0.3, -1.0, 0.4, 0.5, -0.8), (0.002, 0.5, 0.0, -1.3, 0.0, 0.9, 0.001)
NO_LIMIT = np.full(7, 10.0)
ORDERS = {
    "ptp": Order(1, "ptp", joints=FAR),
    "slow": Order(1, "ptp", joints=FAR, joint_velocity=(0.3,) * 7),
    "short": Order(1, "ptp", joints=NEAR),
    "three with rests": Order(
        1, "batch", parts=tuple(Order(1, "ptp", joints=one) for one in (FAR, NEAR, READY))
    ),
}


@pytest.fixture(params=["C", "Python"], autouse=True)
def language(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    if request.param == "Python":
        monkeypatch.setenv(SWITCH, "1")
    ahead_library.cache_clear()
    if request.param == "C" and ahead_library() is None:
        pytest.skip("no compiler here")
    yield request.param
    ahead_library.cache_clear()


def rows(planned: Plan, step: float, leap: Array = NO_LIMIT) -> list[SetPointRows]:
    """All set-points up to the end."""
    assert planned.table is not None
    time, last, found = 0.0, START, []
    while not found or not found[-1].is_last:
        found.append(planned.table.ahead(time, step, last=last, leap=leap))
        if found[-1].times:
            time, last = found[-1].times[-1], found[-1].joints[-1]
    return found


@pytest.mark.parametrize("factor", [1.0, 0.37])
@pytest.mark.parametrize("name", ORDERS)
def test_they_are_those_of_the_path_and_its_profile(name: str, factor: float, language: str) -> None:
    planned = plan(IIWA, ORDERS[name], START)
    assert planned.path is not None and planned.timing is not None
    found, profile = rows(planned, factor * TICK), planned.timing.profile
    times, places = (np.concatenate([getattr(row, one) for row in found]) for one in ("times", "places"))
    joints = np.array([one for row in found for one in row.joints])
    passed = np.cumsum(np.full(int(np.ceil(profile.duration / (factor * TICK))) - 1, factor * TICK))
    assert (times == passed).all()  # as it grows tick by tick
    assert np.abs(places - np.clip([profile.at(time)[0] for time in times], 0.0, 1.0)).max() < 1e-14
    assert np.abs(joints - [planned.path.at(place, START) for place in places]).max() < 1e-14
    many = MANY if language == "C" else MANY_IN_PYTHON
    assert [len(row.times) for row in found[:-1]] == [many] * (len(found) - 1)


def test_the_first_that_an_axis_cannot_follow_is_none_of_them() -> None:
    planned = plan(IIWA, ORDERS["ptp"], START)
    whole = rows(planned, TICK)
    joints = np.array([START, *(one for row in whole for one in row.joints)])
    steps = np.abs(np.diff(joints, axis=0))
    leap = np.where(np.arange(7) == 5, 0.5 * steps[:, 5].max(), NO_LIMIT)
    count = int((steps[:, 5] > leap[5]).argmax())
    assert 0 < count < len(steps) / 2
    assert sum(len(row.times) for row in rows(planned, TICK, leap)) == count


def test_paths_in_space_have_no_table() -> None:
    offset = (0.05, 0.1, 0.05, 0.0, 0.0, 0.0, 1.0)
    line = Order(1, "lin_rel", offset=offset, reference=(0.0, 0.0, 0.0, 1.0))
    assert plan(IIWA, line, START).table is None
    blended = tuple(Order(1, "ptp", joints=one, blending=(0.1, 0.0, 0.0)) for one in (FAR, READY))
    assert plan(IIWA, Order(1, "batch", parts=blended), START).table is None
