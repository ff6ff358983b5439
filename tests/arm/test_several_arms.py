"""Several arms: they begin together, one stop and one error reach all, their states have one clock and one file."""

from __future__ import annotations

import asyncio
import os
import signal
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm import Arm, shapes
from heptarm.values.motion.motion import Motion
from tests.retry import held_up, retry

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
SETTINGS = {"watchdog": 5.0, "timeout": 30.0, "state_rate": 250.0}


@pytest.fixture(scope="module")
def arms() -> Iterator[ha.Arms]:
    with ha.connect_all(left="sim://iiwa14?speed=2", right="sim://iiwa7?speed=2", settings=SETTINGS) as arms:
        yield arms


@pytest.fixture(autouse=True)
def at_home(arms: ha.Arms) -> None:
    ha.start_together({arm: ha.ptp(HOME) for arm in arms}).wait()


def test_they_have_names_and_an_order(arms: ha.Arms) -> None:
    left, right = arms
    assert arms.names == ("left", "right") and len(arms) == 2
    assert arms["left"] is left and arms["right"] is right
    assert (left.name, right.name) == arms.names
    assert repr(left).startswith("<Arm left: LBR iiwa 14") and repr(right).startswith("<Arm right: LBR")
    assert str(ha.states_together(left, right)).startswith("2 arms, sampled within ")
    assert (left.robot.name, right.robot.name) == ("iiwa14", "iiwa7")
    with pytest.raises(ha.CommandRejected, match="one of left, right, got 'middle'"):
        arms["middle"]


def test_they_begin_together_and_are_released_at_once(arms: ha.Arms) -> None:
    left, right = arms
    long = [
        ha.lin_rel(y=0.02 * (-1) ** k, frame="base", blend_m=0.005) for k in range(12)
    ]  # takes long to plan

    skews: list[float] = []
    while not skews or (min(skews) > 0.02 and len(skews) < 5):  # a busy machine may be late with one of them
        both = ha.start_together({left: long, right: ha.lin_rel(y=0.05, frame="base", speed_mps=0.1)})
        results = both.wait()
        assert both.done and all(result.arrived for result in results.values())
        assert list(results) == [left, right]
        assert not left.state.safety.paused and not right.state.safety.paused
        skews.append(both.skew)
        ha.start_together({arm: ha.ptp(HOME) for arm in arms}).wait()
    assert 0.0 < min(skews) < 0.5


def test_a_program_that_cannot_be_planned_moves_nothing(arms: ha.Arms) -> None:
    left, right = arms
    before = [arm.wait_for_rest() for arm in arms]
    with pytest.raises(ha.HeptarmError, match="^right: .*not reachable"):
        ha.start_together({left: ha.lin_rel(x=0.05), right: ha.lin_rel(x=0.9, frame="base")})
    with pytest.raises(ha.LimitError, match="^right: .*A2"):
        ha.start_together({left: ha.lin_rel(x=0.05), right: ha.ptp(ha.deg(0, 150, 0, 0, 0, 0, 0))})
    for arm, state in zip(arms, before, strict=True):
        arm.wait_until(lambda now: not now.safety.paused)
        assert arm.wait_for_rest().q == pytest.approx(state.q, abs=1e-5)
        assert arm.move(ha.hold(0.05)).arrived


def facing(arms: ha.Arms) -> ha.CollisionModel:
    """The world of the left arm, with the right one opposite to it."""
    left, right = arms
    opposite = ha.Pose.of((1.6, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))
    return ha.CollisionModel(left.robot.name).with_arm("right", at=opposite, robot=right.robot.name)


def test_programs_that_would_meet_are_refused_before_anything_moves(arms: ha.Arms) -> None:
    left, right = arms
    world = facing(arms)
    before = [arm.wait_for_rest().q_cmd for arm in arms]
    meet = {arm: [ha.lin_rel(x=0.2, frame="base"), ha.lin_rel(x=-0.2, frame="base")] for arm in arms}
    with pytest.raises(
        ha.CollisionForeseen, match=r"^left: link_\d is .* right/link_\d after \d\.\d\d s"
    ) as error:
        ha.start_together(meet, collision_check=world)
    assert error.value.touch.clearance.second.startswith("right/") and error.value.touch.t > 0.0
    for arm, q in zip(arms, before, strict=True):
        assert arm.state.q_cmd == pytest.approx(q, abs=1e-9) and not arm.state.safety.paused
    # one alone has room, and with a tool that reaches across there is none
    turns: dict[ha.Arm, Motion | Sequence[Motion]] = {left: meet[left], right: ha.hold(0.1)}
    ahead = ha.Pose.xyz_abc(-0.45, 0.0, -0.06, 0.0, np.pi / 2, 0.0)
    rod = ha.Tool("rod", shapes=[shapes.cylinder(0.02, 0.9, at=ahead)])
    assert ha.start_together(turns, collision_check=world).wait()[left].arrived
    with right.tool(rod), pytest.raises(ha.CollisionForeseen, match="right/rod"):
        ha.start_together({left: ha.hold(0.1), right: ha.hold(0.1)}, collision_check=world)
    with pytest.raises(ha.CommandRejected, match="got a world with none for left, right"):
        ha.start_together(meet, collision_check=ha.CollisionModel("iiwa14"))
    with pytest.raises(ha.ShapeError, match="collision_check must be a world of several arms, got 3"):
        ha.start_together(meet, collision_check=3)  # type: ignore[arg-type]


def test_a_cancelled_await_of_several_arms_brakes_all_of_them(arms: ha.Arms) -> None:
    far = {arm: ha.ptp(ha.deg(90, 30, 0, -90, 0, 60, 0), speed=0.1) for arm in arms}

    async def program() -> None:
        together = ha.start_together({arm: ha.ptp(HOME) for arm in arms})
        assert {arm: result.arrived for arm, result in (await together).items()} == dict.fromkeys(arms, True)
        together = ha.start_together(far)
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(together, 0.2)
        assert together.done  # what follows finds all arms braked

    asyncio.run(program())
    assert all(arm.wait_for_rest().q[0] < ha.deg(80.0)[0] for arm in arms)


def test_one_that_moves_already_is_not_joined(arms: ha.Arms) -> None:
    left, right = arms
    running = left.start(ha.hold(30.0))
    left.wait_until(lambda state: state.motion.active)
    with pytest.raises(ha.ModeConflict, match="^left still moves"):
        ha.start_together({left: ha.hold(1.0), right: ha.hold(1.0)})
    running.cancel()
    running.wait()


@pytest.mark.parametrize("stops", [True, False])
def test_an_error_of_one_stops_the_others_where_that_is_chosen(arms: ha.Arms, stops: bool) -> None:
    left, right = arms
    both = ha.start_together({arm: ha.hold(2.0 if not stops else 60.0) for arm in arms}, stop_others=stops)
    right.stop()  # a motion that somebody stops has failed
    with pytest.raises(ha.MotionAborted, match=r"^right: motion \d+ was stopped") as failure:
        both.wait(timeout=90.0)
    with pytest.raises(ha.MotionAborted, match=r"^right: motion \d+ was stopped"):
        both.wait(timeout=90.0)  # the same again
    assert failure.value is both.handles[right].error
    assert (both.handles[left].error is not None) == stops


def test_one_stop_reaches_all_and_one_that_is_lost_does_not_keep_it_from_the_others(arms: ha.Arms) -> None:
    both = ha.start_together({arm: ha.hold(60.0) for arm in arms}, stop_others=False)
    ha.stop_all(*arms)
    with pytest.raises(ha.MotionAborted):
        both.wait(timeout=60.0)
    assert all(handle.error is not None for handle in both.handles.values())


def test_their_states_have_one_clock(arms: ha.Arms) -> None:
    left, right = arms

    apart = 1.0
    deadline = time.monotonic() + 20.0
    while apart > 0.01 and time.monotonic() < deadline:  # a busy machine may have no two states that close
        now = ha.states_together(left, right)
        apart = now.spread
        assert len(now.states) == 2 and abs(now.time - now.states[0].sampled * 1e-9) <= now.spread + 1e-6
    assert apart <= 0.01


@dataclass(frozen=True)
class RecordedPair:
    """Both arms moved by 5 cm at once: the file, and how far the begins of their motions are apart in it [s]."""

    file: Path
    apart: float
    allowed: float
    held_up: str


def record_both(arms: ha.Arms, file: Path) -> RecordedPair:
    """Let both arms move at once, and check what the file has of each."""
    left, right = arms
    since = time.monotonic_ns()
    with arms.record(file, rate=200) as recorder:
        recorder.note("go")
        both = ha.start_together(
            {left: ha.lin_rel(z=-0.05, speed_mps=0.1), right: ha.lin_rel(z=-0.05, speed_mps=0.1)}
        )
        both.wait()
    runs = {name: ha.load(file, arm=name) for name in arms.names}
    assert [run.facts["robot"] for run in runs.values()] == ["iiwa14", "iiwa7"]
    assert min(run.t[0] for run in runs.values()) == pytest.approx(0.0, abs=1e-6)
    begins = []
    for run in runs.values():
        assert run.complete and len(run) > 40 and len(run.motions) == 1
        assert [one.text for one in run.notes] == ["go"]
        moves = np.linalg.norm(run["q_cmd"] - run["q_cmd"][0], axis=1) > 1e-4
        begins.append(run.t[int(moves.argmax())])
        assert run.motions[0].cause == "finished"
    return RecordedPair(
        file,
        abs(begins[0] - begins[1]),
        2.0 * both.skew + 0.3,  # twice as fast; the machine may be busy
        held_up(left, since) or held_up(right, since),
    )


def test_one_file_has_both_on_one_time_line(arms: ha.Arms, tmp_path: Path) -> None:
    files = count()

    def attempt() -> RecordedPair:
        return record_both(arms, tmp_path / f"both-{next(files)}.mcap")

    def busy(found: RecordedPair | Exception) -> str:
        return found.held_up if isinstance(found, RecordedPair) and found.apart > found.allowed else ""

    found = retry(attempt, busy)
    assert found.apart < found.allowed
    with pytest.raises(ha.CommandRejected, match="arm must be one of left, right, got ''"):
        ha.load(found.file)


def test_connecting_names_the_arm_that_fails_and_closes_the_others() -> None:
    with pytest.raises(ha.CommandRejected, match="different names"):
        ha.connect_all("sim://iiwa14", "sim://iiwa14")
    with pytest.raises(ha.CommandRejected, match="got none"):
        ha.connect_all()
    before = threading.active_count()
    with pytest.raises(ha.ConnectFailed, match=r"^second: "):
        ha.connect_all(first="sim://iiwa14", second="sim://127.0.0.1:9", settings={"timeout": 20.0})
    for thread in threading.enumerate()[before:]:
        thread.join(5.0)


@pytest.mark.parametrize("bad", [None, 3, {}, {"left": ha.hold(1.0)}, [ha.hold(1.0)]])
def test_bad_values_are_refused(arms: ha.Arms, bad: object) -> None:
    with pytest.raises(ha.ShapeError, match="motions must be a motion for each arm"):
        ha.start_together(bad)  # type: ignore[arg-type]
    with pytest.raises(ha.ShapeError, match="arms must be"):
        ha.stop_all(bad)  # type: ignore[arg-type]
    with pytest.raises(ha.ShapeError, match="arms must be"):
        ha.states_together(bad)  # type: ignore[arg-type]


def test_a_lost_arm_stops_the_other_and_the_group_still_closes(arms: ha.Arms) -> None:
    """The last test: it ends one of the simulators."""
    left, right = arms
    both = ha.start_together({arm: ha.hold(60.0) for arm in arms})
    private = right.connection.cabinet
    assert private is not None
    os.kill(private.pid, signal.SIGKILL)
    with pytest.raises(
        ha.ConnectionLost, match="^right: motion [0-9]+ was interrupted: the connection to .* is lost"
    ):
        both.wait(timeout=60.0)
    with pytest.raises(ha.MotionAborted, match="was stopped"):
        both.handles[left].wait(timeout=30.0)
    with pytest.raises(ha.ConnectionLost, match="^right: the arm could not be stopped") as caught:
        ha.stop_all(left, right)
    assert "press the emergency stop" in caught.value.hint
    assert isinstance(left, Arm) and left.in_control
