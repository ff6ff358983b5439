"""The fast writer writes what the codec writes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.codec import encode_monitoring
from heptarm.fri.protocol.version import Version
from heptarm.sim.fri.monitoring import KEPT, MonitoringEncoder
from tests.fri import strategies as messages

WRITERS = {
    version: MonitoringEncoder(version) for version in Version
}  # used like in a session: kept values must not leak


@given(st.data(), st.sampled_from(Version))
def test_byte_for_byte_as_the_codec(data: st.DataObject, version: Version) -> None:
    message = data.draw(messages.monitorings(version))
    assert WRITERS[version].encode(message) == encode_monitoring(message, version)


def test_equal_signals_are_not_always_the_same() -> None:
    writer = MonitoringEncoder(Version.V1_15)
    for value in (0.0, -0.0):
        signal = m.IoValue("A.B", m.IoType.ANALOG, m.IoDirection.INPUT, value)
        message = m.Monitoring(m.Header(0, 0), monitor=m.MonitorData(io=(signal,)))
        assert writer.encode(message) == encode_monitoring(message, Version.V1_15)


def test_it_forgets_before_it_remembers_too_much() -> None:
    writer = MonitoringEncoder(Version.V1_15)
    for period in range(3 * KEPT):
        info = m.ConnectionInfo(m.SessionState.IDLE, m.Quality.POOR, period, 1)
        message = m.Monitoring(m.Header(period, 0), connection=info)
        assert writer.encode(message) == encode_monitoring(message, Version.V1_15)
    assert len(writer._kept) <= KEPT


@pytest.mark.parametrize(
    ("version", "data", "text"),
    [
        (Version.V2_5, m.MonitorData(q_cmd=(0.0,) * 7), "commanded joint position"),
        (Version.V2_5, m.MonitorData(wrench=(0.0,) * 6), "external force"),
        (
            Version.V1_15,
            m.MonitorData(redundancy=m.Redundancy(m.RedundancyStrategy.E1, 0.0)),
            "Cartesian pose",
        ),
        (Version.V1_11, m.MonitorData(io=(m.IoValue("a", m.IoType.BOOLEAN, m.IoDirection.INPUT, 0),)), "IO"),
    ],
)
def test_what_a_version_cannot_carry_is_refused(version: Version, data: m.MonitorData, text: str) -> None:
    with pytest.raises(ValueError, match=text):
        MonitoringEncoder(version).encode(m.Monitoring(m.Header(0, 0), monitor=data))
