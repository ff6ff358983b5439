"""The client and its loop process, with a minimal controller on this machine."""

from __future__ import annotations

import importlib
import math
import os
import random
import socket
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from heptarm.errors import CommandRejected, ConnectFailed, ConnectionLost, NotReady, ShapeError, Timeout
from heptarm.fri.guard.fallback import Missing, Policy
from heptarm.fri.loop.client import Client
from heptarm.fri.loop.process import importable
from heptarm.fri.loop.settings import ClientKeywords, LoopSettings
from heptarm.fri.loop.shared_memory import PID
from heptarm.fri.loop.user_api import Output, Params, State
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.messages import CommandMode, Quality, SessionState
from heptarm.fri.protocol.version import Version
from heptarm.values.pose import Pose

from .controller import IPO, Controller

ROOT = Path(__file__).resolve().parents[2]
ACTIVE = SessionState.COMMANDING_ACTIVE


@pytest.fixture
def client(request: pytest.FixtureRequest) -> Iterator[Client]:
    with Client(0, realtime=False, busy_poll=getattr(request, "param", 0.0)) as one:
        yield one


@pytest.mark.parametrize("client", [0.0, 1e-4], ids=["sleeping", "polling"], indirect=True)
def test_from_nothing_to_commanding_and_a_second_session_without_restarting(client: Client) -> None:
    assert client.session is SessionState.IDLE and "no message received" in client.trouble
    with pytest.raises(NotReady, match="firewall"):
        _ = client.state
    with pytest.raises(Timeout, match="no FRI message within"):
        client.next(timeout=0.1)
    for _ in range(2):
        controller = Controller(client.port)
        with controller.running():
            assert client.wait("MONITORING_WAIT").q.tolist() == list(IPO)
            controller.active()
            client.wait(ACTIVE)
            goal, seen = np.add(IPO, 0.05), 0
            for s in client:
                client.command(q=goal)
                seen += 1
                if np.abs(s.q - goal).max() < 1e-9:
                    break
            assert seen > 20 and client.quality is Quality.GOOD
            controller.walk(SessionState.MONITORING_READY, SessionState.IDLE)
            client.wait(SessionState.IDLE)
        time.sleep(0.02)
    stats = client.stats
    assert stats.restarts + sum("listening to" in one.text for one in client.events()) >= 2
    assert stats.answered and stats.commanded and stats.limited and not stats.malformed
    assert any("velocity limited" in line for line in client.limited)
    assert stats.latency[0] > 0.0 and len(client.history(10)) == 10


def test_a_user_who_falls_silent_stops_the_arm_by_the_policy() -> None:
    policy = Policy(Missing.RAMP_DOWN, patience=0.05)
    with Client(0, policy=policy, realtime=False) as client:
        controller = Controller(client.port)
        with controller.running():
            controller.active()
            begin = client.wait(ACTIVE).t
            for s in client:
                rise = min((s.t - begin) / 0.4, 1.0)
                client.command(q=np.add(IPO, 0.2 * (s.t - begin) * rise**2))
                if s.t > begin + 0.6:
                    break
            deadline = time.monotonic() + 20.0
            while time.monotonic() < deadline:
                time.sleep(0.4)  # the user's code is busy; answers continue
                states = client.history(100)
                if np.ptp([one.q_sent[0] for one in states[-50:]]) == 0.0:
                    break
    assert all(one.is_answered and one.is_filled for one in states[-50:])
    assert np.ptp([one.q_sent[0] for one in states[-50:]]) == 0.0, "the arm stands"
    assert states[-1].q_sent[0] > IPO[0] + 0.01


def test_an_imported_law_runs_in_the_loop_and_follows_its_parameters(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "laws_of_a_user.py").write_text(
        "def offset(state, out, params):\n    out.q += params.offset\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    offset = importlib.import_module("laws_of_a_user").offset
    assert importable(offset) == "laws_of_a_user:offset"
    with Client(0, law=offset, params={"offset": [0.02] * 7}, realtime=False) as client:
        controller = Controller(client.port)
        with controller.running():
            controller.active()
            _until(client, np.add(IPO, 0.02))
            client.params.offset = [-0.02] * 7
            _until(client, np.subtract(IPO, 0.02))


def test_a_law_that_cannot_be_imported_goes_to_the_new_process_by_value() -> None:
    shift = 0.03

    def law(state: State, out: Output, params: Params) -> None:
        out.q += shift

    with Client(0, law=law, realtime=False) as client:
        controller = Controller(client.port)
        with controller.running():
            controller.active()
            _until(client, np.add(IPO, shift))


def test_a_law_that_uses_what_belongs_to_this_process_is_refused() -> None:
    lock = threading.Lock()

    def law(state: State, out: Output, params: Params) -> None:
        with lock:
            out.q += 0.0

    with pytest.raises(CommandRejected, match="cannot be sent to the loop's process.*lock") as error:
        Client(0, law=law, realtime=False)
    assert "not arms, locks or files" in error.value.hint


def test_a_law_whose_module_fails_in_the_new_process_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A law's module that this process can import, but the loop's cannot."""
    (tmp_path / "law_with_a_camera.py").write_text(
        f"import os\nif os.getpid() != {os.getpid()}:\n    raise RuntimeError('no camera here')\n"
        "def law(state, out, params):\n    pass\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    law = importlib.import_module("law_with_a_camera").law
    with pytest.raises(ConnectFailed, match="RuntimeError: no camera here"):
        Client(0, law=law, realtime=False)


def test_a_law_in_python_that_never_returns_is_interrupted_and_the_arm_brakes() -> None:
    def endless(state: State, out: Output, params: Params) -> None:
        out.q += 0.1 * min(state.t, 0.3)
        while state.t > 0.3:
            pass

    with Client(0, law=endless, realtime=False) as client:
        controller = Controller(client.port)
        with controller.running():
            controller.active()
            text = _event(client, "the law failed")
            assert "did not return within 1 s: look for an endless loop" in text
            count = client.stats.answered
            deadline = time.monotonic() + 20.0
            while client.stats.answered < count + 200 and time.monotonic() < deadline:
                client.next()
            states = client.history(50)
        assert all(one.is_answered for one in states), "the loop answers again"
        assert np.ptp([one.q_sent for one in states], axis=0).max() == 0.0, "and the arm stands"


def test_a_law_that_cannot_be_interrupted_ends_the_loop_with_its_cause() -> None:
    def endless(state: State, out: Output, params: Params) -> None:
        sum(range(10**13))  # in C, where no signal interrupts it

    with Client(0, law=endless, realtime=False) as client:
        controller = Controller(client.port)
        with controller.running():
            controller.active()
            with pytest.raises(
                ConnectionLost, match="did not return within 1 s and could not be interrupted"
            ):
                while True:
                    client.next(timeout=20.0)
            deadline = time.monotonic() + 10.0
            while client.is_running and time.monotonic() < deadline:
                time.sleep(0.02)
            assert not client.is_running and "the cabinet stops the arm" in client.trouble


def _event(client: Client, words: str) -> str:
    """Wait for an event; its text."""
    deadline = time.monotonic() + 30.0
    while time.monotonic() < deadline:
        for one in client.events():
            if words in one.text:
                return one.text
        time.sleep(0.02)
    pytest.fail(f"no event {words!r}")


def _until(client: Client, goal: np.ndarray) -> None:
    deadline = time.monotonic() + 30.0
    while time.monotonic() < deadline:
        if np.abs(client.next().q - goal).max() < 1e-9:
            return
    pytest.fail("the goal was not reached")


@pytest.mark.parametrize("wire", [Version.V2_5, Version.V2_7])
@pytest.mark.parametrize("mode", [CommandMode.TORQUE, CommandMode.WRENCH, CommandMode.CARTESIAN_POSE])
def test_other_versions_and_modes(wire: Version, mode: CommandMode, client: Client) -> None:
    controller = Controller(client.port, wire=wire, mode=mode)
    with controller.running():
        controller.active()
        client.wait(ACTIVE)
        deadline = time.monotonic() + 20.0
        while time.monotonic() < deadline:
            client.command(tau=[3.0] * 7, wrench=[0.0, 0.0, 5.0, 0.0, 0.0, 0.0])
            s = client.next()
            reached = {CommandMode.TORQUE: s.tau_sent[6] == 3.0, CommandMode.WRENCH: s.wrench_sent[2] == 5.0}
            if reached.get(mode, s.t > 0.1):
                break
        controller.settle()
        assert s.mode is mode and s.pose.xyz.tolist() == pytest.approx([0.1, 0.2, 0.3])
        answer = controller.answers[-1]
        assert (answer.tau is not None) == (mode is CommandMode.TORQUE)
        assert (answer.wrench is not None) == (mode is CommandMode.WRENCH)
        assert (answer.pose is not None) == (mode is CommandMode.CARTESIAN_POSE)
        # a user who is kept off the processor for a while finds them ramped down by the policy
        if mode is CommandMode.TORQUE:
            assert (3.0,) * 7 in [one.tau for one in controller.answers]
        if mode is CommandMode.WRENCH:
            assert (0.0, 0.0, 5.0, 0.0, 0.0, 0.0) in [one.wrench for one in controller.answers]


def test_loss_duplicates_reordering_and_garbage_end_no_session(client: Client) -> None:
    controller = Controller(client.port)
    rng, kept = random.Random(3), []

    def mangle(raw: bytes) -> bytes | None:
        chance = rng.random()
        kept.append(raw)
        if chance < 0.1:
            return None
        if chance < 0.15 and len(kept) > 2:
            return kept[-2]
        return rng.randbytes(40) if chance < 0.2 else raw

    controller.mangle = mangle
    with controller.running():
        controller.active()
        client.wait(ACTIVE)
        deadline = time.monotonic() + 20.0
        while time.monotonic() < deadline and client.stats.answered < 300:
            client.command(q=IPO)
            client.next()
    stats = client.stats
    assert stats.lost and stats.malformed and stats.duplicated + stats.reordered
    assert stats.restarts == 0 and client.session is ACTIVE and stats.answered > 200


def test_a_wrong_version_is_reported_in_words() -> None:
    with Client(0, version="1.15", realtime=False) as client:
        controller = Controller(client.port, wire=Version.V2_7)
        wanted = pytest.raises(Timeout, match='speaks FRI 2.7 ."3.0"., this side FRI 1.14-1.16')
        with controller.running(), wanted:
            client.next(timeout=3.0)
        assert client.stats.malformed > 20 and not controller.answers


def test_signals_are_read_and_written(client: Client) -> None:
    controller = Controller(client.port)
    controller.io = (
        m.IoValue("FRI.In", m.IoType.ANALOG, m.IoDirection.INPUT, 2.5),
        m.IoValue("FRI.Out", m.IoType.BOOLEAN, m.IoDirection.OUTPUT, 0),
        m.IoValue("FRI.Code", m.IoType.DIGITAL, m.IoDirection.OUTPUT, 7),
    )
    with pytest.raises(CommandRejected, match="no signal 'FRI.Out' in this FRI session"):
        client.output("FRI.Out", True)
    with controller.running():
        controller.walk(SessionState.MONITORING_READY)
        state = client.wait("MONITORING_READY")
        assert client.inputs == {"FRI.In": 2.5} and client.outputs == {"FRI.Out": False, "FRI.Code": 7.0}
        assert state.io["in"] == 2.5 and state.io.out is False and len(state.io) == 3
        client.output("out", True)
        client.output("FRI.Code", 2**40)
        deadline = time.monotonic() + 20.0
        written: set[tuple[str, float]] = set()
        while len(written) < 2 and time.monotonic() < deadline:
            controller.settle()
            written = {(one.name, one.value) for answer in controller.answers for one in answer.io}
        assert written == {("FRI.Out", 1), ("FRI.Code", 2**40)}
        for name, value, words in (
            ("FRI.In", 1.0, "is an input of the cabinet"),
            ("FRI.Door", 1.0, "no signal 'FRI.Door' in this FRI session"),
            ("FRI.Out", 2, "must be True or False, got 2"),
            ("FRI.Code", -1, r"\(unsigned\) must be 0, 1, 2, ..., got -1"),
            ("FRI.Code", 1.5, "got 1.5"),
            ("FRI.Code", math.nan, "got nan"),
        ):
            with pytest.raises(CommandRejected, match=words):
                client.output(name, value)


def test_a_frame_that_is_asked_for_is_reported(client: Client) -> None:
    controller = Controller(client.port, wire=Version.V2_7)
    controller.requested = (m.Transformation("PBase", ()),)
    with controller.running():
        client.wait("MONITORING_WAIT")
        assert client.wanted_frames == ("PBase",)
        with pytest.raises(CommandRejected, match="requests no frame 'Part'"):
            client.frame("Part", Pose.at(0.0, 0.0, 0.3))
        with pytest.raises(ShapeError):
            client.frame("PBase", np.eye(4))
        client.frame("PBase", Pose.at(0.0, 0.0, 0.3))
        deadline = time.monotonic() + 20.0
        while (
            not (controller.answers and controller.answers[-1].transformations)
            and time.monotonic() < deadline
        ):
            controller.settle()
        (frame,) = controller.answers[-1].transformations
        assert frame.name == "PBase" and frame.values == (0.0, 0.0, 300.0, 1.0, 0.0, 0.0, 0.0)


def test_a_taken_port_and_bad_arguments_are_refused_in_words(client: Client) -> None:
    with pytest.raises(ConnectFailed, match="another program"):
        Client(client.port, realtime=False)
    for host in ("127.0.0.1\0", "\ud800"):
        with pytest.raises(ShapeError, match="host must have printable characters only"):
            Client(0, host=host)
    with pytest.raises(CommandRejected, match="got '1.9'"):
        Client(0, version="1.9")
    with pytest.raises(CommandRejected, match=r"history must be in \[16, 1048576\], got 1"):
        Client(0, history=1)
    with pytest.raises(CommandRejected, match=r"busy_poll must be in \[0, 0.00025\] s, got 0.001"):
        Client(0, busy_poll=1e-3)
    with pytest.raises(ShapeError, match="q must have shape"):
        client.command(q=[1.0])
    client.close()
    client.close()
    with pytest.raises(ConnectionLost, match="is closed"):
        client.command(q=IPO)
    with Client(client.port, realtime=False) as again:
        assert again.port == client.port, "the port is free again"


def test_another_sender_is_ignored_while_a_session_stands(client: Client) -> None:
    controller = Controller(client.port)
    with controller.running(), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        client.wait(SessionState.MONITORING_WAIT)
        for _ in range(20):
            stranger.sendto(controller.datagram(), ("127.0.0.1", client.port))
            time.sleep(1e-3)
        client.next()
        assert client.stats.malformed == client.stats.restarts == 0
        stranger.setblocking(False)
        with pytest.raises(BlockingIOError):
            stranger.recv(100)


def test_a_restarted_controller_with_a_new_port_is_answered_at_once(client: Client) -> None:
    controller = Controller(client.port)
    with controller.running():
        controller.active()
        client.wait(ACTIVE)
        deadline = time.monotonic() + 20.0
        while time.monotonic() < deadline and client.next().q_sent[0] < IPO[0] + 0.01:
            client.command(q=np.add(IPO, 0.05))
    # no farewell: it was killed, and starts again in another posture
    elsewhere = tuple(value + 0.2 for value in IPO)
    again = Controller(client.port, wire=Version.V2_5, ipo=elsewhere)
    with again.running():
        client.wait("MONITORING_WAIT")
        again.settle()
        first = again.answers[0].header.reflected
        assert 1e-3 * again.period_ms * first < 0.5, (
            "a silence of 0.1 s is enough, with room for a busy machine"
        )
        again.active()
        state = client.wait(ACTIVE)
        assert state.q_sent.tolist() == pytest.approx(elsewhere), "it starts where that interpolator is"
    assert "listening to" in " ".join(one.text for one in client.events())


def test_the_loop_ends_with_a_killed_user_and_brakes_before() -> None:
    """The user's process is killed while the arm moves: the loop stops the arm and ends."""
    for _ in range(10):
        controller, answers = _braked_after_a_kill()
        # a loop without messages for 5 periods starts again at rest: then nothing is known about the path
        if controller.longest_pause < 4e-3 * controller.period_ms:
            break
    sent = np.array([one.q for one in controller.answers if one.q is not None])[-400:]
    jerk = np.abs(np.diff(sent, 3, axis=0)).max() / controller.period_ms**3 * 1e9
    assert jerk < 100.0 and np.abs(sent[-1] - sent[-2]).max() < 1e-12, "it came to rest within its limits"
    assert answers == len(controller.answers), "and nobody answers any more"


def _braked_after_a_kill() -> tuple[Controller, int]:
    """The controller, and the number of answers some time after the user's process was killed."""
    script = textwrap.dedent(
        """
        import numpy as np, os, sys
        from heptarm.fri import Client
        client = Client(0, realtime=False)
        print(client.port, flush=True)
        begin = client.wait("COMMANDING_ACTIVE")
        for s in client:
            client.command(q=begin.q_ipo + 0.3)
            if s.q_sent[0] > begin.q_ipo[0] + 0.1:
                os.kill(os.getpid(), 9)
        """
    )
    user = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, cwd=ROOT)
    assert user.stdout is not None
    controller = Controller(int(user.stdout.readline()), period_ms=10)
    with controller.running():
        controller.active()
        assert user.wait(60) == -9
        count = -1
        deadline = time.monotonic() + 20.0
        while count != len(controller.answers) and time.monotonic() < deadline:
            count = len(controller.answers)
            time.sleep(0.3)
        user.stdout.close()
    return controller, count


@pytest.mark.skipif(not hasattr(os, "sched_setscheduler"), reason="asks Linux")
def test_what_the_system_refuses_is_said_plainly() -> None:
    with Client(0) as client:
        for line in client.refused:
            assert "limits.conf" in line
        policy = os.sched_getscheduler(int(client._header[PID]))
        assert policy == os.SCHED_FIFO or "no real-time priority" in client.refused[0]


def test_a_new_setting_is_written_once() -> None:
    """Settings and their keywords for type checkers are the same."""
    assert set(ClientKeywords.__annotations__) == {one.name for one in fields(LoopSettings)}
    with pytest.raises(TypeError, match="busy_pol"):
        LoopSettings(busy_pol=1e-4)  # type: ignore[call-arg]


def test_a_client_that_streams_on_does_not_command_a_session_that_it_has_not_seen() -> None:
    with Client(0, realtime=False, policy=Policy(Missing.HOLD)) as client:
        controller = Controller(client.port)
        with controller.running():
            controller.active()
            client.wait("COMMANDING_ACTIVE")
            client.command(q=np.add(IPO, 0.1))
            _until(client, np.add(IPO, 0.1))
            controller.state, controller.sequence = SessionState.MONITORING_WAIT, 0
            controller.ipo = tuple(value - 0.3 for value in IPO)
            controller.active()
            controller.settle()
            deadline = time.monotonic() + 30.0
            while not client.stats.stale:
                client.command(q=np.add(IPO, 0.1))
                assert time.monotonic() < deadline
            controller.settle()
            assert controller.answers[-1].q == controller.ipo
            client.next()
            client.command(q=np.add(IPO, 0.1))
            _until(client, np.add(IPO, 0.1))
