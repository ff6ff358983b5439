"""A typical FRI application on the doubles, with its client in another process and UDP between them."""

from __future__ import annotations

import os
import socket
import subprocess
import time
from pathlib import Path

import numpy as np

from heptarm.fri.loop.client import Client
from tests.doubles.test_doubles import HERE, _command, _compile

SAID = (
    "a bad period throws",
    "the client answers",
    "the client moves the arm",
    "commanding is active",
    "the client's outputs are the cabinet's",
    "an output out of its range is not written",
    "cancelling the motion ends the overlay",
    "the session monitors on",
    "all states were reported",
    "without a client await times out",
)


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def test_an_fri_application_and_its_client(tmp_path: Path) -> None:
    _compile(HERE / "java" / "Overlaying.java", tmp_path)
    said, port = tmp_path / "said.txt", _free_port()
    project = tmp_path / "data.xml"
    project.write_text(
        "<persistence><processDataContainer>"
        f'<processData dataType="java.lang.Integer" id="sample.port" defaultValue="{port}"/>'
        "</processDataContainer></persistence>"
    )
    command = _command("sample.Overlaying", tmp_path, f"sample.file={said}", speed=1.0)  # FRI is real time
    with (
        Client(port) as client,
        subprocess.Popen(
            [*command, "--project", str(project)], stdout=subprocess.PIPE, text=True, env=os.environ
        ) as application,
    ):
        state = client.wait("COMMANDING_ACTIVE", timeout=60.0)
        start, began = state.q_ipo, time.monotonic()
        while application.poll() is None and time.monotonic() - began < 60.0:
            swing = 0.1 * (1.0 - np.cos(min(time.monotonic() - began, np.pi / 2) * 2.0)) / 2.0
            client.command(q=start + [0, 0, 0, 0, 0, 0, swing])
            if time.monotonic() - began < 1.0:  # the count is odd: 300 does not fit its 8 bits
                assert client.inputs == {"Sample.Button": False}
                client.output("Sample.Offset", 2**64 - 3)
                client.output("Sample.Level", 2.5)
                client.output("Sample.Count", 300)
            time.sleep(0.005)
        output = application.communicate(timeout=60)[0]
    assert application.returncode == 0, output
    assert said.read_text().splitlines() == [f"{one} = true" for one in SAID]
