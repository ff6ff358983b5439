"""An arm in programs of several processes, and in asyncio."""

from __future__ import annotations

import asyncio
import subprocess
import sys
import textwrap
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

import heptarm as ha
from heptarm.wire import messages as wire
from tests.arm.peer import Peer
from tests.arm.test_moving import HOME
from tests.long import few

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows processes do not fork")

START = """
    import multiprocessing, os, signal, sys, threading
    import heptarm as ha
    from heptarm import deg, ptp

    HOME, FAR = ptp(deg(0, 30, 0, -90, 0, 60, 0)), ptp(deg(60, 30, 0, -90, 0, 60, 0), speed=0.3)

    def refusal(call):
        try:
            call()
        except ha.ConnectionLost as error:
            return str(error)
        return "no error"

    def check_inert(arm, handle):
        calls = [lambda: arm.state, lambda: arm.move(HOME), arm.stop, arm.reconnect, handle.wait]
        calls += [lambda: arm.wait_until(lambda s: True), lambda: next(arm.states()), lambda: arm.operator.do("aut")]
        for number, call in enumerate(calls):
            text = refusal(call)
            assert "fork" in text, (number, text)
        assert not arm.connected and not arm.in_control and handle.error is not None
        handle.cancel()  # no effect
        arm.close()
"""
FORK = """
    arm = ha.connect("sim://iiwa14", watchdog=5.0, timeout=30.0)
    arm.move(HOME)
    handle = arm.start(FAR)
    arm.wait_until(lambda s: abs(s.dq).max() > 0.1)
    child = os.fork()
    if child == 0:
        check_inert(arm, handle)
        sys.exit(7)  # a normal end, which runs what atexit has
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
    assert handle.wait().arrived
    assert arm.move(HOME).arrived and arm.in_control
    holder = os.fork()
    if holder == 0:
        signal.pause()
        os._exit(0)
    simulator = arm.connection.cabinet._process
    arm.close()
    assert simulator.returncode == 0, "it was killed, for the child holds its pipe"
    os.kill(holder, 9)
    os.waitpid(holder, 0)
    print("done")
"""
FORK_IN_BLOCKS = """
    with ha.connect("sim://iiwa14", watchdog=5.0, timeout=30.0) as arm:
        with arm.servo(rate=50, watchdog=2.0) as servo:
            servo.set(servo.start.q)
            child = os.fork()
            if child == 0:
                sys.exit(0)  # leaves both blocks
            for _ in range(10):
                servo.tick()
                servo.set(servo.start.q)
            assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
            assert servo.active
        assert arm.move(HOME).arrived
    print("done")
"""
MULTIPROCESSING = """
    def observe(target, results):
        with ha.connect(target, control=False, timeout=30.0) as arm:
            results.put([float(x) for x in arm.state.q])

    def inherit(results):
        results.put(refusal(lambda: arm.state))

    if __name__ == "__main__":
        arm = ha.connect("sim://iiwa14", watchdog=5.0, timeout=30.0)
        target = f"sim://127.0.0.1:{arm.connection.cabinet.port}"
        arm.move(HOME)
        for method in ("fork", "spawn"):
            context = multiprocessing.get_context(method)
            results = context.Queue()
            process = context.Process(target=observe, args=(target, results))
            process.start()
            assert abs(results.get(timeout=60.0) - arm.state.q).max() < 1e-3
            process.join(30.0)
            assert process.exitcode == 0
        context = multiprocessing.get_context("fork")
        results = context.Queue()
        process = context.Process(target=inherit, args=(results,))
        process.start()
        assert "fork" in results.get(timeout=30.0)
        process.join(30.0)
        assert process.exitcode == 0 and arm.in_control
        assert arm.move(FAR).arrived
        arm.close()
        print("done")
"""


@pytest.mark.parametrize(
    "program",
    few([FORK, MULTIPROCESSING, FORK_IN_BLOCKS]),
    ids=few(["fork", "multiprocessing", "fork in blocks"]),
)
def test_a_child_process_leaves_the_arm_of_its_parent_alone(tmp_path: Path, program: str) -> None:
    file = tmp_path / "program.py"
    file.write_text(textwrap.dedent(START) + textwrap.dedent(program))
    run = subprocess.run(
        [sys.executable, str(file)], capture_output=True, text=True, timeout=120.0, check=False
    )
    assert run.returncode == 0 and run.stdout.strip() == "done", run.stderr


def test_a_handle_is_awaited_beside_other_tasks(peer: Peer) -> None:
    peer.runs(1)
    ticks = 0

    async def tick() -> None:
        nonlocal ticks
        while True:
            await asyncio.sleep(0.01)
            ticks += 1
            if ticks == 3:  # the other task ran while the handle was awaited
                peer.tell(peer.finished(1))

    async def program(arm: ha.Arm) -> ha.Result:
        other = asyncio.create_task(tick())
        result = await arm.start(HOME)
        other.cancel()
        return result

    with peer.arm() as arm:
        assert asyncio.run(program(arm)).arrived
    assert ticks >= 3


async def _await(handle: ha.MotionHandle) -> ha.Result:
    return await handle


def test_an_awaited_handle_raises_its_error(peer: Peer) -> None:
    peer.runs(1, peer.finished(1, wire.Cause.SAFETY))

    async def program(arm: ha.Arm) -> None:
        handle = arm.start(HOME)
        with pytest.raises(ha.MotionAborted) as raised:
            await handle
        assert handle.error is raised.value

    with peer.arm() as arm:
        asyncio.run(program(arm))


# ----------------------------------------------------------------------------- cancelled waits in asyncio


def braked(peer: Peer) -> None:
    """The script: a motion begins, and only a stop ends it."""
    peer.runs(1, wire.MotionStarted(id=1, item=0))
    peer.expect(wire.Stop, wire.Accepted(id=0), peer.finished(1, wire.Cause.STOPPED))


async def by_wait_for(handle: ha.MotionHandle) -> None:
    await asyncio.wait_for(_await(handle), 0.05)


async def by_wait_for_itself(handle: ha.MotionHandle) -> None:
    await asyncio.wait_for(handle, 0.05)


async def by_timeout(handle: ha.MotionHandle) -> None:
    async with asyncio.timeout(0.05):
        await handle


async def by_another_task(handle: ha.MotionHandle) -> None:
    async def fails() -> None:
        await asyncio.sleep(0.05)
        raise TimeoutError

    try:
        async with asyncio.TaskGroup() as group:
            group.create_task(_await(handle))
            group.create_task(fails())
    except Exception as failure:
        assert [type(exception) for exception in failure.exceptions] == [TimeoutError]  # type: ignore[attr-defined]
        assert handle.done  # the group has ended: nothing of it goes on
        raise asyncio.TimeoutError from failure


async def by_gather(handle: ha.MotionHandle) -> None:
    try:
        await asyncio.wait_for(asyncio.gather(_await(handle), asyncio.sleep(60.0)), 0.05)
    except asyncio.TimeoutError:
        while not handle.done:  # gather itself does not wait for those that it cancels
            await asyncio.sleep(0.01)
        raise


async def by_cancel(handle: ha.MotionHandle) -> None:
    task = asyncio.create_task(_await(handle))
    await asyncio.sleep(0.05)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    raise asyncio.TimeoutError


_SINCE_3_11 = pytest.mark.skipif(sys.version_info < (3, 11), reason="of Python 3.11")


@pytest.mark.parametrize(
    "wait",
    [
        by_wait_for,
        by_wait_for_itself,
        pytest.param(by_timeout, marks=_SINCE_3_11),
        pytest.param(by_another_task, marks=_SINCE_3_11),
        by_gather,
        by_cancel,
    ],
)
def test_a_cancelled_await_brakes_the_arm(
    peer: Peer, wait: Callable[[ha.MotionHandle], Awaitable[None]]
) -> None:
    braked(peer)

    async def program(arm: ha.Arm) -> None:
        handle = arm.start(HOME)
        with pytest.raises(asyncio.TimeoutError):
            await wait(handle)
        assert handle.done and isinstance(handle.error, ha.MotionAborted)  # the wait lasts until then

    with peer.arm() as arm:
        asyncio.run(program(arm))


def test_a_shielded_await_lets_the_motion_go_on(peer: Peer) -> None:
    peer.runs(1, wire.MotionStarted(id=1, item=0))

    async def program(arm: ha.Arm) -> ha.Result:
        handle = arm.start(HOME)
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(asyncio.shield(handle), 0.05)
        await asyncio.sleep(0.05)
        assert not handle.done
        peer.tell(peer.finished(1))
        return await handle

    with peer.arm() as arm:
        assert asyncio.run(program(arm)).arrived
    assert not [message for message in peer.seen if isinstance(message, wire.Stop)][1:]


def test_a_second_cancellation_does_not_wait_for_the_end_of_the_motion(peer: Peer) -> None:
    peer.runs(1, wire.MotionStarted(id=1, item=0))
    peer.expect(wire.Stop, wire.Accepted(id=0))

    async def program(arm: ha.Arm) -> None:
        handle = arm.start(HOME)
        task = asyncio.create_task(_await(handle))
        await asyncio.sleep(0.05)
        task.cancel()
        await asyncio.sleep(0.05)
        assert not task.done()  # the arm brakes
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        assert not handle.done
        peer.tell(peer.finished(1, wire.Cause.STOPPED))

    with peer.arm() as arm:
        asyncio.run(program(arm))


def test_a_closed_coroutine_brakes_the_arm(peer: Peer) -> None:
    braked(peer)

    async def program(arm: ha.Arm) -> None:
        handle = arm.start(HOME)
        waiting = _await(handle)
        waiting.send(None)
        waiting.close()
        while not handle.done:
            await asyncio.sleep(0.01)

    with peer.arm() as arm:
        asyncio.run(program(arm))


def test_a_wait_that_is_cancelled_after_the_end_stops_nothing(peer: Peer) -> None:
    peer.runs(1, peer.finished(1))

    async def program(arm: ha.Arm) -> None:
        handle = arm.start(HOME)
        handle.wait(timeout=30.0)
        task = asyncio.create_task(_await(handle))
        await asyncio.sleep(0)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        count = len([message for message in peer.seen if isinstance(message, wire.Stop)])
        assert count == 0

    with peer.arm() as arm:
        asyncio.run(program(arm))
