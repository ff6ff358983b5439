"""An arm in programs of several processes, and in asyncio."""

from __future__ import annotations

import asyncio
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

import heptarm as ha
from heptarm.wire import messages as wire
from tests.arm.peer import Peer
from tests.arm.test_moving import HOME

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
    [FORK, FORK_IN_BLOCKS, MULTIPROCESSING],
    ids=["fork", "fork in blocks", "multiprocessing"],
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


def test_an_awaited_handle_raises_and_a_cancelled_wait_leaves_the_motion(peer: Peer) -> None:
    peer.runs(1)

    async def program(arm: ha.Arm) -> None:
        handle = arm.start(HOME)
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(_await(handle), 0.05)
        assert not handle.done
        peer.tell(peer.finished(1, wire.Cause.SAFETY))
        with pytest.raises(ha.MotionAborted) as raised:
            await handle
        assert handle.error is raised.value

    with peer.arm() as arm:
        asyncio.run(program(arm))
