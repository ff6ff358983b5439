"""The arm against the virtual cabinet: the real application on a real JVM, a simulated robot."""

from __future__ import annotations

import asyncio
import os
import queue
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm import Arm
from heptarm.arm.link.local_simulator import PrivateCabinet
from heptarm.arm.link.target import Target
from heptarm.values.motion.line import lin_rel
from heptarm.values.motion.motion import hold
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import deg
from tests.arm.programs import end, script
from tests.conftest import RunningCabinet
from tests.interrupts import ctrl_c_interrupts

SPEED = 1.0  # programs are interrupted and stopped at moments of this machine's time

HOME = deg(0, 30, 0, -90, 0, 60, 0)
#: Takes about three seconds.
FAR = ptp(deg(60, 30, 0, -90, 0, 60, 0), speed=0.3)


def speed(arm: Arm) -> float:
    return float(np.abs(arm.state.dq).max())


def under_way(arm: Arm) -> None:
    arm.wait_until(lambda s: np.abs(s.dq).max() > 0.1, timeout=20.0)


# ------------------------------------------------------------------------------------- moving


def test_a_ptp_arrives(arm: Arm) -> None:
    target = deg(10, 35, 5, -80, 5, 55, 10)
    result = arm.move(ptp(target, speed=0.5))
    assert result.arrived and result.residual <= 1e-4
    assert result.state is not None
    assert np.abs(result.state.q - target).max() <= 1e-4
    assert 0.3 < result.duration < 5.0


def test_a_line_and_back_by_its_pose(arm: Arm) -> None:
    before = arm.wait_for_rest().pose
    arm.move(lin_rel(z=-0.08, frame="base", speed_mps=0.25))
    down = arm.wait_for_rest().pose
    assert np.abs(down.xyz - before.xyz - [0, 0, -0.08]).max() < 5e-4 and down.angle_to(before) < 2e-3
    arm.move(ha.lin(before, speed_mps=0.25))
    assert arm.wait_for_rest().pose.distance_to(before) < 5e-4


def test_a_batch_reports_where_it_is(arm: Arm) -> None:
    small = [ptp(HOME + deg(0, 0, 0, 0, 0, 0, angle)) for angle in (5, 10, 0)]
    handle = arm.start(small)
    assert handle.wait(timeout=20.0).item == 2
    assert handle.progress == 1.0 and handle.done


def test_a_motion_is_cancelled_under_way(arm: Arm) -> None:
    handle = arm.start(FAR)
    under_way(arm)
    assert handle.started and not handle.done and 0.0 < handle.progress < 0.9
    handle.cancel()
    result = handle.wait(timeout=20.0)
    assert result.cause is ha.Cause.CANCELLED and handle.result is result
    state = arm.wait_for_rest(timeout=20.0)
    assert 0.001 < state.q[0] - HOME[0] < np.radians(59)


def test_stop_from_another_thread_ends_a_blocking_move(arm: Arm) -> None:
    stopper = threading.Thread(target=lambda: (under_way(arm), arm.stop()))
    before = arm.state.stamp
    arm.wait_until(lambda s: s.stamp > before + 5e8, timeout=20.0)  # something for the history
    stopper.start()
    with pytest.raises(ha.MotionAborted) as error:
        arm.move(FAR)
    stopper.join()
    assert error.value.cause is ha.Cause.STOPPED and len(error.value.history) >= 20
    arm.wait_for_rest(timeout=20.0)
    arm.stop()
    arm.stop()


def test_queue_replace_reject(arm: Arm) -> None:
    first = arm.start(FAR)
    under_way(arm)
    with pytest.raises(ha.ModeConflict, match="running") as error:
        arm.start(ptp(HOME), when="reject")
    assert "replace" in str(error.value)
    waiting = arm.start(ptp(HOME))
    last = arm.start(ptp(HOME), when="replace")
    assert last.wait(timeout=20.0).arrived
    assert first.wait(timeout=20.0).cause is ha.Cause.REPLACED
    assert waiting.wait(timeout=20.0).cause is ha.Cause.REPLACED


def test_motions_can_be_awaited_together(arm: Arm) -> None:
    async def program() -> list[ha.Result]:
        near = ptp(HOME + deg(3, 0, 0, 0, 0, 0, 0))
        return list(await asyncio.gather(*(_await(arm.start(m)) for m in (near, ptp(HOME)))))

    assert all(result.arrived for result in asyncio.run(program()))


def test_a_stop_names_its_author(arm: Arm, cabinet: RunningCabinet) -> None:
    with ha.connect(cabinet.target, control=False, name="bystander") as other:
        handle = arm.start(FAR)
        under_way(arm)
        other.stop()
        with pytest.raises(ha.MotionAborted, match=r"was stopped by bystander at 127\.0\.0\.1"):
            handle.wait(timeout=30.0)
    handle = arm.start(FAR)
    under_way(arm)
    arm.stop()
    with pytest.raises(ha.MotionAborted, match=r"was stopped by .+ at 127\.0\.0\.1"):
        handle.wait(timeout=30.0)


def test_an_await_that_times_out_brakes_the_arm(arm: Arm) -> None:
    async def program() -> ha.MotionHandle:
        handle, behind = arm.start(FAR), arm.start(ptp(HOME))
        await asyncio.to_thread(under_way, arm)
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(handle, 0.01)
        assert handle.done
        with pytest.raises(ha.MotionAborted):
            await behind
        return handle

    handle = asyncio.run(program())
    assert isinstance(handle.error, ha.MotionAborted) and handle.error.cause is ha.Cause.STOPPED
    assert arm.wait_for_rest(timeout=30.0).q[0] < np.radians(59)


async def _await(handle: ha.MotionHandle) -> ha.Result:
    return await handle


def test_a_hold_lasts(arm: Arm) -> None:
    assert 0.25 < arm.move(hold(0.3)).duration < 5.0


def test_the_ceiling_slows_down(arm: Arm) -> None:
    target = ptp(HOME + deg(20, 0, 0, 0, 0, 0, 0))
    fast = arm.move(target).duration
    arm.speed = 0.1
    assert arm.move(ptp(HOME)).duration > 1.5 * fast


# ------------------------------------------------------------------------------------- refusals


def test_refusals_say_why_and_move_nothing(arm: Arm) -> None:
    before = arm.wait_for_rest().q
    with pytest.raises(ha.LimitError, match="A2"):
        arm.move(ptp(deg(0, 130, 0, 0, 0, 0, 0)))
    with pytest.raises(ha.LimitError, match="finite"):
        arm.move(ptp([0, 0, 0, 0, 0, 0, float("inf")]))
    with pytest.raises((ha.LimitError, ha.MotionAborted), match="(?i)can not plan|not reachable|limit"):
        arm.move(lin_rel(z=3.0))
    with pytest.raises(ha.LimitError, match=r"\[0, 1\]"):
        arm.set_override(1.5)
    with pytest.raises(ha.LimitError, match="rate"):
        arm.subscribe(rate=5000.0)
    assert np.abs(arm.wait_for_rest().q - before).max() < 1e-4
    assert arm.move(ptp(HOME)).arrived


def test_the_second_controller_hears_who_controls(arm: Arm, cabinet: RunningCabinet) -> None:
    with pytest.raises(ha.NotInControl, match=str(os.getpid())):
        ha.connect(cabinet.target, name="second")
    assert arm.in_control


def test_an_observer_sees_and_stops_but_does_not_move(arm: Arm, cabinet: RunningCabinet) -> None:
    with ha.connect(cabinet.target, control=False, name="observer") as observer:
        assert observer.controller == arm.connection.options.name and not observer.in_control
        with pytest.raises(ha.NotInControl, match=str(os.getpid())):
            observer.move(ptp(HOME))
        handle = arm.start(FAR)
        under_way(observer)
        observer.stop()
        with pytest.raises(ha.MotionAborted):
            handle.wait(timeout=20.0)
        handle = arm.start(FAR)
        under_way(observer)
    assert not handle.done  # an observer that leaves stops nothing
    handle.cancel()
    handle.wait(timeout=20.0)


def test_two_clients_of_one_process_are_distinguished(arm: Arm, cabinet: RunningCabinet) -> None:
    with ha.connect(cabinet.target, control=False) as observer:
        with pytest.raises(ha.NotInControl) as refused:
            observer.move(ptp(HOME))
        mine, other = arm.connection.options.name, observer.connection.options.name
        assert mine != other and refused.value.text.startswith(f"{mine} controls the robot, not {other}")
        assert str(refused.value).count("take control first") == 1 and "allowed" not in str(refused.value)
    with (
        ha.connect(cabinet.target, control=False, name=mine) as twin,
        pytest.raises(ha.NotInControl) as refused,
    ):
        twin.move(ptp(HOME))
    assert f"another client named {mine}" in refused.value.text


def test_control_is_given_and_taken(arm: Arm, cabinet: RunningCabinet) -> None:
    with ha.connect(cabinet.target, control=False, name="other") as other:
        arm.release_control()
        other.take_control()
        with pytest.raises(ha.NotInControl, match="other"):
            arm.move(ptp(HOME))
        assert other.move(ptp(HOME)).arrived
        other.release_control()
        arm.take_control()
        assert arm.move(ptp(HOME)).arrived


# ------------------------------------------------------------------------------------- state


def test_pause_and_override_end_with_their_controller(cabinet: RunningCabinet) -> None:
    with ha.connect(cabinet.target, watchdog=5.0, timeout=30.0) as first:
        first.set_override(0.1)
        first.pause()
        first.wait_until(lambda state: state.safety.paused, timeout=20.0)
    with ha.connect(cabinet.target, watchdog=5.0, timeout=30.0) as second:
        second.wait_until(lambda state: not state.safety.paused, timeout=20.0)
        second.wait_until(lambda state: state.motion is not None and state.motion.override == 1.0)
        assert second.move(hold(0.1)).arrived


def test_states_come_at_the_subscribed_rate(arm: Arm) -> None:
    arm.subscribe(rate=500.0)
    states = arm.states(duration=30.0)
    stamps = np.array([state.stamp for state, _ in zip(states, range(450))])
    assert len(stamps) == 450
    assert (np.diff(stamps) > 0).all() and np.diff(stamps).min() <= 2e6
    assert len(stamps) <= (stamps[-1] - stamps[0]) * 1e-9 * 500.0 + 2  # those of a busy machine may be fewer
    ages = [state.age for state in arm.states(duration=0.5)]
    assert 0.0 <= min(ages) < 1.0


def test_arrays_are_read_only_and_consistent(arm: Arm) -> None:
    state = arm.wait_for_rest()
    for values in (state.q, state.q_cmd, state.dq, state.tau, state.tau_ext, state.tau_cmd):
        assert values.shape == (7,) and not values.flags.writeable
    assert state.wrench.force.shape == (3,)
    assert state.safety.ready_to_move and state.motion is not None and not state.motion.active


def test_requests_while_states_stream_and_the_arm_moves(arm: Arm) -> None:
    arm.subscribe(rate=500.0)
    handle = arm.start(ptp(HOME + deg(20, 0, 0, 0, 0, 0, 0), speed=0.3))
    for _ in range(300):
        arm.set_override(1.0)
    assert handle.wait(timeout=20.0).arrived


# ------------------------------------------------------------------------------------- leaving


def test_leaving_the_block_leaves_the_arm_at_rest(cabinet: RunningCabinet) -> None:
    with ha.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:
        handle = arm.start(FAR)
        under_way(arm)
    with pytest.raises((ha.MotionAborted, ha.ConnectionLost)):
        handle.wait(timeout=20.0)
    with ha.connect(cabinet.target, control=False, timeout=30.0) as observer:
        state = observer.state
        assert state.motion is not None and not state.motion.active
        assert not np.abs(state.dq[np.isfinite(state.dq)]).max() > 0.01
        assert observer.controller == ""


MOVES = """
    import sys, heptarm as ha
    from heptarm.modes import compliance
    from heptarm.when import force
    with ha.connect(sys.argv[1], watchdog=10.0, timeout=30.0) as arm:
        before = set(sys.modules)
        arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)))
        arm.move([ha.lin_rel(z=-0.01), ha.lin_rel(z=0.01)], mode=compliance("z"), until=force > 50)
        for kind, target in (("joint", None), ("pose", None), ("twist", (0.0,) * 6), ("velocity", (0.0,) * 7)):
            with arm.servo(kind, rate=50) as servo:
                own = servo.start.q if kind == "joint" else servo.start.pose
                for _ in range(3):
                    servo.tick()
                    servo.set(own if target is None else target)
        handle = arm.start(ha.ptp(ha.deg(9, 30, 0, -90, 0, 60, 0), speed=0.05))
        arm.wait_until(lambda state: state.motion.active)
        arm.stop()
        try:
            handle.wait()
        except ha.MotionAborted as error:
            str(error), error.history, str(arm.state)
        print("loaded", sorted(set(sys.modules) - before))
"""


def test_nothing_is_loaded_while_the_arm_moves(cabinet: RunningCabinet, tmp_path: Path) -> None:
    """A module that is loaded late needs an open file, and time, in the middle of a motion."""
    file = tmp_path / "program.py"
    file.write_text(textwrap.dedent(MOVES))
    command = [sys.executable, str(file), cabinet.target]
    run = subprocess.run(command, capture_output=True, text=True, timeout=120.0, check=False)
    assert run.stdout.strip() == "loaded []", run.stderr


def test_ctrl_c_stops_the_arm(cabinet: RunningCabinet, tmp_path: Path) -> None:
    process, said = script(tmp_path, cabinet.target)
    assert said == "moving"
    time.sleep(0.2)  # it has printed so, now it waits
    process.send_signal(signal.SIGINT)
    out, errors = end(process)
    assert "interrupted" in out, (out, errors)
    assert "KeyboardInterrupt" in errors and process.returncode != 0
    assert float(out.split()[-1]) < np.radians(55)
    with ha.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:
        assert speed(arm) < 0.01


def test_ctrl_c_amid_requests_breaks_nothing(arm: Arm) -> None:
    delays: queue.SimpleQueue[float | None] = queue.SimpleQueue()

    def interrupt() -> None:
        while (delay := delays.get()) is not None:
            time.sleep(delay)
            os.kill(os.getpid(), signal.SIGINT)

    # one thread for all: where one ends, a callback of `threading` runs, and Python loses an interrupt in a callback
    hand = threading.Thread(target=interrupt)
    hand.start()
    try:
        with ctrl_c_interrupts():
            for count in range(40):
                with pytest.raises(KeyboardInterrupt):
                    delays.put(0.002 + count * 1e-4)
                    deadline = time.monotonic() + 30.0
                    while time.monotonic() < deadline:
                        arm.set_override(1.0)
                assert arm.connected
                arm.stop()
    finally:
        delays.put(None)
        hand.join()


def test_a_killed_controller_is_stopped_and_replaced(cabinet: RunningCabinet, tmp_path: Path) -> None:
    with ha.connect(cabinet.target, control=False, timeout=30.0) as observer:
        for _ in range(2):
            process, said = script(tmp_path, cabinet.target)
            assert said == "moving"
            assert observer.controller == "script"
            process.kill()
            # its watchdog time is longer: the end of the connection shows the loss
            observer.wait_until(lambda s: np.abs(s.dq).max() < 0.01 and not s.motion.active, timeout=8.0)
            end(process)
            observer.wait_until(lambda s: observer.controller == "", timeout=20.0)
            with ha.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:
                assert arm.move(ptp(HOME)).arrived


def test_a_frozen_controller_loses_control_and_learns_it(cabinet: RunningCabinet, tmp_path: Path) -> None:
    with ha.connect(cabinet.target, control=False, timeout=30.0) as observer:
        process, said = script(tmp_path, cabinet.target, watchdog=1.0)
        assert said == "moving"
        process.send_signal(signal.SIGSTOP)
        observer.wait_until(lambda s: np.abs(s.dq).max() < 0.01 and not s.motion.active, timeout=20.0)
        observer.wait_until(lambda s: observer.controller == "", timeout=20.0)
        process.send_signal(signal.SIGCONT)
        _, errors = end(process)
        assert "ConnectionLost" in errors and "lost its controller" in errors


def test_a_lost_controller_may_let_its_motion_finish(cabinet: RunningCabinet, tmp_path: Path) -> None:
    process, said = script(tmp_path, cabinet.target, "finish")
    assert said == "moving"
    process.kill()
    end(process)
    with ha.connect(cabinet.target, control=False, timeout=30.0) as observer:
        target = deg(60, 30, 0, -90, 0, 60, 0)
        observer.wait_until(lambda s: np.abs(s.q - target).max() < 1e-3, timeout=20.0)


# ------------------------------------------------------------------------------------- the key

KEY = "k7fh-9tqa-x2mn-p4cw-8r3e-vd6y-s5gj"


def test_the_key_opens_the_cabinet() -> None:
    cabinet = PrivateCabinet.start(Target(model="med7"), key=KEY)
    target = f"{cabinet.host}:{cabinet.port}"
    try:
        with ha.connect(target, key=KEY, timeout=30.0) as arm:
            assert arm.robot.name == "med7"
        with pytest.raises(ha.ConnectFailed, match="key is wrong"):
            ha.connect(target, key=KEY[::-1], timeout=30.0)
        with pytest.raises(ha.ConnectFailed, match="asks for a pre-shared key"):
            ha.connect(target, timeout=30.0)
    finally:
        cabinet.close()
