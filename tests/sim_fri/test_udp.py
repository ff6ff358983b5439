"""Sessions over real sockets. Both sides alternate on a simulated clock, so that no test depends on the machine."""

from __future__ import annotations

import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from heptarm.errors import CommandRejected, ConnectFailed
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.version import Version, recognise
from heptarm.io.clock import StepClock
from heptarm.sim.fri.faults import FaultScenario, LinkFaults
from heptarm.sim.fri.overlay import CONTROLS, MotionOverlay
from heptarm.sim.fri.server import Server, source_port
from heptarm.sim.fri.settings import (
    Event,
    OutputWritten,
    OverlayEnded,
    QualityChanged,
    Refused,
    SessionConfiguration,
    StateChanged,
    describe,
)
from heptarm.sim.runtime.standalone_fri import PAUSE, Standalone, StandaloneSettings, command_mode
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import Position
from tests.sim_fri.rig import READY, Arm, Client, State, mirror

HERE = "127.0.0.1"


class Peer:
    """A client on a socket of its own."""

    def __init__(self, version: Version, multiplier: int = 1) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((HERE, 0))
        self.socket.settimeout(5.0)
        self.client = Client(version, multiplier=multiplier)
        self.address: tuple[str, int] = self.socket.getsockname()
        self.sources: set[tuple[str, int]] = set()
        self.datagram = b""

    def turn(self) -> None:
        """Receive one message and answer it."""
        self.datagram, source = self.socket.recvfrom(2000)
        self.sources.add(source)
        answer = self.client.answer(self.datagram)
        if answer is not None:
            self.socket.sendto(answer, source)


class Bench:
    """Server, arm and peer, turn by turn."""

    def __init__(self, configuration: SessionConfiguration, scenario: FaultScenario | None = None) -> None:
        self.arm, self.clock, self.events = Arm(), StepClock(), list[Event]()
        self.peer = Peer(configuration.version, configuration.multiplier)
        self.configuration = configuration
        self.server = Server(
            configuration,
            self.arm,
            client=self.peer.address,
            port=0,
            bind=HERE,
            clock=self.clock.nanos,
            scenario=scenario,
            listener=self.events.append,
        )
        self.controller = self.server.controller
        self._tick = 0

    def run(self, ticks: int, *, answering: bool = True) -> None:
        for _ in range(ticks):
            self.clock.step(1e-3)
            self.server.tick()
            self.arm.tick()
            if self.controller.state is State.IDLE:
                continue
            if self._tick % self.configuration.period_ms == 0 and answering:
                self.peer.turn()
            self._tick += 1

    def until(self, state: m.SessionState) -> None:
        for _ in range(3000):
            if self.controller.state is state:
                return
            self.run(1)
        raise AssertionError(f"{self.controller.state.name} instead of {state.name}")

    def active(self, overlay: MotionOverlay | None = None) -> None:
        self.server.open()
        self.until(State.MONITORING_READY)
        self.server.start(overlay or MotionOverlay())
        self.until(State.COMMANDING_ACTIVE)

    def end(self) -> None:
        self.server.release()
        self.peer.socket.close()

    @property
    def reported(self) -> list[str]:
        return [event.text for event in self.events if isinstance(event, Refused)]


@contextmanager
def bench(
    version: Version = Version.V1_15, *args: Any, scenario: FaultScenario | None = None
) -> Iterator[Bench]:
    bench = Bench(SessionConfiguration(version, *args), scenario)
    try:
        yield bench
    finally:
        bench.end()


@pytest.mark.parametrize("version", Version)
@pytest.mark.parametrize("mode", list(CONTROLS))
def test_every_version_and_mode_from_opening_to_closing(version: Version, mode: m.CommandMode) -> None:
    overlay = MotionOverlay(mode, CONTROLS[mode][0])
    with bench(version) as b:
        if mode is m.CommandMode.CARTESIAN_POSE and not version.traits.quaternions:
            b.server.open()
            b.until(State.MONITORING_READY)
            with pytest.raises(CommandRejected, match="no command mode"):
                b.server.start(overlay)
            return
        b.active(overlay)
        b.run(60)
        assert b.arm.action is not None and b.arm.action.q == pytest.approx(np.array(READY), abs=1e-9)
        assert recognise(b.peer.datagram) in (version, Version.V1_15)  # 1.11 looks like 1.14 without signals
        b.server.stop()
        b.run(5)
        assert b.arm.action is None
        b.server.close()
        b.run(2)
        b.peer.turn()
        states = [s.connection.state for s in b.peer.client.seen if s.connection is not None]
        assert [s for n, s in enumerate(states) if n == 0 or s is not states[n - 1]] == [
            State.MONITORING_WAIT,
            State.MONITORING_READY,
            State.COMMANDING_WAIT,
            State.COMMANDING_ACTIVE,
            State.MONITORING_READY,
            State.IDLE,
        ]
        assert b.peer.sources == {(HERE, b.server.port)} and b.reported == []


@pytest.mark.parametrize(("period", "multiplier"), [(1, 2), (5, 1), (2, 5)])
def test_periods_and_multipliers_over_sockets(period: int, multiplier: int) -> None:
    with bench(Version.V2_7, period, multiplier) as b:
        b.active()
        b.run(300)
        meter = b.controller.meter
        assert b.controller.quality is m.Quality.EXCELLENT and meter.counts.lost == meter.counts.late == 0


def test_the_arm_does_what_the_client_reports() -> None:
    with bench() as b:
        b.active()
        first = b.peer.client.seen[-1].header.sequence

        def law(message: m.Monitoring) -> m.Command:
            offset = 0.4e-3 * min(500, message.header.sequence - first)
            return replace(mirror(message), q=(READY[0] + offset, *READY[1:]))

        b.peer.client.law = law
        b.run(600)
        assert b.arm.q[0] == pytest.approx(READY[0] + 0.2, abs=1e-9)


def test_a_second_session_comes_from_the_same_port() -> None:
    with bench() as b:
        b.active()
        b.server.close()
        b.run(2)
        b.server.release()
        again = Server(b.configuration, b.arm, client=b.peer.address, port=b.server.port, bind=HERE)
        again.release()
        assert again.port == b.server.port


def test_strangers_are_ignored_and_reported() -> None:
    with bench() as b, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        b.active()
        stranger.bind((HERE, 0))
        for _ in range(3):
            stranger.sendto(b.peer.datagram, (HERE, b.server.port))
        b.run(5)
        assert b.server.strangers == 3 and b.controller.state is State.COMMANDING_ACTIVE
        assert len(b.reported) == 1 and f"{HERE}:{stranger.getsockname()[1]} was ignored" in b.reported[0]


def test_a_flood_holds_up_nothing() -> None:
    with bench() as b:
        b.active()
        for _ in range(150):
            b.peer.socket.sendto(b"\x0a" * 50, (HERE, b.server.port))
        b.run(10)
        assert b.controller.state is State.COMMANDING_ACTIVE and b.controller.traffic.refused == 150


def test_a_client_that_dies_ends_commanding_and_its_successor_commands() -> None:
    with bench(scenario=FaultScenario()) as b:
        b.active()
        b.run(60, answering=False)
        assert b.controller.state is State.MONITORING_WAIT and b.arm.action is None
        b.peer.client = Client(Version.V1_15)
        for _ in range(60):
            b.peer.turn()  # what arrived for the previous socket
        b.until(State.MONITORING_READY)
        b.server.start(MotionOverlay())
        b.until(State.COMMANDING_ACTIVE)


def test_a_scenario_acts_on_both_directions_and_on_the_robot() -> None:
    scenario = FaultScenario(from_client=LinkFaults(duplicate=1.0), stops=(((0.5, 0.6), m.Safety.STOP_0),))
    with bench(scenario=scenario) as b:
        b.active()
        b.run(700)
        assert b.controller.traffic.stale >= 600
        ends = [event for event in b.events if isinstance(event, OverlayEnded)]
        assert [end.cause for end in ends] == ["safety"] and "safety stop 0 or 1" in ends[0].text


# ------------------------------------------------------------------------------ addresses


def test_a_taken_port_is_named_with_what_to_do() -> None:
    with bench() as b, pytest.raises(ConnectFailed, match=rf"UDP port {b.server.port}.*30200 to 30209"):
        Server(b.configuration, b.arm, client=b.peer.address, port=b.server.port, bind=HERE)


def test_beside_a_client_on_this_machine_any_port_will_do() -> None:
    with bench() as b, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        port = source_port(b.peer.address)
        with suppress(OSError):  # another process has it: as good
            other.bind((HERE, port))
        server = Server(b.configuration, b.arm, client=b.peer.address, bind=HERE)
        assert server.port not in (port, b.peer.address[1])
        server.release()


@pytest.mark.parametrize(
    ("client", "text"),
    [((HERE, 0), "got 0"), ((HERE, 70000), "70000"), (("no..host", 1), "no IPv4")],
)
def test_an_address_that_is_none(client: tuple[str, int], text: str) -> None:
    with pytest.raises(ConnectFailed, match=text):
        Server(SessionConfiguration(Version.V1_15), Arm(), client=client, port=0)


@pytest.mark.parametrize(
    ("client", "port"),
    [
        (("172.31.1.148", 30200), 30200),
        (("172.31.1.148", 30205), 30205),
        ((HERE, 30200), 30201),
        ((HERE, 30209), 30200),
        (("localhost", 30203), 30204),
    ],
)
def test_the_source_port_is_the_clients_unless_both_are_one_machine(
    client: tuple[str, int], port: int
) -> None:
    assert source_port(client) == port


# ------------------------------------------------------------------------------ without an application


def turns(standalone: Standalone, peer: Peer, count: int) -> None:
    for _ in range(count):
        standalone.tick()
        peer.turn()


@contextmanager
def offered(arm: Arm, **settings: Any) -> Iterator[tuple[Standalone, Peer, list[str]]]:
    """A stand-alone controller whose time is its ticks, and a peer."""
    said: list[str] = []
    version = Version.V2_5
    peer = Peer(version)
    options: dict[str, Any] = {
        "configuration": SessionConfiguration(version),
        "client": peer.address,
        "port": 0,
        "speed": 0.0,
    } | settings
    with peer.socket:
        standalone = Standalone(
            arm, StandaloneSettings(**options), listener=lambda event: said.append(describe(event))
        )
        try:
            standalone.server.open()
            yield standalone, peer, said
        finally:
            standalone.server.release()


def test_it_offers_an_overlay_as_soon_as_the_client_answers_well() -> None:
    arm = Arm()
    with offered(arm) as (standalone, peer, said):
        turns(standalone, peer, 200)
        assert standalone.server.controller.state is State.COMMANDING_ACTIVE and arm.mode == Position()
    assert said[0] == "session IDLE -> MONITORING_WAIT" and any(
        "quality FAIR -> GOOD" in line for line in said
    )


@pytest.mark.parametrize(
    ("command", "mode"),
    [("torque", JointImpedance(200.0)), ("wrench", CartesianImpedance()), ("pose", Position())],
)
def test_a_command_mode_brings_its_usual_control_mode(command: str, mode: object) -> None:
    arm = Arm()
    with offered(arm, command=command_mode(command)) as (standalone, peer, _):
        turns(standalone, peer, 200)
        assert standalone.server.controller.state is State.COMMANDING_ACTIVE and arm.mode == mode


def test_monitoring_alone_offers_nothing() -> None:
    arm = Arm()
    with offered(arm, command=command_mode("monitor")) as (standalone, peer, _):
        turns(standalone, peer, 300)
        assert standalone.server.controller.state is State.MONITORING_READY and arm.holds == 0


def test_after_an_error_it_waits_a_moment_and_offers_again() -> None:
    arm = Arm()
    with offered(arm) as (standalone, peer, said):
        turns(standalone, peer, 200)
        peer.client.law = lambda message: replace(mirror(message), q=(0.0,) * 7)
        turns(standalone, peer, 5)
        peer.client.law = mirror
        assert arm.mode is None and any("overlay ended: Illegal axis delta" in line for line in said)
        turns(standalone, peer, PAUSE - 10)
        assert standalone.server.controller.state is State.MONITORING_READY and arm.holds == 1
        turns(standalone, peer, 30)
        assert standalone.server.controller.state is State.COMMANDING_ACTIVE and arm.holds == 2


def test_it_offers_nothing_during_a_safety_stop() -> None:
    arm = Arm()
    with offered(arm) as (standalone, peer, _):
        arm.safety = m.Safety.STOP_1
        turns(standalone, peer, 200)
        assert standalone.server.controller.state is State.MONITORING_READY and arm.holds == 0
        arm.safety = m.Safety.NORMAL_OPERATION
        turns(standalone, peer, 20)
        assert standalone.server.controller.state is State.COMMANDING_ACTIVE


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        (
            {"command": m.CommandMode.TORQUE, "mode": Position()},
            "TORQUE is not possible in control mode POSITION",
        ),
        (
            {"command": m.CommandMode.CARTESIAN_POSE, "configuration": SessionConfiguration(Version.V1_11)},
            "CARTESIAN_POSE",
        ),
        (
            {"command": m.CommandMode.TORQUE, "configuration": SessionConfiguration(Version.V1_11, 10)},
            "got 10 ms",
        ),
    ],
)
def test_what_does_not_go_together_is_refused_before_a_port_is_taken(
    settings: dict[str, object], text: str
) -> None:
    with pytest.raises(CommandRejected, match=text), offered(Arm(), **settings):
        pass
    with pytest.raises(CommandRejected, match="one of monitor, position"):
        command_mode("velocity")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks Linux for its sockets")
def test_a_client_that_hears_another_port_is_named() -> None:
    """KUKA's SDK with the cabinet's address: its socket is connected to the cabinet's port, on one machine its own."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as application:
        application.bind((HERE, 0))
        port = application.getsockname()[1]
        application.connect((HERE, port))
        said: list[str] = []
        server = Server(
            SessionConfiguration(Version.V1_15),
            Arm(),
            client=(HERE, port),
            port=0,
            speed=0.0,
            listener=lambda event: said.append(describe(event)),
        )
        server.open()
        for _ in range(1100):
            server.tick()
        server.release()
    assert sum(f"only receives from port {port}" in line for line in said) == 1


def test_events_have_words() -> None:
    io = m.IoValue("A.B", m.IoType.BOOLEAN, m.IoDirection.OUTPUT, 1)
    assert describe(StateChanged(State.IDLE, State.MONITORING_WAIT)) == "session MONITORING_WAIT -> IDLE"
    assert describe(QualityChanged(m.Quality.GOOD, m.Quality.FAIR, 0.00025, 0.0001)) == (
        "quality FAIR -> GOOD (latency 0.25 ms, jitter 0.10 ms)"
    )
    assert describe(OverlayEnded("cancelled", "")) == "overlay ended: cancelled"
    assert describe(Refused("no")) == "no" and describe(OutputWritten(io)) == "output A.B = 1"
