"""Sessions that command poses: a cycle of the loop without sockets, and a client with its process."""

from __future__ import annotations

import itertools
import math
import time
from dataclasses import replace

import numpy as np
import pytest

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.fri.guard.fallback import Missing, Policy
from heptarm.fri.guard.pose_guard import PoseLimits
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.client import Client
from heptarm.fri.loop.user_api import Output, Params, State
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.messages import CommandMode, SessionState
from heptarm.fri.protocol.version import Version
from heptarm.values.pose import Pose
from tests.oracles.fri import codec
from tests.oracles.fri.cycle import from_wire
from tests.oracles.fri.pose_guard import between

from .controller import Controller
from .laws import fails_later, lift
from .test_cycle import Bench

#: What the controller names as the interpolator's pose [m, x y z w].
HOME = (0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0)
NAN = math.nan


def posing(*, wire: Version = Version.V2_5, **settings: object) -> Bench:
    bench = Bench(wire=wire, **settings)  # type: ignore[arg-type]
    bench.controller.mode = CommandMode.CARTESIAN_POSE
    bench.activate()
    return bench


def command(bench: Bench, pose: tuple[float, ...]) -> None:
    words = np.zeros(at.COMMAND_WORDS)
    words[at.C_POSE : at.C_POSE + 7] = pose
    bench.give(words, at.GIVEN_POSE)


def sent(bench: Bench, count: int) -> np.ndarray:
    """The last poses that were sent, shape (count, 7)."""
    return np.array([from_wire(one.pose.values) for one in bench.sent[-count:] if one.pose is not None])


@pytest.mark.parametrize("wire", [Version.V2_5, Version.V2_7])
def test_without_a_command_the_interpolator_is_mirrored(wire: Version) -> None:
    bench = posing(wire=wire)
    bench.run(5)
    assert bench.sent[-1].q is None and sent(bench, 5) == pytest.approx(np.tile(HOME, (5, 1)))
    last = bench.states[-1]
    assert last.pose_ipo.array.tolist() == pytest.approx(HOME) and not last.is_limited
    assert last.pose_sent.array.tolist() == pytest.approx(HOME) and math.isnan(last.q_sent[0])
    with pytest.raises(CommandRejected, match="no pose is commanded"):
        _ = bench.states[0].pose_sent


def test_a_commanded_pose_is_reached_without_a_jump_and_reported_in_metres() -> None:
    bench = posing()
    goal = Pose.of((0.15, 0.2, 0.3), (0.0, 0.0, math.sin(0.1), math.cos(0.1)))
    command(bench, tuple(goal.array.tolist()))
    bench.run(800)
    track = sent(bench, 803)
    speeds = np.array([between(*two) for two in itertools.pairwise(track)]) * 1e3
    assert np.linalg.norm(speeds[:, :3], axis=1).max() <= 0.2500001
    assert np.abs(np.diff(speeds[:, :3], axis=0)).max() * 1e3 <= 1.000001
    assert bench.states[-1].pose_sent.array.tolist() == pytest.approx(goal.array.tolist())
    name, values = bench.sent[-1].pose.name, bench.sent[-1].pose.values
    assert name == "ipo" and values == pytest.approx(
        (150.0, 200.0, 300.0, math.cos(0.1), 0.0, 0.0, math.sin(0.1))
    )
    assert bench.counters.limited > 100
    assert any("flange: velocity limited" in line for line in bench.limited)


def test_a_law_begins_at_the_interpolators_pose() -> None:
    bench = posing(law=lift, height=0.02)
    bench.run(600)
    assert sent(bench, 1)[0] == pytest.approx((0.1, 0.2, 0.32, 0.0, 0.0, 0.0, 1.0))
    bench.controller.walk(SessionState.MONITORING_READY, pause=0.0)
    bench.run(3)
    bench.activate()
    bench.run(1)
    assert sent(bench, 1)[0] == pytest.approx(HOME, abs=1e-5), "the next one begins there again"


def test_a_law_may_assign_a_pose_and_numbers_that_are_none_keep_the_last_target() -> None:
    def law(state: State, out: Output, params: Params) -> None:
        out.pose = Pose.at(0.1, 0.2, 0.31) if state.t < 0.4 else np.full(7, NAN)

    bench = posing(law=law)
    bench.run(900)
    assert sent(bench, 1)[0] == pytest.approx((0.1, 0.2, 0.31, 0.0, 0.0, 0.0, 1.0))
    assert any("target not finite" in line for line in bench.limited)


def test_a_law_that_fails_brakes_the_flange() -> None:
    bench = posing(law=fails_later)
    bench.run(200)
    assert bench.cycle.may_end
    assert sent(bench, 1)[0] == pytest.approx(HOME)


@pytest.mark.parametrize("missing", list(Missing))
def test_commands_that_stay_away(missing: Missing) -> None:
    bench = posing(policy=Policy(missing, patience=0.05, over=0.1))
    for k in range(300):  # 0.1 m/s
        command(bench, (0.1 + 1e-4 * k, *HOME[1:]))
        bench.run(1)
    assert sent(bench, 1)[0, 0] == pytest.approx(0.1 + 1e-4 * 299, abs=1e-3)
    bench.run(1000)
    end = sent(bench, 2)
    assert (end[0] == end[1]).all() and bench.states[-1].is_filled
    on = end[-1, 0] - (0.1 + 1e-4 * 299)
    if missing is Missing.HOLD:
        assert on == pytest.approx(0.0, abs=1e-9)
    elif missing is Missing.EXTRAPOLATE:  # 0.15 s on, then v²/2a
        assert on == pytest.approx(0.015 + 0.005, abs=1e-3)
    else:
        assert -1e-3 < on < 0.006


def test_an_interpolator_in_motion_is_taken_over_and_lost_messages_are_caught_up() -> None:
    bench = Bench(wire=Version.V2_5, law=lift, height=0.0)
    bench.controller.mode = CommandMode.CARTESIAN_POSE
    original, x = bench.controller.datagram, [100.0]

    def moving() -> bytes:
        ipo = m.Transformation("ipo", (x[0], 200.0, 300.0, 1.0, 0.0, 0.0, 0.0))
        message = with_pose(original(), ipo)
        x[0] += 0.1  # 0.1 m/s
        return message

    bench.controller.datagram = moving  # type: ignore[method-assign]
    bench.run(3, SessionState.MONITORING_READY)
    bench.run(20, SessionState.COMMANDING_WAIT)
    bench.run(50, SessionState.COMMANDING_ACTIVE)
    assert bench.counters.limited == 0
    bench.controller.sequence += 3  # three messages are lost
    bench.now += 3_000_000
    x[0] += 0.3
    bench.run(1)
    assert bench.counters.limited == 0
    assert sent(bench, 1)[0, 0] * 1e3 == pytest.approx(x[0] - 0.1)


def test_the_elbow_is_commanded_with_a_pose() -> None:
    bench = Bench(wire=Version.V2_5)
    bench.controller.mode = CommandMode.CARTESIAN_POSE
    bench.controller.redundancy = m.Redundancy(m.RedundancyStrategy.E1, 0.1)
    bench.activate()
    bench.run(3)
    assert bench.sent[-1].redundancy == m.Redundancy(m.RedundancyStrategy.E1, 0.1), (
        "mirrored until it is wanted"
    )
    words = np.zeros(at.COMMAND_WORDS)
    words[at.C_E1] = 0.4
    bench.give(words, at.GIVEN_E1)
    bench.run(1500)
    redundancy = bench.sent[-1].redundancy
    assert redundancy is not None and redundancy.value == 0.4 and sent(bench, 1)[0] == pytest.approx(HOME)
    last = bench.states[-1]
    assert last.e1_sent == 0.4 and last.e1_ipo == 0.1
    assert any("elbow: velocity limited" in line for line in bench.limited)
    steps = np.diff([one.redundancy.value for one in bench.sent[-1500:] if one.redundancy is not None])
    assert steps.max() <= 0.5e-3 * 1.000001


def test_after_a_long_silence_a_flange_that_went_on_is_not_halted() -> None:
    bench = posing()
    original, measured = bench.controller.datagram, [100.0]

    def named() -> bytes:
        value = codec.decode_monitoring(original(), Version.V2_5)
        assert value.monitor is not None
        pose = m.Transformation("measured", (measured[0], 200.0, 300.0, 1.0, 0.0, 0.0, 0.0))
        return codec.encode_monitoring(
            replace(value, monitor=replace(value.monitor, pose=pose)), Version.V2_5
        )

    bench.controller.datagram = named  # type: ignore[method-assign]
    command(bench, (0.9, *HOME[1:]))
    for _ in range(600):
        bench.run(1)
        measured[0] = 1e3 * sent(bench, 1)[0, 0]
    before = sent(bench, 2)[:, 0]
    speed = before[1] - before[0]
    assert speed == pytest.approx(0.25e-3)
    for kept in (1.0, 0.0):  # it continues; the next time it rests
        last = sent(bench, 1)[0, 0]
        bench.now += 60_000_000
        bench.controller.sequence += 60
        measured[0] += 1e3 * 60 * speed * kept
        bench.run(1)
        step = sent(bench, 1)[0, 0] - last
        assert step == pytest.approx(speed * 61 * kept, abs=1.1 * speed)
        bench.run(1)
        after = sent(bench, 2)[:, 0]
        assert after[1] - after[0] == pytest.approx(kept * speed, abs=5e-6)


def with_pose(raw: bytes, pose: m.Transformation) -> bytes:
    """A datagram with another interpolator's pose."""
    value = codec.decode_monitoring(raw, Version.V2_5)
    if value.ipo is not None:
        value = replace(value, ipo=replace(value.ipo, pose=pose))
    return codec.encode_monitoring(value, Version.V2_5)


def test_the_client_takes_poses_from_the_users_process() -> None:
    keep, quick = Policy(Missing.HOLD), PoseLimits(velocity=2.0, acceleration=50.0)
    with Client(0, realtime=False, policy=keep, pose_limits=quick) as client:
        controller = Controller(client.port, wire=Version.V2_5, mode=CommandMode.CARTESIAN_POSE)
        with controller.running():
            controller.active()
            home = client.wait("COMMANDING_ACTIVE").pose
            goal = Pose.at(0.0, 0.0, 0.05) @ home
            deadline = time.monotonic() + 20.0
            while time.monotonic() < deadline:
                client.command(pose=goal)
                s = client.next()
                if s.is_answered and s.pose_sent.distance_to(goal) < 1e-9:
                    break
            assert s.pose_sent.distance_to(goal) < 1e-9 and s.pose_ipo.distance_to(home) == 0.0
            client.command(pose=[NAN, NAN, 0.3, NAN, NAN, NAN, NAN])  # down again
            while time.monotonic() < deadline and s.pose_sent.distance_to(home) > 1e-9:
                s = client.next()
            assert s.pose_sent.distance_to(home) < 1e-9
        assert any("flange: acceleration limited" in line for line in client.limited)
        assert any("flange: target not finite" in line for line in client.limited)


def test_what_is_no_pose_is_refused_at_once() -> None:
    with Client(0, realtime=False) as client:
        with pytest.raises(ShapeError, match=r"pose must have shape \(7,\), got \(3,\)"):
            client.command(pose=[0.1, 0.2, 0.3])
        with pytest.raises(ShapeError, match="norm 1, got 2"):
            client.command(pose=[0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 2.0])
        with pytest.raises(LimitError, match=r"pose\[0\]"):
            client.command(pose=[math.inf, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0])
