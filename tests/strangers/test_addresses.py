"""Applications and clients with the addresses of a lab run on a machine that has other ones."""

from __future__ import annotations

import shutil
import socket
import subprocess
import threading
from pathlib import Path

import pytest

from heptarm.fri.protocol.version import Version
from heptarm.sim.fri.server import PORTS, Server, is_here, source_port
from heptarm.sim.fri.settings import SessionConfiguration
from heptarm.sim.runtime.addresses import AddressMap
from tests.cli.running import HEPTARM
from tests.sim_fri.rig import Arm

APPLICATION = """
package lab;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import java.io.*;
import java.net.*;

/** Talks to 172.31.1.25. */
public class Dials extends RoboticsAPIApplication {
    private static final String PC = "172.31.1.25";

    @Override
    public void run() throws Exception {
        ServerSocket own = new ServerSocket(0, 1, InetAddress.getByName("172.31.1.147"));
        Socket socket = new Socket(PC, PORT);
        boolean known = PC.equals(socket.getInetAddress().getHostAddress());
        String other = getApplicationData().getProcessData("lab.peer").getValue();
        String line = "from " + own.getInetAddress().getHostAddress() + " known " + known + " peer " + other + "\\n";
        socket.getOutputStream().write(line.getBytes("US-ASCII"));
        socket.close();
        own.close();
    }
}
"""
PROJECT = """
<persistence><processDataContainer>
<processData dataType="java.lang.String" id="lab.peer" defaultValue="" value="172.31.1.25:30000"/>
</processDataContainer></persistence>
"""


def test_a_whole_address_is_replaced_and_no_other() -> None:
    mapped = AddressMap.of(["172.31.1.25=127.0.0.1", "robot-pc = localhost"])
    assert mapped.apply('"172.31.1.25", "http://172.31.1.25:80/"') == '"127.0.0.1", "http://127.0.0.1:80/"'
    other = '"172.31.1.250", "1172.31.1.25", "172.31.1.25.7", "my-robot-pc"'
    assert mapped.apply(other) == other
    assert mapped.apply('"robot-pc"') == '"localhost"'
    assert mapped.unused(["to 172.31.1.25"]) == ["robot-pc"]


@pytest.mark.parametrize("texts", [["172.31.1.25"], ["=127.0.0.1"], ["a=b c"], ["a=b", "a=c"]])
def test_a_map_that_is_none_is_refused(texts: list[str]) -> None:
    with pytest.raises(ValueError, match="--map"):
        AddressMap.of(texts)


@pytest.mark.skipif(shutil.which("javac") is None, reason="no javac here")
def test_an_application_that_dials_and_binds_addresses_of_the_lab(tmp_path: Path) -> None:
    (tmp_path / "RoboticsAPI.data.xml").write_text(PROJECT)
    heard: list[bytes] = []
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
        (tmp_path / "Dials.java").write_text(APPLICATION.replace("PORT", str(port)))
        listening.settimeout(60.0)

        def take() -> None:
            peer, _ = listening.accept()
            with peer, peer.makefile("rb") as lines:
                heard.extend(lines)

        taking = threading.Thread(target=take, daemon=True)
        taking.start()
        mapping = (
            "--map",
            "172.31.1.25=127.0.0.1",
            "--map",
            "172.31.1.147=127.0.0.1",
            "--map",
            "10.0.0.9=127.0.0.1",
        )
        command = [*HEPTARM, "sim", "--app", str(tmp_path), *mapping]
        done = subprocess.run(command, input="", capture_output=True, text=True, timeout=120, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        taking.join(timeout=30.0)
    assert heard == [b"from 127.0.0.1 known true peer 127.0.0.1:30000\n"]
    assert "--map: 10.0.0.9 is in no string of the sources" in done.stderr
    assert "sudo ip address add 10.0.0.9/32 dev lo" in done.stderr


def own_addresses() -> list[str]:
    """Addresses of this machine: of the loopback, and the one that its packets to other networks have, if any."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # sends nothing
        except OSError:
            return ["127.0.0.1", "127.0.0.2"]
        return ["127.0.0.1", "127.0.0.2", probe.getsockname()[0]]


def client_socket(port: int) -> socket.socket:
    """As a client of FRI binds it: to the port of every address, without sharing it."""
    found = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    found.bind(("", port))
    found.settimeout(10.0)
    return found


@pytest.mark.parametrize("host", own_addresses())
@pytest.mark.parametrize("explicit", [False, True], ids=["any-port", "the-client's-port"])
@pytest.mark.parametrize("first", ["client", "controller"])
def test_an_fri_client_on_this_machine_may_start_first_or_last(host: str, explicit: bool, first: str) -> None:
    with client_socket(0) as free:
        port = free.getsockname()[1]
    early = client_socket(port) if first == "client" else None
    server = Server(
        SessionConfiguration(Version.V1_15),
        Arm(),
        client=(host, port),
        port=port if explicit else None,
        speed=0.0,
    )
    client = early or client_socket(port)
    try:
        server.open()
        server.tick()
        datagram, sender = client.recvfrom(1500)
        assert datagram and sender[1] == server.port != port
        client.sendto(b"\x0a", sender)  # refused as a message, but as one of the client's
        while not server.controller.traffic.refused and not server.strangers:
            server.tick()
        assert server.strangers == 0
    finally:
        client.close()
        server.release()


def test_the_controller_of_a_client_elsewhere_has_the_clients_port() -> None:
    assert not is_here("192.0.2.7") and source_port(("192.0.2.7", 30200)) == 30200
    assert is_here("127.0.0.9") and source_port(("127.0.0.9", PORTS[-1])) in PORTS
