"""A bad network with real TCP and UDP: packets get lost, late and out of order, or nothing gets through at all."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pytest

import heptarm as ha
from bench.measure.cabinet import Cabinet
from bench.measure.network import ADDRESSES, BAD, CUT, BadNetwork, Impairment, why_not
from bench.trust.network import stream
from heptarm.arm.motion.servo import JointServo
from heptarm.cli.doctor import datagram_check
from tests.long import longer

_REASON = why_not()
pytestmark = [
    pytest.mark.alone,
    pytest.mark.skipif(bool(_REASON), reason=f"this machine allows no network of its own: {_REASON}"),
]
GOOD = Impairment()


@pytest.fixture(scope="module")
def network() -> Iterator[BadNetwork]:
    with BadNetwork(GOOD) as one:
        yield one


@pytest.fixture(scope="module")
def cabinet(network: BadNetwork) -> Iterator[Cabinet]:
    with network.on("cabinet", lambda: Cabinet("--host", ADDRESSES["cabinet"])) as one:
        yield one


@pytest.fixture
def arm(network: BadNetwork, cabinet: Cabinet) -> Iterator[ha.Arm]:
    target = f"{ADDRESSES['cabinet']}:{cabinet.port}"
    network.impairment = GOOD
    arm = network.on("client", lambda: ha.connect(target, datagrams=True, timeout=30.0, watchdog=1.0))
    try:
        arm.wait_until(lambda _: arm.connection.datagrams.gets_through, timeout=30.0)
        yield arm
    finally:
        network.impairment = GOOD
        arm.close()


def follows(servo: JointServo, seconds: float) -> bool:
    until = time.monotonic() + seconds
    while time.monotonic() < until and servo.tick() is not None:
        servo.set(servo.start.q + 0.1 * np.sin(servo.t) * np.eye(7)[5])
    return bool(servo.active)


def test_servo_streams_live_where_one_packet_in_ten_is_lost(network: BadNetwork, cabinet: Cabinet) -> None:
    network.impairment = BAD
    try:
        found = [stream(network, cabinet.port, "udp", longer(5.0, 60.0)) for _ in range(longer(1, 6))]
    finally:
        network.impairment = GOOD
    assert [one.outcome for one in found] == ["alive"] * len(found)
    assert all(one.stop is not None and one.received > 100 for one in found)
    assert network.lost > 50


@pytest.mark.parametrize("protocol", ["tcp", "udp"])
def test_a_cut_of_one_protocol_ends_nothing(network: BadNetwork, arm: ha.Arm, protocol: str) -> None:
    with arm.servo(rate=200, watchdog=1.0) as servo:
        assert follows(servo, 0.3)
        network.impairment = Impairment(cut=frozenset([protocol]))  # type: ignore[list-item]
        assert follows(servo, 2.5)
        assert arm.state.age < 1.0
        network.impairment = GOOD
        assert follows(servo, 0.3)
    assert arm.in_control


def test_a_cut_of_everything_stops_the_arm(network: BadNetwork, cabinet: Cabinet, arm: ha.Arm) -> None:
    target = f"{ADDRESSES['cabinet']}:{cabinet.port}"
    observer = network.on("cabinet", lambda: ha.connect(target, control=False, timeout=30.0))
    with observer, pytest.raises(ha.HeptarmError), arm.servo(rate=200, watchdog=0.5) as servo:
        assert follows(servo, 0.5)
        network.impairment = CUT
        observer.wait_until(lambda state: not state.motion.active, timeout=30.0)
        observer.wait_until(lambda state: float(np.abs(state.dq).max()) < 5e-3, timeout=30.0)
        observer.wait_until(lambda _: observer.controller == "", timeout=30.0)
        network.impairment = GOOD
        follows(servo, 5.0)


def test_doctor_reports_whether_datagrams_get_through(network: BadNetwork, arm: ha.Arm) -> None:
    assert datagram_check(arm).how == "ok"
    network.impairment = Impairment(cut=frozenset(["udp"]))
    time.sleep(1.2)  # the last answer is older than a second
    blocked = datagram_check(arm)
    assert blocked.how == "note" and "UDP" in blocked.found
    assert blocked.remedy
