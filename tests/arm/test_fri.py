"""FRI sessions through the whole stack: API, TCP, Java application, doubles, plant, and UDP to the loop's process."""

from __future__ import annotations

import contextlib
import functools
import math
import os
import signal
import socket
import struct
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm import laws
from heptarm.arm.fri.settings import request as request_of
from heptarm.fri import Output, State
from heptarm.fri.guard.fallback import Missing, Policy
from heptarm.fri.guard.joint_guard import Limits
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.protocol.messages import Quality, Safety, SessionState
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.sine import SineImpedance
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.conftest import RunningCabinet
from tests.descriptors import refused_with_fewer
from tests.long import few
from tests.retry import answers_late, retry

SPEED = 1.0  # FRI answers within milliseconds of this machine's time

A7 = np.array([0, 0, 0, 0, 0, 0, 1.0])
COMPLIANT = CartesianImpedance(stiffness=(1500, 1500, 1500, 150, 150, 150))
#: Long enough for a busy machine.
LONG = 10


@pytest.fixture
def arm(cabinet: RunningCabinet) -> Iterator[ha.Arm]:
    """At its home, with a watchdog that a busy machine does not trip."""
    with ha.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:
        home = ha.deg(0, 30, 0, -90, 0, 60, 0)
        if abs(arm.state.q - home).max() > 1e-3:
            arm.move(ha.ptp(home))
        yield arm


def patient(test: Callable[..., None]) -> Callable[..., None]:
    """Repeat a test if this machine was too busy to answer in time."""

    @functools.wraps(test)
    def tried(*arguments: Any, **named: Any) -> None:
        retry(lambda: test(*arguments, **named), answers_late)

    return tried


def swing(s: State, out: Output, p: Any) -> None:
    out.q[6] += p.amplitude * (1.0 - math.cos(2.0 * s.t)) / 2.0


def push(s: State, out: Output, p: Any) -> None:
    out.tau[6] = p.torque * min(s.t, 1.0)


def press(s: State, out: Output, p: Any) -> None:
    out.wrench[:3] = p.force * min(s.t, 1.0)


def fail(s: State, out: Output, p: Any) -> None:
    out.q[6] += 0.05 * (1.0 - math.cos(2.0 * s.t))
    if s.t > 0.3:
        raise ZeroDivisionError("nothing to divide by")


@patient
def test_a_law_moves_the_arm_and_its_parameters_change_while_it_runs(arm: ha.Arm) -> None:
    with arm.fri("position", period_ms=LONG, law=swing, params={"amplitude": 0.0}) as rt:
        start = rt.start.q_ipo.copy()
        assert rt.wait(0.2) and np.abs(rt.state.q - start).max() < 1e-3
        rt.params.amplitude = 0.05
        assert rt.wait(2.0) and rt.active
        assert rt.session is SessionState.COMMANDING_ACTIVE and rt.quality >= Quality.GOOD
        seen = [s for s in rt.history() if s.is_commanding]
        turned = max(s.q[6] - start[6] for s in seen)
    assert 0.03 < turned < 0.06
    # the arm is at the commanded position at most two messages later
    reported = np.array([s.q_sent for s in seen])
    found = np.array([s.q for s in seen])
    assert min(np.abs(found[2:] - reported[k : len(reported) - 2 + k]).max() for k in range(3)) < 3e-3
    assert rt.result is not None and rt.result.cause is ha.Cause.CANCELLED
    assert rt.stats.commanded > 100 and not rt.active
    assert "quality" in rt.report and "latency" in rt.report
    assert np.abs(arm.wait_for_rest().dq).max() < 0.01


@patient
def test_the_simple_form_commands_in_the_loop_and_the_next_session_needs_nothing(arm: ha.Arm) -> None:
    for turn in (0.05, 0.0):
        with arm.fri("position", period_ms=LONG) as rt:
            goal = rt.start.q_ipo + (turn - rt.start.q_ipo[6]) * A7
            last = -1
            for s in rt:
                assert s.sequence > last and s.is_commanding
                last = s.sequence
                rt.command(q=goal)
                if np.abs(s.q - goal).max() < 2e-3:
                    break
        assert rt.next() is None  # and no more messages arrive
    assert rt.limited and "A7" in rt.report  # a jump was commanded; the guard turned it into a motion


@patient
def test_the_guard_makes_a_step_a_motion_and_names_what_it_limited(arm: ha.Arm) -> None:
    limits = Limits.of(arm.robot, fraction=0.2)
    policy = Policy(Missing.HOLD)
    with arm.fri("position", period_ms=LONG, policy=policy, limits=limits) as rt:
        goal = rt.start.q_ipo + 0.4 * A7
        rt.command(q=np.where(A7, goal, np.nan))
        for s in rt:
            if abs(s.q[6] - goal[6]) < 2e-3:
                break
        sent = {s.sequence: s.q_sent[6] for s in rt.history() if s.is_answered and s.is_commanding}
    steps = [abs(sent[k + 1] - sent[k]) for k in sent if k + 1 in sent]
    assert 0.1 < max(steps) / (LONG * 1e-3) < 1.001 * 0.2 * arm.robot.dq_max[6]
    assert any("A7: velocity limited" in line for line in rt.limited)


@pytest.mark.long  # every run has torques and a wrench with the benchmark of test_fri_hold
@pytest.mark.long  # every run has it with the benchmark of test_fri_hold, and without the stack in tests/sim_fri
@patient
def test_torques_bend_the_springs_of_joint_impedance(arm: ha.Arm) -> None:
    with arm.fri("torque", period_ms=5, mode=JointImpedance(100.0), law=push, params={"torque": 2.0}) as rt:
        start = rt.start.q.copy()
        assert rt.wait(2.0)
        bent = rt.state.q - start
    assert 0.015 < bent[6] < 0.025 and np.abs(bent[:6]).max() < 0.01


@pytest.mark.long  # every run has torques and a wrench with the benchmark of test_fri_hold
@pytest.mark.long  # as that
@patient
def test_a_wrench_bends_those_of_cartesian_impedance(arm: ha.Arm) -> None:
    before = arm.state.pose.xyz
    params = {"force": [0.0, 0.0, 15.0]}
    with arm.using(COMPLIANT), arm.fri("wrench", period_ms=LONG, law=press, params=params) as rt:
        assert rt.wait(2.0)
        moved = arm.state.pose.xyz - before
    assert 0.007 < moved[2] < 0.013 and np.abs(moved[:2]).max() < 0.003


@patient
def test_a_monitor_is_a_source_of_states_beside_any_motion(arm: ha.Arm) -> None:
    home = arm.state.q
    with arm.fri("monitor", period_ms=2) as rt:
        handle = arm.start(ha.ptp(home + 0.1 * A7), speed=0.3)
        seen = []
        for s in rt:
            seen.append(s.q[6])
            if handle.done:
                break
        assert handle.wait().arrived
        with pytest.raises(ha.ModeConflict, match="not commanded"):
            rt.command(q=home)
        arm.move(ha.ptp(home))
    assert rt.result is None and len(seen) > 10 and max(seen) - min(seen) > 0.09
    assert rt.stats.commanded == 0 and "monitor" in repr(rt)


@pytest.mark.parametrize(
    ("kind", "mode", "code"),
    [
        ("torque", None, Code.MODE_CONFLICT),
        ("torque", COMPLIANT, Code.MODE_CONFLICT),
        ("wrench", None, Code.MODE_CONFLICT),
        ("wrench", JointImpedance(300.0), Code.MODE_CONFLICT),
        ("position", SineImpedance.sine("z", frequency=1.0, amplitude=5.0), Code.MODE_CONFLICT),
        ("pose", None, Code.UNSUPPORTED),
    ],
)
def test_what_does_not_go_together_is_refused_here_as_it_is_there(
    arm: ha.Arm, kind: str, mode: object, code: Code
) -> None:
    with pytest.raises(ha.CommandRejected) as here:
        arm.fri(kind, mode=mode)  # type: ignore[arg-type]
    from heptarm.arm.translate.modes import mode_message

    message = wire.FriOpen(
        host="127.0.0.1",
        port=30299,
        period=0.005,
        command=wire.FriCommandMode[kind.upper()],
        mode=mode_message(mode),  # type: ignore[arg-type]
    )
    with pytest.raises(ha.CommandRejected) as there:
        arm.connection.request(message)
    assert here.value.code == there.value.code == code
    assert type(here.value) is type(there.value) and here.value.hint


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        ({"kind": "force"}, "monitor"),
        ({"period_ms": 2.5}, "whole number"),
        ({"period_ms": 0}, "from 1 to 100"),
        ({"period_ms": 20}, "at least every 10 ms"),
        ({"period_ms": 5, "multiplier": 3}, "at least every 10 ms"),
        ({"multiplier": 0}, "multiplier"),
        ({"timeout": 0.0}, "timeout"),
        ({"port": 70000}, "port"),
        ({"host": "127.0.0.1\0"}, "host must have printable characters only"),
        ({"params": {"a": 1.0}}, "need a law"),
        ({"kind": "monitor", "law": swing}, "takes no law"),
        ({"mode": "soft"}, "mode"),
    ],
)
def test_bad_settings_are_refused_before_anything_is_sent(
    arm: ha.Arm, settings: dict[str, Any], word: str
) -> None:
    with pytest.raises(ha.CommandRejected, match=word):
        arm.fri(**settings)


@patient
def test_a_ready_law_of_torques_has_its_mode_and_needs_a_session_that_commands_them(arm: ha.Arm) -> None:
    law = laws.cartesian_impedance()
    alone = request_of(arm.connection, "torque", law=law).message.mode
    assert alone == request_of(arm.connection, "torque", mode=JointImpedance(0.0), law=law).message.mode
    stiffer = request_of(arm.connection, "torque", mode=JointImpedance(50.0), law=law).message.mode
    assert stiffer != alone
    for kind in ("position", "wrench"):
        with pytest.raises(ha.ModeConflict, match="commands tau, which is not commanded") as caught:
            arm.fri(kind, mode=COMPLIANT, law=law)
        assert 'arm.fri("torque"' in caught.value.hint
    arm.fri("wrench", mode=COMPLIANT, law=laws.minimum_jerk())  # moves the positions below the wrench
    with pytest.raises(ha.ModeConflict, match="Cartesian impedance"):
        arm.fri("wrench", law=laws.search())  # how compliant, only the program knows


@patient
def test_only_one_thing_moves_the_arm_and_only_its_controller(arm: ha.Arm) -> None:
    handle = arm.start(ha.hold(30.0))
    with pytest.raises(ha.ModeConflict), arm.fri("position"):
        pass
    handle.cancel()
    handle.wait()
    with arm.fri("position", period_ms=LONG, law=swing, params={"amplitude": 0.0}) as rt:
        with pytest.raises(ha.ModeConflict):
            arm.start(ha.hold(1.0), when="reject")
        with pytest.raises(ha.ModeConflict, match="the law commands"):
            rt.command(q=arm.state.q)
        with pytest.raises(ha.ModeConflict, match=r'arm.fri\("torque"\)'):
            rt.command(tau=np.zeros(7))
        with pytest.raises(ha.ModeConflict, match=r'arm.fri\("pose"\)'):
            rt.command(pose=ha.Pose.at(0.5, 0.0, 0.5))
    with pytest.raises(ha.LocalProtocolError, match="used once"), rt:
        pass
    with pytest.raises(ha.LocalProtocolError, match="with block"):
        _ = arm.fri("position").start


# ------------------------------------------------------------------------------------ bad beginnings


def test_a_port_that_is_taken_is_named_with_the_remedy(arm: ha.Arm) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("0.0.0.0", 0))
        port = other.getsockname()[1]
        with (
            pytest.raises(ha.ConnectFailed, match=f"UDP port {port} cannot be bound.*another program"),
            arm.fri("monitor", port=port),
        ):
            pass


def udp_addresses(pid: int) -> set[str]:
    """Own addresses of the UDP sockets of a process."""
    inodes = set()
    for one in Path(f"/proc/{pid}/fd").iterdir():
        with contextlib.suppress(OSError):
            inodes.add(os.readlink(one))
    rows = [line.split() for line in Path("/proc/net/udp").read_text().splitlines()[1:]]
    found = [row[1].partition(":")[0] for row in rows if f"socket:[{row[9]}]" in inodes]
    return {socket.inet_ntoa(struct.pack("=I", int(address, 16))) for address in found}


@pytest.mark.skipif(sys.platform != "linux", reason="asks Linux")
def test_both_sides_use_the_interface_of_their_peer_only(arm: ha.Arm, cabinet: RunningCabinet) -> None:
    with arm.fri("monitor", period_ms=2) as rt:
        assert rt.next() is not None
        assert udp_addresses(rt.client._worker._process.pid) == {"127.0.0.1"}
        assert udp_addresses(cabinet.pid) == {"127.0.0.1"}


@pytest.mark.parametrize("kind", few(["position", "monitor"]))
def test_when_nothing_arrives_the_error_reports_where_to_look(arm: ha.Arm, kind: str) -> None:
    with (
        pytest.raises(ha.ConnectFailed, match="no FRI message arrived.*192.0.2.7.*firewall"),
        arm.fri(kind, period_ms=LONG, host="192.0.2.7", timeout=0.3),  # type: ignore[arg-type]
    ):
        pass
    with arm.fri("monitor", period_ms=2) as rt:  # and nothing has to be restarted
        assert rt.next() is not None


def test_another_version_is_reported_in_plain_words(arm: ha.Arm) -> None:
    with (
        pytest.raises(ha.ConnectFailed, match=r"the other side speaks FRI 1\.x.*this side FRI 2.7"),
        arm.fri("position", period_ms=LONG, version="2.7", timeout=2.0),
    ):
        pass
    with pytest.raises(ha.CommandRejected, match="must be one of"), arm.fri("monitor", version="1.99"):
        pass


# ------------------------------------------------------------------------------------------ bad ends


@patient
def test_a_law_that_fails_brakes_the_arm_and_is_reported(arm: ha.Arm) -> None:
    with (
        pytest.raises(ha.StreamError, match=r"the law failed.*ZeroDivisionError: nothing to divide by.*line"),
        arm.fri("position", period_ms=LONG, law=fail) as rt,
    ):
        assert not rt.wait(30.0) and not rt.active
        arm.wait_until(lambda state: np.abs(state.dq).max() < 0.01)
    assert rt.result is not None and rt.result.cause is ha.Cause.CANCELLED


@pytest.mark.long
@patient
def test_without_a_free_file_descriptor_neither_a_session_nor_a_recording_is_half_open(
    arm: ha.Arm, tmp_path: Path
) -> None:
    def session() -> None:
        with arm.fri("position", period_ms=5):
            pass

    def recording() -> None:
        with arm.record(tmp_path / "one.mcap"):
            pass

    refused_with_fewer(5, session)
    refused_with_fewer(1, recording)
    assert not list(tmp_path.iterdir())
    with arm.record(tmp_path / "one.mcap"), arm.fri("monitor", period_ms=5):
        assert arm.in_control


def test_a_stop_from_another_thread_ends_the_loop(arm: ha.Arm) -> None:
    with (
        pytest.raises(ha.MotionAborted, match="stopped") as error,
        arm.fri("position", period_ms=LONG) as rt,
    ):
        threading.Timer(0.2, arm.stop).start()
        for s in rt:
            rt.command(q=s.q_ipo)
        rt.command(q=rt.start.q)  # no longer has an effect
    assert error.value.cause is ha.Cause.STOPPED
    arm.wait_for_rest()


@patient
def test_a_loop_that_is_killed_loses_the_quality_and_the_next_one_works(arm: ha.Arm) -> None:
    # on a port of its own: the cabinet goes on sending to it, also if another test took it meanwhile
    with (
        pytest.raises(ha.QualityLost, match="quality is (POOR|FAIR).*process has ended"),
        arm.fri("position", period_ms=LONG, port=0, law=swing, params={"amplitude": 0.05}) as rt,
    ):
        os.kill(int(rt.client._header[at.PID]), signal.SIGKILL)
        assert not rt.wait(30.0)
    arm.wait_for_rest()
    with arm.fri("position", period_ms=LONG) as rt:
        assert rt.next() is not None


@pytest.mark.long  # tests/fri_loop have it with an overlay
def test_a_loop_that_stands_still_ends_a_monitor_too(arm: ha.Arm) -> None:
    with (
        pytest.raises(ha.QualityLost, match="has not answered well for 10.0 s.*quality (is )?(POOR|FAIR)"),
        arm.fri("monitor", period_ms=LONG, timeout=10.0) as rt,
    ):
        pid = int(rt.client._header[at.PID])
        os.kill(pid, signal.SIGSTOP)
        try:
            assert not rt.wait(30.0)
        finally:
            os.kill(pid, signal.SIGCONT)


@patient
def test_an_error_of_the_block_is_not_hidden_and_the_arm_rests(arm: ha.Arm) -> None:
    with pytest.raises(ZeroDivisionError), arm.fri("position", period_ms=LONG) as rt:
        rt.command(q=rt.start.q_ipo + 0.1 * A7)
        raise ZeroDivisionError
    arm.wait_for_rest()


@patient
def test_a_block_whose_end_got_no_answer_is_left_all_the_same(
    arm: ha.Arm, monkeypatch: pytest.MonkeyPatch
) -> None:
    home, request = arm.state.q, arm.connection.request

    def unanswered(message: Any, *rest: Any) -> Any:
        if isinstance(message, wire.FriClose):
            raise ha.Timeout("no answer")
        return request(message, *rest)

    with (
        monkeypatch.context() as patch,
        pytest.raises(ha.Timeout, match="no answer"),
        arm.fri("position", period_ms=LONG) as rt,
    ):
        rt.command(q=rt.start.q_ipo)
        patch.setattr(arm.connection, "request", unanswered)
    # for want of answers the cabinet ends the session
    with contextlib.suppress(ha.ConnectFailed, ha.MotionAborted):
        arm.move(ha.ptp(home))
    assert arm.move(ha.ptp(home)).arrived


@patient
def test_a_block_that_ends_in_a_safety_stop_raises_it() -> None:
    with ha.connect("sim://iiwa14", watchdog=5.0, timeout=30.0) as arm:
        arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), speed=0.6)
        with (
            pytest.raises((ha.SafetyStop, ha.MotionAborted), match="emergency stop|safety stop|safeguard"),
            arm.fri("position", period_ms=LONG) as rt,
        ):
            assert rt.next() is not None
            arm.operator.fault("emergency_stop")  # and the block ends before the cabinet has reported that


@patient
def test_an_emergency_stop_ends_the_overlay_in_words_and_the_next_session_works() -> None:
    with ha.connect("sim://iiwa14", watchdog=5.0, timeout=30.0) as arm:
        arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), speed=0.6)
        for _ in range(2):
            with (
                arm.fri("monitor", period_ms=2) as watching,
                pytest.raises(ha.MotionAborted, match="emergency stop|safety stop 1") as error,
                arm.fri("position", period_ms=LONG, law=swing, params={"amplitude": 0.1}) as rt,
            ):
                assert rt.next() is not None
                arm.operator.fault("emergency_stop")
                assert not rt.wait(30.0)
                # the monitoring session continues
                assert next(s.safety for s in watching if s.safety) is Safety.STOP_1
            assert error.value.cause is ha.Cause.SAFETY
            with pytest.raises(ha.NeedsOperator, match="release the emergency stop"), arm.fri("position"):
                pass
            arm.operator.clear()
            assert arm.recover(timeout=30.0).done
