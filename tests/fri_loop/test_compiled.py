"""Laws that the loop calls without Python: by Numba, or from a shared library; parameters, memory, failures."""

from __future__ import annotations

import inspect
import subprocess
import threading
import time
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import heptarm as ha
from heptarm.errors import CommandRejected, ShapeError
from heptarm.fri import Client, include_dir
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.compiled import LibraryLaw
from heptarm.fri.loop.law_interface import Memory, dtype, flat
from heptarm.fri.loop.settings import LoopSettings
from heptarm.fri.loop.user_api import Output, Params, State
from heptarm.fri.protocol.messages import CommandMode
from heptarm.values.pose import Pose
from tests.long import few

from . import laws as python_laws
from .controller import IPO, Controller
from .laws import filtered, filtered_slowly, looking, raising
from .test_cycle import Bench

SOURCE = Path(__file__).with_name("compiled_laws.c")
OFFSET = {"offset": [0.02] * 7}
FILTER: dict[str, npt.ArrayLike] = {"x": [0.0] * 7, "calls": 0.0}


@pytest.fixture(scope="module")
def laws(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The shared library of `compiled_laws.c`."""
    made = tmp_path_factory.mktemp("laws") / "laws.so"
    flags = ["-O1", "-shared", "-fPIC", "-ffp-contract=off", f"-I{include_dir()}"]
    subprocess.run(["cc", *flags, "-o", made, SOURCE, "-lm"], check=True)
    return made


def until(condition: object, what: str, seconds: float = 30.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():  # type: ignore[operator]
        assert time.monotonic() < deadline, f"not within {seconds:g} s: {what}"
        time.sleep(2e-3)


# ------------------------------------------------------------------------------------------------ one law, three forms


def form(kind: str, laws: Path) -> object:
    if kind == "library":
        return ha.law_from(laws, "filtered")
    return filtered if kind == "numba" else filtered_slowly


@pytest.mark.parametrize("kind", few(["library", "numba", "python"], 2))
def test_parameters_and_memory_are_live_and_the_law_keeps_what_it_knows(kind: str, laws: Path) -> None:
    with Client(0, law=form(kind, laws), params=OFFSET, memory=FILTER, realtime=False) as client:  # type: ignore[arg-type]
        assert client.memory.calls == 0.0, "before the first call: as given"
        controller = Controller(client.port)
        with controller.running():
            controller.active()
            until(lambda: np.abs(client.memory.x - 0.02).max() < 1e-4, "the filter reaches its input")
            until(lambda: np.abs(client.state.q - np.add(IPO, 0.02)).max() < 1e-4, "and the arm too")
            client.params.offset = [-0.02] * 7
            until(lambda: np.abs(client.memory.x + 0.02).max() < 1e-4, "and the next one")
            before = client.memory.snapshot()
            assert before["calls"] > 20 and before["x"].shape == (7,)
            client.memory.set(x=np.full(7, 0.03), calls=-1e6)
            until(lambda: -1e6 < client.memory.calls < 0.0, "the law goes on from what was written")
            count = client.memory.calls
            until(lambda: client.memory.calls > count, "and keeps it")
            until(
                lambda: np.abs(client.state.q - np.subtract(IPO, 0.02)).max() < 1e-4, "the filter forgets it"
            )
        assert not [one for one in client.events() if "failed" in one.text]
        with pytest.raises(ShapeError, match=r"x must have shape \(7,\)"):
            client.memory.x = 1.0
        with pytest.raises(AttributeError, match="no member of the law's memory 'y'; there are x, calls"):
            client.memory.y = 1.0


def test_the_three_forms_agree(laws: Path) -> None:
    """The same messages: Python, Numba and C answer the same, and see the same velocities and times."""
    sent, seen = [], []
    for law in (inspect.unwrap(looking), looking, ha.law_from(laws, "looking", memory=looking.memory)):
        settings = LoopSettings(law=law, memory=looking.memory, history=256)
        bench = Bench(settings=settings)
        bench.activate()
        for k in range(200):
            bench.controller.ipo = tuple(value + 1e-5 * k * k for value in IPO)
            bench.run(1)
        sent.append(bench.states[-1].q_sent)
        words = bench.layout.memory.newest()
        assert words is not None
        memory = Memory(np.array(words[1:]), settings.law_memory[1])
        seen.append([*memory.dq, memory.t, memory.dt])
        assert memory.dt == 1e-3 and memory.t > 0.1 and np.abs(memory.dq).max() > 1e-4
    assert np.ptp(np.array(seen), axis=0).max() < 1e-12
    assert np.ptp(np.array(sent), axis=0).max() < 1e-12


# ------------------------------------------------------------------------------------------------------ what goes wrong


@pytest.mark.parametrize(
    ("what", "words"),
    [
        (1, "numbers that are not finite 10 times in a row"),
        (2, "crashed with SIGFPE"),
        (3, "crashed with SIGSEGV"),
        (4, "did not return within 20 ms"),
        (5, "longer than its time budget"),
        (6, "it returned 42"),
        (7, "crashed with SIGSEGV"),
    ],
)
def test_a_law_that_fails_brakes_the_arm_and_is_named(what: int, words: str, laws: Path) -> None:
    law = ha.law_from(laws, "misbehaving", params={"what": 0.0}, memory={"calls": 0.0})
    with Client(0, law=law, realtime=False) as client:
        controller = Controller(client.port, period_ms=4)
        with controller.running():
            controller.active()
            until(lambda: client.memory.calls > 5, "the law runs")
            client.params.what = what
            events: list[str] = []

            def reported() -> bool:
                events.extend(one.text for one in client.events())
                return any("the law failed" in one for one in events)

            until(reported, "the failure is reported")
            assert any("the law failed, the arm brakes: " in one and words in one for one in events)
            controller.settle()
            last = [one.q for one in controller.answers[-2:]]
            assert last[0] == last[1] is not None and np.isfinite(last[1]).all(), (
                "the loop answers on, at rest"
            )
            assert client.is_running and client.state.q_sent == pytest.approx(last[0])
            assert what != 5 or client.stats.overruns >= 10


def test_a_single_number_that_is_not_finite_keeps_the_last_command(laws: Path) -> None:
    law = ha.law_from(laws, "misbehaving", params={"what": 8.0}, memory={"calls": 0.0})
    with Client(0, law=law, realtime=False) as client:
        controller = Controller(client.port)
        with controller.running():
            controller.active()
            until(lambda: client.memory.calls > 60, "the law runs on")
        assert all(np.isfinite(one.q).all() for one in controller.answers if one.q is not None)
        assert any("A3" in line and "not finite" in line for line in client.limited)


def test_an_exception_in_numba_is_named() -> None:
    with Client(0, law=raising, realtime=False) as client:
        controller = Controller(client.port)
        with controller.running():
            controller.active()
            until(lambda: any("ValueError: no path found" in one.text for one in client.events()), "its text")


def test_the_guard_limits_a_compiled_law(laws: Path) -> None:
    law = ha.law_from(laws, "filtered", params={"offset": [50.0] * 7}, memory=FILTER)
    with Client(0, law=law, realtime=False) as client:
        controller = Controller(client.port)
        with controller.running():
            controller.active()
            until(lambda: client.limited, "the guard limits it")
            time.sleep(0.3)
        sent = np.array([one.q for one in controller.answers if one.q is not None])
        assert np.abs(np.diff(sent, axis=0)).max() <= 2.3e-3 * 2 * 1.001 and any(
            "A1" in line for line in client.limited
        )


# ----------------------------------------------------------------------------------------- what is refused at the start


@pytest.mark.parametrize(
    ("name", "words", "hint"),
    [
        ("opens_a_file", "laws.py, line", "leave out @ha.law"),
        ("forgets_memory", "Unknown attribute 'x' of memory", "declare it and its initial value"),
        ("asks_for_signals", "Unknown attribute 'io' of out", "signals"),
    ],
)
def test_what_numba_cannot_compile_is_named_with_line_and_remedy(name: str, words: str, hint: str) -> None:
    with pytest.raises(CommandRejected, match=words) as error:
        Client(0, law=getattr(python_laws, name), realtime=False)
    line = getattr(python_laws, name).__wrapped__.__code__.co_firstlineno
    assert f"laws.py, line {line + 2}: " in str(error.value) and hint in error.value.hint
    assert error.value.parameter == "law"


def test_a_library_that_does_not_fit_is_refused(laws: Path, tmp_path: Path) -> None:
    with pytest.raises(CommandRejected, match="there is no library .*none.so"):
        ha.law_from(tmp_path / "none.so", "step")
    (tmp_path / "text.so").write_text("no library")
    for law, words in (
        (ha.law_from(tmp_path / "text.so", "step"), "cannot be loaded"),
        (ha.law_from(laws, "step"), "exports no law 'step'"),
        (
            ha.law_from(laws, "filtered", params=OFFSET),
            r"the memory of filtered in laws.so have 64 bytes, memory= has 0",
        ),
        (ha.law_from(laws, "filtered", params={"offset": 1.0}, memory=FILTER), r"params= has 8: offset"),
    ):
        with pytest.raises(CommandRejected, match=words) as error:
            Client(0, law=law, realtime=False)
        assert error.value.hint


def test_a_pose_is_its_seven_numbers() -> None:
    pose = Pose.xyz_abc(0.5, -0.1, 0.4, 0.3, 0.2, 0.1)
    values, schema = flat({"k": 2.0, "goal": pose}, "params")
    params = Params(values, schema, changed=lambda: None)
    assert params.goal == pytest.approx(pose.array)
    params.goal = pose.shifted(z=0.1)
    assert params.goal == pytest.approx(pose.shifted(z=0.1).array) and params.k == 2.0
    memory = Memory(values, schema)
    memory.goal = pose
    assert memory.goal == pytest.approx(pose.array)
    with pytest.raises(ShapeError, match="k must have shape"):
        params.k = pose


def test_memory_needs_a_law_that_takes_it() -> None:
    def law(state: State, out: Output, params: Params) -> None:
        pass

    with pytest.raises(ShapeError, match="memory needs a law with four arguments"):
        Client(0, law=law, memory={"x": 1.0}, realtime=False)
    with pytest.raises(ShapeError, match="memory must be numbers and arrays by name"):
        ha.law(memory=[1.0])(law)  # type: ignore[call-overload]


# ----------------------------------------------------------------------------------------------------------- snapshots


def test_a_snapshot_of_the_memory_is_never_torn() -> None:
    """A writer in one thread, a reader in another: all members of a snapshot belong to one call."""
    from heptarm.io.shared import MemoryBlock

    block = MemoryBlock(at.Layout.words(history=16, params=0, memory=64))
    block.unlink()
    ring = at.Layout(block, history=16, params=0, memory=64).memory
    stop, torn, seen = threading.Event(), [], set()

    def read() -> None:
        while not stop.is_set():
            words = ring.newest()
            if words is not None:
                seen.add(words[1])
                if np.ptp(words[1:]):
                    torn.append(words)

    reader = threading.Thread(target=read)
    reader.start()
    deadline = time.monotonic() + 20.0
    value = 0
    while value < 5000 or (not seen and time.monotonic() < deadline):  # a busy machine starts the reader late
        ring.write(np.full(64, float(value)))
        value += 1
    stop.set()
    reader.join()
    assert seen and not torn


def test_the_structures_are_those_of_the_dictionaries() -> None:
    _, schema = flat({"k": 1.0, "goal": np.zeros((2, 3))}, "params")
    assert dtype(schema) == np.dtype([("k", "f8"), ("goal", "f8", (2, 3))])
    assert isinstance(ha.law_from(SOURCE, "x"), LibraryLaw)


def test_a_session_in_torque_mode_handles_lost_messages_by_the_same_law(laws: Path) -> None:
    law = ha.law_from(laws, "filtered", params=OFFSET, memory=FILTER)
    with Client(0, law=law, realtime=False) as client:
        controller = Controller(client.port, mode=CommandMode.TORQUE)
        drop = iter(range(10**9))
        controller.mangle = lambda raw: None if next(drop) % 3 == 0 else raw
        with controller.running():
            controller.active()
            until(lambda: client.memory.calls > 50, "the law runs")
            until(lambda: np.abs(client.state.q_sent - np.add(IPO, 0.02)).max() < 1e-3, "and commands")
        assert client.stats.lost > 10 and not [one for one in client.events() if "failed" in one.text]
