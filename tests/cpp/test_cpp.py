"""The C++ client: the golden bytes, the vectors of the key, and real motions of the virtual cabinet."""

from __future__ import annotations

import contextlib
import json
import os
import random
import re
import socket
import subprocess
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from heptarm.wire.codes import Code
from heptarm.wire.messages import MAJOR
from tests.arm.standstill import stand_still
from tests.cli.running import sim
from tests.cpp.native import INCLUDES, ROOT, compiled
from tests.long import few
from tests.retry import retry, silent
from tests.schema.python_side import recoded
from tests.simulators import FASTER

GOLDEN = ROOT / "schema" / "golden"
KEY = "k7fh-9tqa-x2mn-p4cw-8r3e-vd6y-s5gj"


@pytest.fixture(scope="session")
def probe(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled(Path(__file__).parent / "probe.cpp", tmp_path_factory.mktemp("cpp"), "-O1")


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with sim("--speed", f"{FASTER:g}") as ready:
        yield f"127.0.0.1:{ready['port']}"


def slow(done: subprocess.CompletedProcess[str] | Exception) -> str:
    if isinstance(done, Exception):
        return ""
    late = done.returncode != 0 and "did not open a session within" in done.stderr
    return "the handshake came late" if late else silent(done)


def asked(probe: Path, *words: str, text: str = "") -> list[str]:
    done = retry(
        lambda: subprocess.run(
            [str(probe), *words], input=text, capture_output=True, text=True, timeout=240, check=False
        ),
        slow,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def late(done: subprocess.CompletedProcess[str] | Exception) -> str:
    if isinstance(done, Exception):
        return ""
    return "servo targets came late" if done.returncode != 0 and "(starved)" in done.stderr else ""


# ------------------------------------------------------------------------------------ bytes


def test_reads_and_writes_the_golden_bytes(probe: Path) -> None:
    vectors = json.loads((GOLDEN / "vectors.json").read_text())
    found = asked(probe, "recode", text="".join(f"{one['type']} {one['body']}\n" for one in vectors))
    assert found == [f"{one['body']} ok" for one in vectors]


def test_judges_damaged_bytes_as_python_does(probe: Path) -> None:
    """Bytes cut, appended, changed: the same refusal, or the same first violation."""
    source, cases = random.Random(5), []
    for one in json.loads((GOLDEN / "vectors.json").read_text()):
        body = bytes.fromhex(one["body"])
        cases += [(one["type"], body[:-1]), (one["type"], body + b"\0")]
        for _ in range(10):
            changed = bytearray(body or b"\0")
            changed[source.randrange(len(changed))] = source.choice(
                (0, 1, 0x7F, 0x80, 0xC3, 0xED, 0xF8, 0xFF)
            )
            cases.append((one["type"], bytes(changed)))
    cases.append((999, b""))
    found = asked(probe, "recode", text="".join(f"{number} {body.hex()}\n" for number, body in cases))
    wrong = [
        (number, body.hex(), cpp, python)
        for (number, body), cpp in zip(cases, found, strict=True)
        if cpp != (python := recoded(number, body))
    ]
    assert not wrong, wrong[:3]


def test_computes_the_vectors_of_the_key(probe: Path) -> None:
    vectors = json.loads((GOLDEN / "key.json").read_text())
    given = (
        bytes.fromhex(vectors["key"]).decode(),
        vectors["hello"],
        vectors["challenge"],
        vectors["welcome"],
    )
    found = dict(line.split() for line in asked(probe, "key", *given, "1234567890"))
    assert set(found) == {"client_mac", "client_key", "cabinet_key", "proof", "stop_frame"}
    assert found == {name: vectors[name] for name in found}


# ---------------------------------------------------------------------------------- motions


def check_moves(lines: list[str]) -> None:
    found = {words[0]: words[1:] for words in map(str.split, lines)}
    assert found["robot"] == ["iiwa14", "1"] and found["controller"] == ["probe"]
    for name in ("ptp", "lin", "program"):
        assert found[name][0] == "finished" and float(found[name][1]) < 1e-3
    assert float(found["down"][0]) == pytest.approx(-0.05, abs=1e-3)
    assert found["cancelled"][0] == "cancelled"


def test_moves_the_arm(probe: Path, address: str) -> None:
    check_moves(asked(probe, "move", address))


def test_a_cabinet_with_a_key_takes_only_a_client_that_proves_it(probe: Path, tmp_path: Path) -> None:
    file = tmp_path / "key"
    file.touch(mode=0o600)
    file.write_text(KEY)
    with sim("--key-file", str(file), "--speed", f"{FASTER:g}") as ready:
        address = f"127.0.0.1:{ready['port']}"
        check_moves(asked(probe, "move", address, KEY))
        (without,) = asked(probe, "connect", address)
        assert without.startswith(
            f"connect ConnectFailed {Code.WRONG_KEY:d} the cabinet asks for a pre-shared key"
        )
        (wrong,) = asked(probe, "connect", address, KEY[::-1])
        assert wrong.startswith(f"connect ConnectFailed {Code.WRONG_KEY:d} ")


def test_a_client_with_a_key_accepts_no_cabinet_without_it(probe: Path, address: str) -> None:
    (found,) = asked(probe, "connect", address, KEY)
    assert "the cabinet failed to prove that it knows the key" in found


def test_follows_targets_at_1_khz(probe: Path) -> None:
    with sim() as ready:  # in real time: a target for each millisecond

        def run() -> subprocess.CompletedProcess[str]:
            return subprocess.run(
                [str(probe), "servo", f"127.0.0.1:{ready['port']}", "2"],
                capture_output=True,
                text=True,
                timeout=240,
                check=False,
            )

        done = retry(run, late)
    assert done.returncode == 0, done.stderr
    found = {line.split()[0]: line.split()[1:] for line in done.stdout.splitlines()}
    assert found["servo"][0] == "cancelled" and found["refused"] == ["0"]
    assert int(found["received"][0]) == int(found["sent"][0]) > 100  # 2000, unless this machine is busy
    assert 0.1 < float(found["widest"][0]) < 0.3


def test_observes_states_in_order(probe: Path, address: str) -> None:
    (found,) = asked(probe, "observe", address, "250", "200")
    assert "out of order 0" in found and found.endswith("controller nobody")
    words = found.replace(",", "").split()
    assert (
        int(words[3]) >= 200 and int(words[5]) >= 200 and int(words[1]) > 1
    )  # a slow reader leaves states out


def test_a_client_that_the_system_stops_for_a_while_keeps_its_connection(probe: Path) -> None:
    done = stand_still([str(probe), "wait"])
    assert (done.returncode, done.stdout) == (0, "alive\n"), done.stderr


def test_errors_have_the_text_of_the_cabinet(probe: Path, address: str) -> None:
    lines = asked(probe, "errors", address)
    found = {line.split()[0]: line for line in lines}
    assert found["observer"].startswith(f"observer NotInControl {Code.NOT_IN_CONTROL:d} ")
    assert found["second"].startswith("second NotInControl ") and "probe" in found["second"]
    assert (
        found["limit"].startswith("limit LimitError ")
        and "A2" in found["limit"]
        and "[-120" in found["limit"]
    )
    assert found["unset"].startswith("unset LimitError 1 items[0].motion.q[0] ")
    assert (
        found["speed"].startswith("speed LimitError 2 items[0].motion.dynamics.velocity[0] ")
        and "(0, 1]" in found["speed"]
    )
    assert found["unplanned"].split()[1] in ("CommandRejected", "LimitError", "MotionAborted"), found[
        "unplanned"
    ]
    assert "an not plan motion" in found["unplanned"] or "reach" in found["unplanned"]
    assert "(stopped)" in found["stopped"]
    assert found["starved"].startswith("starved Starved ")
    assert lines[-1] == "moved again finished"


# ------------------------------------------------------------------------------ other listeners


@contextlib.contextmanager
def answering(answer: bytes) -> Iterator[str]:
    """A server that answers anything with these bytes."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            with contextlib.suppress(OSError):
                connection = server.accept()[0]
                with connection:
                    connection.recv(4096)
                    connection.sendall(answer)
                    connection.recv(4096)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield f"127.0.0.1:{server.getsockname()[1]}"
        thread.join(10)


def test_a_web_server_on_the_port_is_called_one(probe: Path) -> None:
    with answering(b"HTTP/1.1 400 Bad Request\r\n\r\n") as address:
        (found,) = asked(probe, "connect", address)
    assert "a web server (HTTP) answers on this port" in found


def test_another_version_is_named(probe: Path) -> None:
    body = bytes([0, 14, 0, 0, 0, 9, 0, 0])
    header = bytes.fromhex("4837") + bytes([9, 0, 0, 5]) + len(body).to_bytes(4, "big") + bytes(16)
    with answering(header + body) as address:
        (found,) = asked(probe, "connect", address)
    assert "VersionMismatch" in found and f"protocol 9.0, this side {MAJOR}." in found


def test_nobody_there(probe: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    (found,) = asked(probe, "connect", f"127.0.0.1:{port}")
    assert found.startswith("connect ConnectFailed") and "refused" in found
    (found,) = asked(probe, "connect", "http://cabinet")
    assert "an address is HOST or HOST:PORT, got http://cabinet" in found


# ------------------------------------------------------------------------------------ examples


@pytest.mark.parametrize("name", few(["first_motion", "servo"]))
def test_example_runs(name: str, tmp_path: Path, address: str) -> None:
    # the example `fri` needs the loop and runs in test_fri.py
    # the probe uses the same header, optimised: what only the optimiser warns of is found there
    program = compiled(ROOT / "cpp" / "examples" / f"{name}.cpp", tmp_path)
    environment = {one: value for one, value in os.environ.items() if one != "HEPTARM_KEY"}
    with contextlib.ExitStack() as stack:
        if name == "servo":  # a stream in real time
            address = f"localhost:{stack.enter_context(sim())['port']}"
        done = retry(
            lambda: subprocess.run(
                [str(program), address],
                capture_output=True,
                text=True,
                timeout=120,
                check=False,
                env=environment,
            ),
            late,
        )
    assert done.returncode == 0, done.stderr
    assert {"first_motion": "refused: ", "servo": "targets followed"}[name] in done.stdout


@pytest.mark.long  # the probe and an example use the same header
@pytest.mark.computing
def test_snippets_of_the_guide_compile(tmp_path: Path) -> None:
    """A block with a main is a program; the others are the body of one function, in their order."""
    blocks = re.findall(r"^```cpp\n(.*?)^```", (ROOT / "docs" / "guide" / "cpp.md").read_text(), re.S | re.M)
    whole = [block for block in blocks if "int main" in block]
    parts = [block for block in blocks if "int main" not in block]
    assert len(whole) == 1 and len(parts) > 5
    head = "#include <cstdlib>\n#include <iostream>\n#include <heptarm/fri.hpp>\n#include <heptarm/kinematics.hpp>\n"
    body = "void page() {\n    using namespace heptarm;\n" + "".join(parts) + "}\n"
    source = tmp_path / "page.cpp"
    source.write_text(whole[0] + head + body)  # the program first, with no headers but its own
    # the header is read once for both; the examples are compiled to the end, linked and run
    compiled(source, tmp_path, "-fsyntax-only", *INCLUDES)
