"""The client machine: a session from the first datagram to its end, and everything that can go wrong."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from heptarm.errors import CommandRejected
from heptarm.fri.protocol import codec
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.messages import CommandMode, Quality, SessionState
from heptarm.fri.protocol.version import Version
from heptarm.fri.session.events import Kind
from tests.oracles.fri.answers import Setpoint
from tests.oracles.fri.session import Session

from . import strategies as some

MS = 1_000_000
IPO = (0.1, 0.4, -0.1, -1.2, 0.2, 0.9, 0.0)
every_version = pytest.mark.parametrize("wire", Version)


def monitoring(
    wire: Version,
    sequence: int,
    state: SessionState,
    *,
    reflected: int = 0,
    mode: CommandMode = CommandMode.POSITION,
    quality: Quality = Quality.GOOD,
    multiplier: int = 1,
    ipo: tuple[float, ...] | None = IPO,
    requested: tuple[m.Transformation, ...] = (),
    io: tuple[m.IoValue, ...] = (),
    safety: m.Safety = m.Safety.NORMAL_OPERATION,
) -> bytes:
    """A datagram as a controller of that version sends it."""
    quaternions = wire.traits.quaternions
    pose = m.Transformation("ipo", (1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0)) if quaternions else None
    value = m.Monitoring(
        m.Header(sequence, reflected),
        m.RobotInfo(7, safety, (m.DriveState.ACTIVE,) * 7, m.OperationMode.AUT, m.ControlMode.POSITION),
        m.MonitorData(
            q=(0.5,) * 7,
            tau=(1.0,) * 7,
            q_cmd=None if quaternions else (0.25,) * 7,
            tau_ext=(0.0,) * 7,
            io=io,
            pose=pose,
            stamp=m.TimeStamp(1_700_000_000, sequence),
        ),
        m.ConnectionInfo(state, quality, 1, multiplier),
        m.IpoData(q=ipo, pose=pose, command_mode=mode) if state >= SessionState.COMMANDING_WAIT else None,
        requested,
    )
    return codec.encode_monitoring(value, wire)


def kinds(session: Session) -> list[Kind]:
    return [event.kind for event in session.events()]


def heard(session: Session, wire: Version, datagram: bytes, now: int, **setpoint: object) -> m.Command | None:
    """One turn: the decoded answer."""
    session.receive(datagram, now)
    raw = session.answer(Setpoint(**setpoint))  # type: ignore[arg-type]
    return None if raw is None else codec.decode_command(raw, wire)


@every_version
def test_a_session_from_idle_to_commanding_and_back(wire: Version) -> None:
    session = Session(wire)
    states = [
        SessionState.IDLE,
        SessionState.MONITORING_WAIT,
        SessionState.MONITORING_READY,
        SessionState.COMMANDING_WAIT,
        SessionState.COMMANDING_ACTIVE,
        SessionState.MONITORING_READY,
        SessionState.IDLE,
    ]
    target = tuple(value + 0.001 for value in IPO)
    answers = []
    for index, state in enumerate(states):
        answers.append(heard(session, wire, monitoring(wire, index, state), index * MS, q=target))
        assert session.state is state
    idle, waiting, ready, mirror, active, after, end = answers
    assert idle is None and end is None, "in IDLE there is never an answer"
    echo = None if wire.traits.quaternions else (0.25,) * 7
    for one in (waiting, ready, after):
        assert one is not None and one.q == echo and one.tau is None
    assert mirror is not None and mirror.q == IPO, "COMMANDING_WAIT mirrors, whatever is wanted"
    assert active is not None and active.q == target
    assert [answer.header for answer in answers if answer] == [m.Header(i, i + 1) for i in range(5)]
    assert kinds(session).count(Kind.STATE) == 6
    assert session.counters.answered == 5 and session.counters.commanded == 1 and session.counters.lost == 0


@pytest.mark.parametrize("mode", CommandMode)
def test_every_command_mode_gets_the_fields_it_needs(mode: CommandMode) -> None:
    wire = Version.V2_7
    session = Session()
    waiting = heard(session, wire, monitoring(wire, 1, SessionState.COMMANDING_WAIT, mode=mode), 0)
    active = heard(session, wire, monitoring(wire, 2, SessionState.COMMANDING_ACTIVE, mode=mode), MS)
    assert session.mode is mode
    for one in (waiting, active):  # no command: a neutral command is sent
        assert one is not None
        joints = mode in (CommandMode.POSITION, CommandMode.TORQUE, CommandMode.WRENCH)
        assert one.q == (IPO if joints else None)
        assert one.tau == ((0.0,) * 7 if mode is CommandMode.TORQUE else None)
        assert one.wrench == ((0.0,) * 6 if mode is CommandMode.WRENCH else None)
        assert (one.pose is not None) == (mode is CommandMode.CARTESIAN_POSE)


def test_torque_and_wrench_and_pose_arrive_as_wanted() -> None:
    wire, active = Version.V2_5, SessionState.COMMANDING_ACTIVE
    session, tau, wrench = Session(), tuple(map(float, range(7))), tuple(map(float, range(6)))
    pose = m.Transformation("ipo", (9.0,) * 7)
    redundancy = m.Redundancy(m.RedundancyStrategy.E1, 0.5)
    answer = heard(session, wire, monitoring(wire, 1, active, mode=CommandMode.TORQUE), 0, tau=tau)
    assert answer is not None and answer.tau == tau and answer.q == IPO
    answer = heard(session, wire, monitoring(wire, 2, active, mode=CommandMode.WRENCH), 0, wrench=wrench)
    assert answer is not None and answer.wrench == wrench and answer.tau is None
    answer = heard(
        session,
        wire,
        monitoring(wire, 3, active, mode=CommandMode.CARTESIAN_POSE),
        0,
        pose=pose,
        redundancy=redundancy,
    )
    assert answer is not None and (answer.pose, answer.redundancy, answer.q) == (pose, redundancy, None)
    assert kinds(session).count(Kind.COMMAND_MODE) == 3


@pytest.mark.parametrize(("multiplier", "answers"), [(0, 12), (1, 12), (2, 6), (5, 2)])
def test_every_multiplier_th_message_is_answered(multiplier: int, answers: int) -> None:
    wire, session = Version.V1_15, Session()
    for index in range(12):
        session.receive(
            monitoring(wire, index, SessionState.MONITORING_READY, multiplier=multiplier), index * MS
        )
        raw = session.answer()
        assert session.answer() is None, "one message, one answer"
        if raw is not None:
            assert codec.decode_command(raw, wire).header.reflected == index
    assert session.counters.answered == answers


def test_lost_duplicated_and_reordered_messages_are_counted_and_not_answered_twice() -> None:
    wire, session = Version.V1_15, Session()
    answered = []
    for now, sequence in enumerate([10, 11, 11, 14, 13, 15]):
        if session.receive(monitoring(wire, sequence, SessionState.COMMANDING_ACTIVE), now * MS):
            answered.append(sequence)
            assert session.answer() is not None
        else:
            assert session.answer() is None
    assert answered == [10, 11, 14, 15]
    counts = session.counters
    assert (counts.lost, counts.duplicated, counts.reordered) == (1, 1, 1), "12 alone never came"
    assert {Kind.LOST, Kind.DUPLICATED, Kind.REORDERED} <= set(kinds(session))


def test_answers_that_the_controller_did_not_take_are_counted() -> None:
    wire, session = Version.V1_15, Session()
    for index, reflected in enumerate([0, 0, 1, 1, 1, 4, 5]):  # answers 2 and 3 came too late
        session.receive(monitoring(wire, index, SessionState.COMMANDING_ACTIVE, reflected=reflected), index)
        session.answer()
    assert session.counters.missed == 2


def test_answers_of_an_earlier_session_are_not_missed_in_the_next() -> None:
    wire, session = Version.V1_15, Session()
    for index in range(100):
        session.receive(monitoring(wire, 500 + index, SessionState.COMMANDING_ACTIVE, reflected=index), index)
        session.answer()
    # the controller starts again: it has received nothing yet, then it receives answers of this session
    for index, reflected in enumerate([0, 0, 100, 101, 104]):
        session.receive(
            monitoring(wire, index, SessionState.MONITORING_READY, reflected=reflected), 200 + index
        )
        session.answer()
    assert session.counters.restarts == 1
    assert session.counters.missed == 2  # 102 and 103


def test_counter_wraps() -> None:
    wire, session = Version.V1_15, Session()
    for index, sequence in enumerate([2**32 - 2, 2**32 - 1, 0, 1]):
        assert session.receive(monitoring(wire, sequence, SessionState.MONITORING_READY), index * MS)
    assert session.counters.lost == session.counters.restarts == 0


def test_a_new_session_begins_while_the_client_runs() -> None:
    wire, session = Version.V1_15, Session()
    session.receive(monitoring(wire, 5000, SessionState.COMMANDING_ACTIVE), 0)
    session.answer()
    assert session.receive(monitoring(wire, 0, SessionState.MONITORING_WAIT), 1 * MS)
    assert session.answer() is not None and session.counters.restarts == 1
    texts = [event.text for event in session.events() if event.kind is Kind.STATE]
    assert texts[-2:] == ["COMMANDING_ACTIVE -> IDLE", "IDLE -> MONITORING_WAIT"], (
        "commanding was left in between"
    )
    # and soon after a short one, where the counter alone would look overtaken
    session.receive(monitoring(wire, 1, SessionState.IDLE), 2 * MS)
    assert session.receive(monitoring(wire, 0, SessionState.MONITORING_WAIT), 3 * MS)
    assert session.counters.restarts == 2 and session.counters.reordered == 0


@pytest.mark.parametrize("spoken", [Version.V1_15, Version.V2_5, Version.V2_7])
@pytest.mark.parametrize("reported", [Version.V1_15, Version.V2_5, Version.V2_7])
def test_a_wrong_version_is_named_in_words_and_once(spoken: Version, reported: Version) -> None:
    session = Session(reported)
    for index in range(5):
        sample = session.receive(monitoring(spoken, index, SessionState.MONITORING_WAIT), index * MS)
        assert (sample is not None) == (spoken is reported)
    if spoken is reported:
        assert session.trouble == "" and session.version is reported
        return
    assert "speaks FRI" in session.trouble and reported.value in session.trouble
    assert kinds(session) == [Kind.WRONG_VERSION] and session.answer() is None
    assert session.counters.malformed == 5


@pytest.mark.parametrize("wire", [Version.V1_15, Version.V2_5, Version.V2_7])
def test_version_is_taken_from_the_first_datagram_and_follows_a_new_one(wire: Version) -> None:
    session = Session()
    assert session.receive(b"garbage", 0) is None and "no FRI message" in session.events()[0].text
    assert session.receive(monitoring(wire, 0, SessionState.MONITORING_WAIT), 0) and session.version is wire
    other = Version.V2_7 if not wire.traits.framed else Version.V1_15
    assert session.receive(monitoring(other, 0, SessionState.MONITORING_WAIT), 10**9)
    assert session.version is other
    raw = session.answer()
    assert raw is not None and codec.decode_command(raw, other)


def test_a_position_that_is_no_number_is_no_message() -> None:
    session = Session()
    broken = (float("nan"),) + IPO[1:]
    assert session.receive(monitoring(Version.V1_15, 0, SessionState.COMMANDING_ACTIVE), 0)
    session.answer()
    assert (
        session.receive(monitoring(Version.V1_15, 1, SessionState.COMMANDING_ACTIVE, ipo=broken), MS) is None
    )
    assert session.answer() is None and session.counters.malformed == 1


def test_without_an_interpolator_position_it_answers_with_a_header_and_reports_it() -> None:
    session = Session()
    answer = heard(
        session, Version.V1_15, monitoring(Version.V1_15, 0, SessionState.COMMANDING_WAIT, ipo=None), 0
    )
    assert answer == m.Command(m.Header(0, 0)) and Kind.NO_IPO in kinds(session)


def test_io_and_transformations_are_checked_against_what_the_controller_offers() -> None:
    wire, active = Version.V1_15, SessionState.COMMANDING_ACTIVE
    output = m.IoValue("FRI.Out", m.IoType.BOOLEAN, m.IoDirection.OUTPUT, 0)
    signals = (output, m.IoValue("FRI.In", m.IoType.BOOLEAN, m.IoDirection.INPUT, 1))
    base = m.Transformation("PBase", (0.0,) * 12)
    session = Session()
    datagram = monitoring(wire, 0, active, io=signals, requested=(base,))
    answer = heard(session, wire, datagram, 0, io=(replace(output, value=1),), transformations=(base,))
    assert answer is not None and answer.io[0].value == 1 and answer.transformations == (base,)
    assert answer.q == IPO
    for wrong, text in (
        (Setpoint(io=(replace(output, name="FRI.In"),)), "has no output"),
        (Setpoint(io=(replace(output, type=m.IoType.ANALOG),)), "must be BOOLEAN, got ANALOG"),
        (Setpoint(transformations=(replace(base, name="Other"),)), "requests no transformation"),
    ):
        session.receive(monitoring(wire, session.sent, active, io=signals, requested=(base,)), 0)
        with pytest.raises(CommandRejected, match=text):
            session.answer(wrong)
        assert session.answer() is not None, "the refused setpoint may be replaced in the same cycle"


def test_latency_and_jitter_are_measured_from_the_times_passed_in() -> None:
    wire, session = Version.V1_15, Session()
    arrivals = [0, MS, 2 * MS + 300_000, 3 * MS, 4 * MS]
    for index, now in enumerate(arrivals):
        session.receive(monitoring(wire, index, SessionState.MONITORING_READY), now)
        session.answer()
        session.answered(now + 50_000)
    assert session.latency.percentiles(0.5) == pytest.approx((50.5e-6,))
    assert session.latency.longest == pytest.approx(50e-6)
    assert session.jitter.longest == pytest.approx(300e-6)


def test_safety_and_quality_are_reported() -> None:
    wire, session = Version.V1_15, Session()
    for index, (quality, safety) in enumerate(
        [(Quality.POOR, 0), (Quality.GOOD, 0), (Quality.GOOD, 1), (Quality.EXCELLENT, 0)]
    ):
        session.receive(
            monitoring(wire, index, SessionState.MONITORING_WAIT, quality=quality, safety=m.Safety(safety)),
            index * MS,
        )
    reported = [event.text for event in session.events() if event.kind in (Kind.QUALITY, Kind.SAFETY)]
    assert reported == [
        "quality POOR -> GOOD",
        "safety state STOP_0",
        "quality GOOD -> EXCELLENT",
        "safety state NORMAL_OPERATION",
    ]
    assert (session.counters.poor, session.counters.good, session.counters.excellent) == (1, 2, 1)


@pytest.mark.slow
@every_version
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_any_message_is_answered_legally_or_not_at_all(wire: Version, data: st.DataObject) -> None:
    session = Session(wire)
    for now in range(2):
        raw = codec.encode_monitoring(data.draw(some.monitorings(wire)), wire)
        session.receive(raw, now * MS)
        answer = session.answer()
        if answer is not None:
            assert session.state is not SessionState.IDLE
            command = codec.decode_command(answer, wire)
            assert session.sample is not None
            assert command.header.reflected == session.sample.sequence


class Exchange(RuleBasedStateMachine):
    """A controller that behaves at random: the client's counters stay correct."""

    def __init__(self) -> None:
        super().__init__()
        self.session = Session(Version.V1_15)
        self.sequence, self.now, self.sent = 100, 0, 0
        self.state = SessionState.IDLE
        self.answers: list[m.Command] = []

    def _send(self, datagram: bytes) -> None:
        self.session.receive(datagram, self.now)
        raw = self.session.answer(Setpoint(q=(0.3,) * 7))
        if raw is not None:
            self.answers.append(codec.decode_command(raw, Version.V1_15))

    @rule(state=st.sampled_from(SessionState), skip=st.integers(0, 3))
    def message(self, state: SessionState, skip: int) -> None:
        self.sequence += 1 + skip
        self.now += (1 + skip) * MS
        self.state = state
        before = len(self.answers)
        self._send(monitoring(Version.V1_15, self.sequence, state))
        self.sent += 1
        fresh = self.answers[before:]
        assert len(fresh) == (state is not SessionState.IDLE)
        for one in fresh:
            assert one.header.reflected == self.sequence
            wanted = {SessionState.COMMANDING_WAIT: IPO, SessionState.COMMANDING_ACTIVE: (0.3,) * 7}
            assert one.q == wanted.get(state, (0.25,) * 7)

    @rule()
    def same_again(self) -> None:
        if self.sent:
            before = len(self.answers)
            self._send(monitoring(Version.V1_15, self.sequence, self.state))
            assert len(self.answers) == before

    @rule(raw=st.binary(max_size=40))
    def garbage(self, raw: bytes) -> None:
        before = self.session.state
        self._send(raw)
        assert self.session.state is before

    @invariant()
    def counters_grow_by_one(self) -> None:
        assert [answer.header.sequence for answer in self.answers] == list(range(len(self.answers)))
        if self.sent:
            assert self.session.state is self.state


TestExchange = Exchange.TestCase
TestExchange.settings = settings(
    max_examples=30, stateful_step_count=20, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
