"""Set-points that are computed many at once are those that are computed one by one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from heptarm.planning.motion import TICK
from heptarm.planning.plan import Plan
from heptarm.planning.planner import plan
from heptarm.planning.seam import PlantMotion
from heptarm.planning.table import MANY, MotionTable, SetPointRows
from heptarm.planning.time_scaling import TabulatedProfile
from heptarm.values.checks import Array
from heptarm.values.robot import robot
from tests.oracles.set_points import ahead
from tests.sim import motions
from tests.sim.driving import READY

IIWA = robot("iiwa14")
START = np.array(READY)
FAR, NEAR = (1.2, 0.2, 0.3, -1.0, 0.4, 0.5, -0.8), (0.002, 0.5, 0.0, -1.3, 0.0, 0.9, 0.001)
NO_LIMIT = np.full(7, 10.0)
MOTIONS: dict[str, PlantMotion] = {
    "ptp": motions.ptp(FAR),
    "slow": motions.ptp(FAR, joint_velocity=(0.3,) * 7),
    "short": motions.ptp(NEAR),
    "three with rests": motions.batch(*(motions.ptp(one) for one in (FAR, NEAR, READY))),
}


def follow(planned: Plan, step: float, leap: Array = NO_LIMIT) -> tuple[list[int], Array]:
    """All set-points up to the end: how many at a time, and rows of time, place and joints."""
    assert planned.table is not None
    rows, time, last, counts, found = SetPointRows(leap), 0.0, START, [], []
    while not rows.is_last:
        counts.append(count := rows.compute(planned.table, time, step, last))
        found += [(rows.times[k], rows.places[k], *rows.joints[k]) for k in range(count)]
        if count:
            time, last = rows.times[count - 1], rows.joints[count - 1]
    return counts, np.array(found)


@pytest.mark.parametrize("factor", [1.0, 0.37])
@pytest.mark.parametrize("name", MOTIONS)
def test_they_are_those_of_the_path_and_its_profile(name: str, factor: float) -> None:
    planned = plan(IIWA, MOTIONS[name], START)
    assert planned.path is not None and planned.timing is not None
    profile = planned.timing.profile
    counts, found = follow(planned, factor * TICK)
    times, places, joints = found[:, 0], found[:, 1], found[:, 2:]
    passed = np.cumsum(np.full(int(np.ceil(profile.duration / (factor * TICK))) - 1, factor * TICK))
    assert (times == passed).all()  # as it grows tick by tick
    assert np.abs(places - np.clip([profile.at(time)[0] for time in times], 0.0, 1.0)).max() < 1e-14
    assert np.abs(joints - [planned.path.at(place, START) for place in places]).max() < 1e-14
    assert set(counts[:-1]) <= {MANY}


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_they_are_those_of_the_oracle(seed: int) -> None:
    """Over random tables, also such that no planner makes: with leaps of the place; it never goes back."""
    chance = np.random.default_rng(seed)
    count, duration = int(chance.integers(1, 6)), float(chance.uniform(0.01, 0.3))
    pieces = np.column_stack([np.sort(chance.uniform(0, 0.2, count)), chance.uniform(0, 4.0, (count, 4))])
    place = -0.05
    for piece, end in zip(pieces, [*pieces[1:, 0], duration], strict=True):
        piece[1] = place = place + chance.choice([0.0, 0.05])
        place += np.polyval([*piece[:1:-1], 0.0], max(0.0, end - piece[0]))
    edges = np.unique(np.concatenate([[0.0, 1.0], chance.uniform(0, 1, int(chance.integers(0, 4)))]))
    lines = np.column_stack([edges[:-1], edges[1:], chance.normal(size=(len(edges) - 1, 14))])
    table = MotionTable(pieces, lines, duration)
    leap = np.full(7, chance.choice([0.05, 0.5, 10.0]))
    rows, last = SetPointRows(leap), lines[0, 2:9]
    time, step = float(chance.uniform(0, 0.1)), float(chance.uniform(0.1, 1.0)) * TICK
    times, places, joints = ahead(table, time, step, last, leap)
    found = rows.compute(table, time, step, last)
    assert found == len(times) and rows.is_last == (found < MANY)
    assert list(rows.times[:found]) == times.tolist()
    assert np.abs(np.array(rows.places[:found]) - places).max(initial=0.0) < 1e-15
    assert np.abs(rows.joints[:found] - joints).max(initial=0.0) < 1e-14


def test_a_profile_of_samples_consists_of_pieces() -> None:
    profile = TabulatedProfile(TICK, np.sin(np.linspace(0.0, np.pi, 200)) ** 2, 0.2, 1.0)
    pieces, times = profile.pieces, np.linspace(0.0, profile.duration, 777)[:-1]
    at = np.searchsorted(pieces[:, 0], times, side="right") - 1
    found = [np.polyval(pieces[k, :0:-1], time - pieces[k, 0]) for k, time in zip(at, times, strict=True)]
    assert found == pytest.approx([profile.at(time)[0] for time in times], abs=1e-12)


def test_the_first_that_an_axis_cannot_follow_is_none_of_them() -> None:
    planned = plan(IIWA, MOTIONS["ptp"], START)
    _, whole = follow(planned, TICK)
    steps = np.abs(np.diff(whole[:, 2:], axis=0, prepend=START[None]))
    leap = np.where(np.arange(7) == 5, 0.5 * steps[:, 5].max(), NO_LIMIT)
    count = int((steps[:, 5] > leap[5]).argmax())
    assert 0 < count < len(steps) / 2
    assert len(follow(planned, TICK, leap)[1]) == count


def test_a_place_at_the_end_of_the_path_is_the_end() -> None:
    pieces = np.array([[0.0, 0.0, 1.0, 0.0, 0.0]])  # s = t
    lines = np.array([[0.0, 1.0, *START, *np.full(7, 0.1)]])
    rows = SetPointRows(NO_LIMIT)
    assert rows.compute(MotionTable(pieces, lines, 3.0), 0.0, 0.25, START) == 3 and rows.is_last
    assert list(rows.places[:3]) == [0.25, 0.5, 0.75]
    assert rows.joints[:3] == pytest.approx(START + 0.1 * np.array([[0.25], [0.5], [0.75]]))


def test_paths_in_space_have_no_table() -> None:
    offset = (0.05, 0.1, 0.05, 0.0, 0.0, 0.0, 1.0)
    line = motions.lin_rel(offset, (0.0, 0.0, 0.0, 1.0))
    assert plan(IIWA, line, START).table is None
    blended = tuple(motions.ptp(one, blending=(0.1, 0.0, 0.0)) for one in (FAR, READY))
    assert plan(IIWA, motions.batch(*blended), START).table is None
