"""The delay of FRI commands, hidden in the simulator: found from a session, with an honest standard deviation."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from heptarm import calibration
from heptarm.calibration.fri_delay import delay_of, interpolation
from heptarm.errors import CommandRejected, LimitError
from heptarm.fri.loop.shared_memory import ANSWERED
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.version import Version
from heptarm.record.fri_commands import FriCommands
from heptarm.record.recording import Recording
from heptarm.sim.fri.overlay import MotionOverlay
from heptarm.sim.fri.sessions import PlantArm
from heptarm.sim.fri.settings import SessionConfiguration
from heptarm.sim.plant.plant import Plant
from heptarm.values.fitted_arm import FittedArm
from tests.calibration.hidden_arm import HIDDEN, commanded, drawn, number
from tests.long import few, longer
from tests.sim_fri.rig import READY, Rig, State, mirror

#: Periods [ms], multipliers and delays [ms] that are hidden in a session.
HIDDEN_IN = [(2, 3, 5), (1, 1, 0), (1, 1, 3), (5, 1, 7), (10, 1, 2)]


def session_of(*, period_ms: int, multiplier: int, delay: int, version: Version = Version.V1_15) -> Recording:
    """A recording of the simulated controller with a hidden delay, whose client swings A7 for 0.7 s."""
    configuration = SessionConfiguration(version, period_ms=period_ms, multiplier=multiplier)
    rig = Rig(version, configuration, command_delay=delay).active()
    first, sent = len(rig.client.seen), dict[int, list[float]]()

    def swing(message: m.Monitoring) -> m.Command:
        number, (*others, last) = message.header.sequence, READY
        begin = rig.client.seen[first].header.sequence
        last += 0.05 * (1.0 - math.cos(5e-3 * period_ms * (number - begin)))
        sent[number] = [*others, last]
        return replace(mirror(message), q=tuple(sent[number]))

    rig.client.law = swing
    rig.run(700)
    seen = [
        one
        for one in rig.client.seen[first:]
        if one.connection and one.connection.state is State.COMMANDING_ACTIVE
    ]
    nothing = [math.nan] * 7
    monitors = [one.monitor for one in seen if one.monitor is not None]
    sequence = np.array([one.header.sequence for one in seen])
    answers = np.array([sent.get(number, nothing) for number in sequence.tolist()])
    count = len(seen)
    signals = {
        "session": np.full(count, int(State.COMMANDING_ACTIVE)),
        "sequence": sequence,
        "period": np.full(count, 1_000_000 * period_ms),
        "flags": np.where(np.isfinite(answers[:, 0]), ANSWERED, 0),
        "t": 1e-3 * period_ms * (sequence - sequence[0]) + 4.0,
        "q": np.array([one.q for one in monitors]),
        "q_cmd": np.array([one.q_cmd or nothing for one in monitors]),
        "q_sent": answers,
        "tau_sent": np.full((count, 7), np.nan),
        "wrench_sent": np.full((count, 6), np.nan),
    }
    named = {f"fri.{name}": values for name, values in signals.items()} | {"t": np.zeros(0)}
    return Recording(Path("fri.mcap"), {"robot": "iiwa14"}, named, (), (), complete=True)


@pytest.mark.parametrize(("period", "multiplier", "delay"), few(HIDDEN_IN))
def test_a_hidden_delay_of_the_simulated_controller_is_found(
    period: int, multiplier: int, delay: int
) -> None:
    run = session_of(period_ms=period, multiplier=multiplier, delay=delay)
    found = calibration.fri_command_delay(run, state_delay=0.002)
    assert found.delay == pytest.approx(1e-3 * delay, abs=2e-5) and found.sigma < 1e-4
    assert found.period == pytest.approx(1e-3 * period * multiplier) and not found.contradictions
    measured = interpolation(found.period) + 1e-3 * delay + 0.002
    assert found.cycles == pytest.approx(measured / found.period, abs=0.1)
    assert f"{found.cycles:.2f} cycles" in str(found) and "fri.mcap" in found.numbers.source


def test_a_fitted_arm_delays_the_commands_of_its_clients(tmp_path: Path) -> None:
    file = tmp_path / "arm.toml"
    run = session_of(period_ms=2, multiplier=1, delay=4)
    arm = HIDDEN.with_numbers([calibration.fri_command_delay(run).numbers])
    arm.save(file)
    read = calibration.load_fitted(file)
    assert "[fri_command_delay]  # delay of FRI commands, beyond their interpolation [s]" in file.read_text()
    assert PlantArm(Plant(fitted=read)).command_delay == 4
    assert PlantArm(Plant()).command_delay == 0


def test_torques_of_a_client_are_delayed_and_end_without_one() -> None:
    def first(delay: int) -> int:
        rig = Rig(command_delay=delay).active(
            MotionOverlay(m.CommandMode.TORQUE, m.ControlMode.JOINT_IMPEDANCE)
        )
        rig.run(20)
        rig.command(tau=(1.0,) * 7)
        before = len(rig.arm.loads)
        rig.run(20)
        acts = [tau is not None and bool(tau.any()) for tau, _ in rig.arm.loads[before:]]
        rig.silent = True
        rig.run(20)
        assert rig.arm.loads[-1] == (None, None)
        return acts.index(True)

    assert first(3) == first(0) + 3


def test_the_truth_is_within_two_sigma() -> None:
    for has_set_points in (True, False):
        runs, inside = longer(3, 100), 0
        for seed in range(runs):
            delay, period = 1e-3 * (seed % 8), (1, 2, 5)[seed % 3]
            arm = drawn(seed).with_numbers([number("fri_command_delay", delay), number("state_delay", 0.002)])
            seen = commanded(arm, seed=seed, period_ms=period, has_set_points=has_set_points)
            found = delay_of([seen], state_delay=0.002)
            assert found is not None
            inside += abs(found.delay - delay) <= 2.0 * found.sigma + 1e-9
        assert inside >= 0.9 * runs


def test_what_sessions_contradict_is_named() -> None:
    late, later = (
        commanded(FittedArm("iiwa14", (number("fri_command_delay", delay),)), seed=0, period_ms=period)
        for delay, period in ((0.001, 1), (0.005, 5))
    )
    found = delay_of([late, later])
    assert found is not None and len(found.contradictions) == 2
    assert "at a period of 5 ms are 5.00 ms late" in found.contradictions[1]
    sooner = replace(late, q_cmd=np.roll(late.q_cmd, -3, axis=0)[:-3])
    sooner = FriCommands(
        0.0, 1e-3, *(getattr(sooner, name)[: len(sooner.q_cmd)] for name in FriCommands.__slots__[2:])
    )
    found = delay_of([sooner])
    assert found is not None and found.delay == 0.0
    assert "2.00 ms sooner than the simulator's interpolation" in found.contradictions[0]


def test_lost_answers_do_not_count() -> None:
    seen = commanded(FittedArm("iiwa14", (number("fri_command_delay", 0.003),)), seed=1, period_ms=1)
    lost = (seen.t > 0.9) & (seen.t < 0.95)
    shown = np.where(lost[:, None], 0.0, seen.q_cmd)  # whatever the controller does there
    found = delay_of([replace(seen, is_answered=seen.is_answered & ~lost, q_cmd=shown)])
    assert found is not None and found.delay == pytest.approx(0.003, abs=2e-5)


def test_a_recording_without_such_a_session_is_refused() -> None:
    run = session_of(period_ms=5, multiplier=1, delay=0)
    still = dict(run.signals) | {"fri.q_sent": np.tile(READY, (len(run["fri.t"]), 1))}
    free = dict(run.signals) | {"fri.q_cmd": run["fri.q_cmd"][::-1] ** 2}
    none = {"t": run.t}
    for signals in (still, free, none):
        with pytest.raises(CommandRejected, match="an FRI session whose client moves the arm"):
            calibration.fri_command_delay(replace(run, signals=signals))
    with pytest.raises(LimitError, match="state_delay"):
        calibration.fri_command_delay(run, state_delay=1.0)


def test_each_start_of_commands_is_a_session() -> None:
    """Sessions of one client count on; another one begins at 0. Cycles before commands are effective do not count."""
    run = session_of(period_ms=5, multiplier=1, delay=0)
    count = len(run["fri.t"])
    after = dict(run.signals) | {"fri.sequence": run["fri.sequence"] + 400, "fri.t": run["fri.t"] + 9.0}
    waiting = dict(run.signals) | {"fri.session": np.full(count, int(State.COMMANDING_WAIT))}
    parts = (waiting, run.signals, after)
    both = {name: np.concatenate([part[name] for part in parts]) for name in run.signals}
    first, second = FriCommands.of(replace(run, signals=both))
    assert len(first.t) == len(second.t) == count and second.begin - first.begin == pytest.approx(9.0)
    assert first.t[0] == 0.0 and first.period == pytest.approx(5e-3) and first.is_answered.all()
