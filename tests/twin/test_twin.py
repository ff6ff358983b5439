"""A recording once more in the simulator: alike where nothing differs, and where they part if something does."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np
import pytest

import heptarm as ha
from heptarm.cli.twin import twin as command
from heptarm.fri.loop.shared_memory import S_PERIOD, S_TICKS, STATE_WORDS
from heptarm.fri.loop.user_api import Output, Params, State
from heptarm.modes import CartesianImpedance, JointImpedance
from heptarm.record.fri_commands import FriCommands
from heptarm.record.recording import Recording
from heptarm.twin.commands import commands_of
from heptarm.twin.comparison import deviations_of
from heptarm.twin.fri_law import RecordedLaw
from heptarm.values.checks import Array
from heptarm.values.mode.mode import Mode
from heptarm.when import path
from heptarm.wire import messages as wire
from tests.conftest import RunningCabinet, start_cabinet
from tests.retry import retry

#: Motions are dated by the states that show them, which a busy machine misses.
pytestmark = pytest.mark.alone
SPEED = 1.0
HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
STICK = ha.Tool("stick", mass=1.2, com=(0, 0, 0.05), tcp=ha.Pose.of((0, 0, 0.1)))


@pytest.fixture(scope="module")
def recorded(cabinet: RunningCabinet, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Recording]:
    """A recording with a tool, two programs, a control mode, a break condition and a change of the override."""
    file = tmp_path_factory.mktemp("twin") / "run.mcap"
    with ha.connect(cabinet.target, watchdog=5.0, timeout=30.0, state_rate=250) as arm:
        arm.attach_tool(STICK)
        arm.move(ha.ptp(HOME))
        with arm.record(file):
            arm.move(
                [ha.ptp(HOME + 0.1, speed=0.3), ha.lin_rel(z=0.05, frame="base")],
                mode=JointImpedance(stiffness=[800.0] * 7),
            )
            arm.set_override(0.5)
            arm.move(ha.hold(0.3))  # the speed changes in this time, however long the next request takes
            moved = arm.move(ha.lin_rel(z=-0.1, frame="base"), until=path.after(0.03))
            arm.wait_for_rest()
        assert moved.cause is ha.Cause.CONDITION
        arm.set_override(1.0)
        arm.detach_tool()
    yield ha.load(file)


def test_a_twin_of_the_simulator_is_alike(
    cabinet: RunningCabinet, recorded: Recording, tmp_path: Path
) -> None:
    """The same program, tool, mode, condition and override: nothing parts, and one file has both."""
    twin = ha.replay_in_sim(recorded, target=cabinet.target)
    assert twin.is_alike, str(twin)
    assert [one.recorded.cause for one in twin.motions] == ["finished", "finished", "condition"]
    assert all(one.ends_alike for one in twin.motions) and not twin.notes
    assert twin["q"].rms < 5e-4 and twin["q_cmd"].largest < 2e-3 and twin["tau"].rms < 0.5, str(twin)

    saved = twin.save(tmp_path / "both.mcap")
    both = {name: ha.load(saved, arm=name) for name in ("recorded", "simulated")}
    assert both["recorded"].t == pytest.approx(recorded.t, abs=1e-8)
    assert (both["recorded"]["q"] == recorded["q"]).all() and len(both["recorded"].events) == len(
        recorded.events
    )
    kept = twin.simulated.t >= 0.0
    assert both["simulated"].t == pytest.approx(twin.simulated.t[kept], abs=1e-8)
    assert (both["simulated"]["tau"] == twin.simulated["tau"][kept]).all()
    with pytest.raises(ha.CommandRejected, match="overwrite"):
        twin.save(saved)
    assert twin.chart("q").save(tmp_path / "twin.png").stat().st_size > 1000


def test_what_if(
    cabinet: RunningCabinet, recorded: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Half the speed and a weak spring, by the command: both part, within the first motion, and the text has it."""
    plot, both = tmp_path / "twin.svg", tmp_path / "both.mcap"
    what_if: dict[str, Any] = {"sim": cabinet.target, "speed": 0.5, "stiffness": 500.0, "band": ("dq=9",)}
    assert command(recorded.path, out=plot, save=both, signals="q", as_json=True, **what_if) == 0
    found = json.loads(capsys.readouterr().out)
    first = recorded.motions[0]
    assert not found["alike"] and first.begin <= found["parts_s"] <= first.end
    by_name = {one["signal"]: one for one in found["deviations"]}
    assert (
        by_name["q"]["parts"] is not None and by_name["dq"]["parts"] is None and by_name["dq"]["band"] == 9.0
    )
    assert plot.read_text().count("parts") >= 1 and len(ha.load(both, arm="simulated")) > 100
    with pytest.raises(ha.CommandRejected, match="overwrite"):
        command(recorded.path, save=both)
    with pytest.raises(ha.CommandRejected, match="SIGNAL=LARGEST"):
        command(recorded.path, band=("q:1",))


@pytest.mark.long
def test_a_stream_is_repeated_by_its_set_points(tmp_path: Path) -> None:
    """A servo stream has no program: its set-points are the stream of the twin."""
    file = tmp_path / "stream.mcap"
    with ha.connect("sim://iiwa14", watchdog=5.0, timeout=30.0, state_rate=250) as arm:
        arm.move(ha.ptp(HOME))
        with arm.record(file), arm.servo(rate=100, watchdog=2.0) as servo:
            while servo.tick() and servo.t < 3.0:
                servo.set(HOME + 0.1 * np.sin(2.0 * servo.t) * np.eye(7)[5])
    twin = ha.replay_in_sim(file, bands={"dq": 1.0, "q": 0.02, "q_cmd": 0.02, "xyz": 0.01})
    assert twin["q"].is_inside and twin["q"].rms < 5e-3, str(twin)


def twist(state: State, out: Output, params: Params) -> None:
    """Torques that swing A2 and A6."""
    out.tau[[1, 5]] = 3.0 * math.sin(5.0 * state.t), 2.0 * math.sin(8.0 * state.t)


def push(state: State, out: Output, params: Params) -> None:
    """A force along x that swings, and one up that grows."""
    out.wrench[[0, 2]] = 10.0 * math.sin(6.0 * state.t), 10.0 * min(state.t, 1.0)


def missed(outcome: ha.Twin | Exception) -> str:
    """What this machine was too busy for: answers of the client that did not come in time."""
    if isinstance(outcome, Exception):
        return str(outcome) if isinstance(outcome, ha.QualityLost) else ""
    runs = (outcome.recorded, outcome.simulated)
    least = min(float(np.nanmin(run["fri.tracking"])) for run in runs)
    return "" if least == 1.0 else f"{1.0 - least:.0%} of the answers came late"


#: Kind of an FRI session, its control mode, its law, and what it superposes.
SUPERPOSED: list[tuple[Literal["torque", "wrench"], Mode, Callable[..., None], str]] = [
    ("torque", JointImpedance(stiffness=[200.0] * 7), twist, "tau_sent"),
    ("wrench", CartesianImpedance(stiffness=(1000, 1000, 1000, 100, 100, 100)), push, "wrench_sent"),
]


@pytest.fixture(scope="module")
def slow() -> Iterator[RunningCabinet]:
    """A virtual cabinet that gives answers four times the time: one that comes late is another command to both runs."""
    yield from start_cabinet(0.25)


@pytest.mark.long
@pytest.mark.parametrize(("kind", "mode", "law", "sent"), SUPERPOSED)
def test_what_an_fri_client_superposes_is_superposed_again(
    slow: RunningCabinet,
    tmp_path: Path,
    kind: Literal["torque", "wrench"],
    mode: Mode,
    law: Callable[..., None],
    sent: str,
) -> None:
    """Positions of the twin are within 2 mrad, a fifth of the swing at most, and nothing is left out."""
    file = tmp_path / "fri.mcap"

    def attempt() -> ha.Twin:
        with ha.connect(slow.target, watchdog=5.0, timeout=30.0, state_rate=250) as arm:
            arm.move(ha.ptp(HOME))
            recorder = arm.record(file, overwrite=True)
            with recorder, arm.fri(kind, period_ms=5, mode=mode, law=law) as session:
                while session.active and session.state.t < 2.0:
                    session.wait(0.05)
            arm.wait_for_rest()
        return ha.replay_in_sim(file, target=slow.target, bands={"q": 2e-3, "q_cmd": 2e-3})

    twin = retry(attempt, missed)
    run = twin.recorded
    assert twin.is_alike and not twin.notes, str(twin)
    assert twin["q"].largest < 0.2 * float(np.ptp(run["q"], axis=0).max()), str(twin)
    (again,) = FriCommands.of(twin.simulated)
    assert float(np.nanmax(np.abs(getattr(again, sent)))) > 1.0

    blind = {name: values for name, values in run.signals.items() if not name.startswith("fri.")}
    (note,) = commands_of(replace(run, signals=blind)).notes
    assert f"the {kind} that its FRI client superposed is left out: the recording has no cycles" in note
    other = ha.replay_in_sim(run, target=slow.target, mode=ha.modes.Position())
    assert "overlay needs" in other.motions[0].refusal and not other.is_alike


def test_recorded_answers_are_given_at_their_time() -> None:
    """Of a lost answer the one before is repeated; behind the last one the last."""
    t: Array = np.array([0.0, 0.005, 0.015, 0.02])
    q = np.tile(HOME, (4, 1)) + t[:, None]
    commands = FriCommands(
        0.0, 0.005, t, np.array([True, True, False, True]), q, q, q, 100.0 * q, np.full((4, 6), np.nan)
    )
    state, out = State(np.zeros(STATE_WORDS)), Output()
    words = state.words.view(np.int64)
    words[S_PERIOD] = 5_000_000
    for speed, rows in ((1.0, (0, 1, 1, 1, 3, 3)), (0.5, (0, 0, 1, 1, 1, 1, 1, 3, 3))):
        law = RecordedLaw(commands, "tau", speed=speed)
        for tick, row in enumerate(rows):
            words[S_TICKS] = tick
            law(state, out, cast(Params, None))
            assert (out.q == q[row]).all() and (out.tau == 100.0 * q[row]).all() and not out.wrench.any()


def test_a_black_box_reproduces_its_stop() -> None:
    """The emergency stop comes at its time after the begin of the motion, and ends it there."""
    with ha.connect("sim://iiwa14", watchdog=5.0, timeout=30.0) as arm:  # the stop is dated by a state
        handle = arm.start(ha.ptp(HOME + 0.8, speed=0.5))
        arm.wait_until(lambda state: abs(state.dq).max() > 0.3)
        arm.operator.fault("emergency_stop")
        with pytest.raises(ha.MotionAborted) as caught:
            handle.wait()
    assert caught.value.black_box is not None
    twin = ha.replay_in_sim(caught.value.black_box)
    (motion,) = twin.motions
    assert motion.recorded.cause == "safety" and motion.ends_alike, str(twin)
    # the event of the stop, by which it is repeated, reached the client up to a few periods of the state later
    assert twin["q"].largest < 0.15, str(twin)


# ------------------------------------------------------------------------------------------- without a cabinet


def test_what_cannot_be_repeated(recorded: Recording, tmp_path: Path) -> None:
    """Nothing is started for a recording that commands nothing, or that this version does not understand."""

    def refusal(run: Recording) -> str:
        with pytest.raises(ha.CommandRejected) as caught:
            ha.replay_in_sim(run)
        return str(caught.value)

    def changed(name: str, **fields: object) -> Recording:
        events = [
            replace(event, content={**event.content, **fields}) if event.name == name else event
            for event in recorded.events
        ]
        return replace(recorded, events=tuple(events))

    assert "no motion" in refusal(replace(recorded, motions=()))
    assert "version 3.0" in refusal(replace(recorded, facts={**recorded.facts, "protocol": "3.0"}))
    assert "'x'" in refusal(replace(recorded, facts={**recorded.facts, "protocol": "x"}))
    assert "iiwa99" in refusal(replace(recorded, facts={**recorded.facts, "robot": "iiwa99"}))
    assert "'later'" in refusal(changed("Run", later=1))
    assert "not known" in refusal(changed("Run", when="someday"))
    none = {name: values for name, values in recorded.signals.items() if name != "q_cmd"}
    assert "set-points" in refusal(replace(recorded, signals=none))
    with pytest.raises(ha.CommandRejected, match="simulator"):
        ha.replay_in_sim(recorded, target="172.31.1.147")
    with pytest.raises(ha.CommandRejected, match="bands"):
        ha.replay_in_sim(recorded, bands={"speed": 1.0})
    with pytest.raises(ha.LimitError, match="speed"):
        ha.replay_in_sim(recorded, speed=2.0)
    with pytest.raises(ha.CommandRejected):
        ha.replay_in_sim(tmp_path / "none.mcap")


def test_set_points_stand_for_what_is_not_in_the_file(recorded: Recording) -> None:
    """Another client's motion, or one that began before the file, is repeated by its set-points, in its mode."""
    commands = commands_of(recorded)
    assert commands.tool == "stick" and [one.name for one in commands.tools] == ["stick"]
    assert [one.program is not None for one in commands.sections] == [True, True, True]
    others = replace(recorded, events=tuple(one for one in recorded.events if one.name != "Run"))
    first, _, second = commands_of(others).sections
    assert first.program is None and first.stream is not None and second.stream is not None
    assert isinstance(first.mode, wire.JointImpedance)
    ends = [
        recorded.t[(recorded["q_cmd"] == q).all(axis=1)] for q in (first.stream.q[-1], second.stream.q[0])
    ]
    between = max(0.0, float(ends[1][0] - ends[0][-1]))  # a busy machine has missed states
    assert np.abs(first.stream.q[-1] - second.stream.q[0]).max() < 1e-3 + between
    late = commands_of(recorded.between(recorded.motions[0].begin + 0.1, "end"))
    assert late.sections[0].program is None and late.sections[0].stream is not None
    assert late.sections[1].program is not None


def test_a_deviation_has_a_band() -> None:
    t: Array = np.arange(100, dtype=np.float64) * 0.004
    q: Array = HOME + 0.1 * np.sin(t)[:, None]
    run = Recording(Path("run.mcap"), {"robot": "iiwa14"}, {"t": t, "q": q}, (), (), complete=True)
    bands = {"q": 0.005, **dict.fromkeys(("q_cmd", "dq", "xyz", "tau", "tau_ext", "force", "torque"), 1.0)}
    spiked, later = q.copy(), q.copy()
    spiked[50, 2] += 0.5
    later[60:, 4] += 0.01
    for other, largest, entry, parts in ((spiked, 0.5, "A3", None), (later, 0.01, "A5", float(t[60]))):
        (one,) = deviations_of(run, replace(run, signals={"t": t, "q": other}), t, bands)
        assert one.largest == pytest.approx(largest) and one.entry == entry
        assert one.is_inside if parts is None else one.parts == pytest.approx(parts)
    few = np.r_[0:20, 70:100]  # a busy machine has missed the others
    missed = replace(run, signals={"t": t[few], "q": q[few] + np.where(few < 70, 0.0, 0.001)[:, None]})
    (one,) = deviations_of(run, missed, t, bands)
    assert one.is_inside and one.largest == pytest.approx(0.001) and one.t > t[70]
