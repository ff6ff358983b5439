"""Hypothesis strategies for FRI messages of any version."""

from __future__ import annotations

from hypothesis import strategies as st

from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.version import Version

number = st.floats(allow_nan=False, allow_infinity=False)
u32 = st.integers(0, 2**32 - 1)
name = st.text("abcdefghijklmnop._ABC123", min_size=1, max_size=20)


def maybe(strategy: st.SearchStrategy) -> st.SearchStrategy:
    return st.none() | strategy


def numbers(size: int) -> st.SearchStrategy:
    return st.tuples(*[number] * size)


joints = numbers(7)
stamps = st.builds(m.TimeStamp, u32, st.integers(0, 999_999_999))
headers = st.builds(m.Header, u32, u32)
redundancies = st.builds(m.Redundancy, st.sampled_from(m.RedundancyStrategy), number)


def transformations(version: Version) -> st.SearchStrategy:
    return st.builds(m.Transformation, name, numbers(7 if version.traits.quaternions else 12), maybe(stamps))


@st.composite
def io_values(draw: st.DrawFn) -> m.IoValue:
    kind = draw(st.sampled_from(m.IoType))
    value = draw(number if kind is m.IoType.ANALOG else st.integers(0, 2**64 - 1))
    return m.IoValue(draw(name), kind, draw(st.sampled_from(m.IoDirection)), value)


def ios(version: Version) -> st.SearchStrategy:
    return st.lists(io_values(), max_size=3).map(tuple) if version.traits.io else st.just(())


def monitorings(version: Version) -> st.SearchStrategy:
    traits = version.traits
    pose = maybe(transformations(version)) if traits.quaternions else st.none()
    redundancy = maybe(redundancies) if traits.quaternions else st.none()
    robot = st.builds(
        m.RobotInfo,
        maybe(st.just(7)),
        maybe(st.sampled_from(m.Safety)),
        st.lists(st.sampled_from(m.DriveState), min_size=7, max_size=7).map(tuple),
        maybe(st.sampled_from(m.OperationMode)),
        maybe(st.sampled_from(m.ControlMode)),
    )
    monitor = st.builds(
        m.MonitorData,
        q=maybe(joints),
        tau=maybe(joints),
        q_cmd=st.none() if traits.quaternions else maybe(joints),
        tau_cmd=maybe(joints),
        tau_ext=maybe(joints),
        wrench=maybe(numbers(6)) if traits.framed else st.none(),
        io=ios(version),
        pose=pose,
        redundancy=redundancy,
        stamp=maybe(stamps),
    )
    connection = st.builds(
        m.ConnectionInfo, st.sampled_from(m.SessionState), st.sampled_from(m.Quality), maybe(u32), maybe(u32)
    )
    ipo = st.builds(
        m.IpoData,
        maybe(joints),
        pose,
        redundancy,
        maybe(st.sampled_from(m.CommandMode)),
        maybe(st.sampled_from(m.Overlay)),
        maybe(number),
    )
    requested = st.lists(transformations(version), max_size=1).map(tuple)
    return st.builds(
        m.Monitoring, headers, maybe(robot), maybe(monitor), maybe(connection), maybe(ipo), requested
    )


def commands(version: Version) -> st.SearchStrategy:
    quaternions = version.traits.quaternions
    return st.builds(
        m.Command,
        headers,
        maybe(joints),
        maybe(numbers(6)),
        maybe(joints),
        st.lists(transformations(version), max_size=2).map(tuple),
        ios(version),
        maybe(transformations(version)) if quaternions else st.none(),
        maybe(redundancies) if quaternions else st.none(),
    )
