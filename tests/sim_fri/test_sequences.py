"""Random events of client, application and network: the session never leaves its state table."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import inf, nan

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule, run_state_machine_as_test

from heptarm.errors import CommandRejected
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.version import Version
from heptarm.sim.fri.overlay import CONTROLS, MotionOverlay
from heptarm.sim.fri.settings import OverlayEnded, SessionConfiguration, StateChanged
from tests.fri import strategies as messages
from tests.oracles.fri.codec import encode_command
from tests.sim_fri.rig import READY, Rig, State, mirror

W, R, CW, CA = State.MONITORING_WAIT, State.MONITORING_READY, State.COMMANDING_WAIT, State.COMMANDING_ACTIVE
LEGAL = {
    (State.IDLE, W),
    (W, R),
    (R, W),
    (R, CW),
    (CW, CA),
    (CW, R),
    (CW, W),
    (CA, R),
    (CA, W),
    (W, State.IDLE),
    (R, State.IDLE),
}

number = st.sampled_from((nan, inf, -inf, 1e300, 400.0)) | st.floats(-5.0, 5.0)
jumps = st.tuples(*[st.sampled_from(READY) | number] * 7)


class Session(RuleBasedStateMachine):
    @initialize(
        version=st.sampled_from(Version),
        receive=st.sampled_from([(1, 1), (1, 3), (5, 1), (2, 10)]),
        latency=st.sampled_from([100_000, 900_000, 2_500_000]),
    )
    def begin(self, version: Version, receive: tuple[int, int], latency: int) -> None:
        self.rig = Rig(configuration=SessionConfiguration(version, *receive), latency=latency)
        self.started = 0
        self.rig.controller.open()

    @rule(ticks=st.integers(1, 300))
    def let_time_pass(self, ticks: int) -> None:
        self.rig.run(ticks)

    @rule(silent=st.booleans())
    def silence(self, silent: bool) -> None:
        self.rig.silent = silent

    @rule(mode=st.sampled_from(m.CommandMode), control=st.sampled_from(m.ControlMode))
    def start(self, mode: m.CommandMode, control: m.ControlMode) -> None:
        try:
            self.rig.controller.start(MotionOverlay(mode, control))
        except CommandRejected:
            return
        self.started += 1

    @rule(mode=st.sampled_from(list(CONTROLS)))
    def come_to_command(self, mode: m.CommandMode) -> None:
        """A sequence that random steps seldom find."""
        rig = self.rig
        rig.silent, rig.arm.safety = False, m.Safety.NORMAL_OPERATION
        rig.client.law = rig.client.waiting = mirror
        rig.run(700)
        self.start(mode, CONTROLS[mode][0])
        rig.run(250)

    @rule()
    def stop(self) -> None:
        self.rig.controller.stop()

    @rule(safety=st.sampled_from(m.Safety))
    def safety(self, safety: m.Safety) -> None:
        self.rig.arm.safety = safety

    @rule(q=jumps | st.none(), tau=jumps | st.none())
    def command(self, q: tuple[float, ...] | None, tau: tuple[float, ...] | None) -> None:
        self.rig.client.law = lambda message: replace(mirror(message), q=q, tau=tau)

    @rule(step=st.floats(-2e-3, 2e-3), axis=st.integers(0, 6))
    def drive(self, step: float, axis: int) -> None:
        """A steady motion near the limit of the axes, from the current position."""
        arm = self.rig.arm

        def law(message: m.Monitoring) -> m.Command:
            return replace(mirror(message), q=tuple((arm.q + step * (np.arange(7) == axis)).tolist()))

        self.rig.client.law = law

    @rule(raw=st.binary(max_size=200))
    def garbage(self, raw: bytes) -> None:
        self.rig.controller.receive(raw, self.rig.now)

    @rule(data=st.data(), version=st.sampled_from(Version))
    def stranger(self, data: st.DataObject, version: Version) -> None:
        self.rig.controller.receive(
            encode_command(data.draw(messages.commands(version)), version), self.rig.now
        )

    @rule()
    def close(self) -> None:
        self.rig.controller.close()

    @invariant()
    def only_legal_transitions(self) -> None:
        changes = [e for e in self.rig.events if isinstance(e, StateChanged)]
        assert all((change.before, change.state) in LEGAL for change in changes)
        assert all(first.state is second.before for first, second in pairwise(changes))

    @invariant()
    def an_overlay_ends_once(self) -> None:
        rig = self.rig
        rig.events += rig.controller.events()
        ended = sum(isinstance(event, OverlayEnded) for event in rig.events)
        assert self.started - ended == (rig.controller.overlay is not None)
        if rig.controller.state is not R:  # an overlay may wait for the end of MONITORING_READY
            assert (rig.controller.overlay is None) == (rig.controller.state < R)
        assert rig.controller.superposition is None or rig.controller.state is CA

    @invariant()
    def the_arm_is_never_thrown(self) -> None:
        arm = self.rig.arm
        if len(arm.track) > 1:
            assert (arm.leaps <= 1.2 * arm.robot.dq_max * 1e-3 + 1e-12).all()
            assert (np.abs(np.array(arm.track)) <= arm.robot.q_max + 1e-12).all()
        for tau, wrench in arm.loads:
            assert tau is None or (np.abs(tau) <= arm.robot.tau_max).all()
            assert wrench is None or np.isfinite(wrench).all()


def test_any_sequence_stays_within_the_table() -> None:
    run_state_machine_as_test(
        Session, settings=settings(max_examples=15, stateful_step_count=14, deadline=None)
    )


@given(
    st.lists(st.tuples(st.integers(0, 400), st.integers(0, 255)), min_size=1, max_size=3),
    st.sampled_from(Version),
)
@settings(max_examples=80, deadline=None)
def test_damaged_answers_raise_nothing(damage: list[tuple[int, int]], version: Version) -> None:
    rig = Rig(version)
    rig.controller.open()
    rig.run(3)
    whole = encode_command(m.Command(m.Header(0, 2), q=READY, tau=(0.0,) * 7, wrench=(0.0,) * 6), version)
    raw = bytearray(whole)
    for place, value in damage:
        raw[place % len(raw)] = value
    rig.controller.receive(bytes(raw), rig.now)
    traffic = rig.controller.traffic
    assert traffic.taken + traffic.stale + traffic.refused >= 1
    if version is Version.V2_7 and bytes(raw) != whole:
        assert traffic.refused == 1, "a CRC sees every damage of a few bytes"
