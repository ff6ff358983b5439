"""Motions of the arm against a scripted cabinet in memory: their ends, refusals and handles."""

from __future__ import annotations

import asyncio
import re
import signal
import threading
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import heptarm as ha
from heptarm.model import forward
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.arm.peer import Peer, Served
from tests.interrupts import ctrl_c_interrupts

HOME = ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0))


def later(seconds: float, *messages: wire.Message) -> Callable[[Served, int], None]:
    """Replies that arrive later."""

    def reply(client: Served, _: int) -> None:
        def speak() -> None:
            for message in messages:
                client.say(message)

        timer = threading.Timer(seconds, speak)
        client.peer.threads.append(timer)
        timer.start()

    return reply


def test_a_move_returns_its_result(peer: Peer) -> None:
    peer.runs(5, wire.MotionStarted(id=5, item=0), peer.finished(5))
    with peer.arm() as arm:
        result = arm.move(HOME)
    assert result.arrived and result.residual == 1e-5 and result.duration == 1.5
    assert result.state is not None and result.state.q == pytest.approx(peer.q)


def test_events_may_come_before_the_answer(peer: Peer) -> None:
    peer.expect(wire.Run, wire.MotionStarted(id=9, item=0), peer.finished(9), wire.Accepted(id=9))
    with peer.arm() as arm:
        assert arm.move(HOME, timeout=20.0).arrived


def test_events_of_other_clients_motions_change_nothing(peer: Peer) -> None:
    peer.runs(6, later(0.05, peer.finished(6)))
    with peer.arm() as arm:
        handle = arm.start(HOME)
        peer.tell(peer.finished(5, wire.Cause.STOPPED))
        assert handle.wait(timeout=20.0).arrived


def test_nan_keeps_the_set_point_of_a_joint(peer: Peer) -> None:
    sent: list[wire.Run] = []
    peer.runs(1, wire.ItemReached(id=1, item=0), peer.finished(1, item=2), check=sent.append)
    nan = np.nan
    only_a7 = ha.ptp([nan] * 6 + [0.3])
    with peer.arm() as arm:
        arm.move([only_a7, ha.hold(0.1), ha.ptp([0.1] + [nan] * 6)])
        first, _, third = (item.motion for item in sent[0].items)
        assert isinstance(first, wire.Ptp) and isinstance(third, wire.Ptp)
        assert first.q == pytest.approx([*peer.q[:6], 0.3]) and third.q == pytest.approx(
            [0.1, *peer.q[1:6], 0.3]
        )
        with pytest.raises(ha.CommandRejected, match=r"motions\[1\] keeps joints .* not known yet"):
            arm.move([ha.lin_rel(z=0.01), only_a7])


def test_a_partial_pose_keeps_the_coordinates_where_its_motion_begins(peer: Peer) -> None:
    sent: list[wire.Run] = []
    peer.runs(
        1, *(wire.ItemReached(id=1, item=n) for n in range(4)), peer.finished(1, item=4), check=sent.append
    )
    turned = ha.Pose.xyz_abc(0.2, 0.1, 0.0, *ha.deg(90, 0, 0))
    with peer.arm() as arm:
        here = arm.pose("flange")
        a, b, c = here.abc.tolist()
        up = ha.lin(ha.PartialPose(z=0.4), moving="flange")
        beside = ha.lin(ha.PartialPose(x=0.1), moving="flange", frame=turned)
        other = ha.ptp(ha.PartialPose(y=0.05, b=b + 0.1), moving="flange")
        arm.move([up, ha.hold(0.1), beside, other, HOME, up])
        first, _, second, third, _, last = (item.motion for item in sent[0].items)
        wanted = ha.Pose.of([here.x, here.y, 0.4], here.quat)
        assert reached(first, wanted)
        wanted = ha.Pose.of(
            turned.rotation @ [0.1, *(turned.inverse() @ wanted).xyz[1:]] + turned.xyz, here.quat
        )
        assert reached(second, wanted)  # x of the frame, which is y of the base, is 0.1 m from its origin
        assert wanted.y == pytest.approx(0.2) and wanted.x == pytest.approx(here.x)
        assert reached(third, ha.Pose.xyz_abc(wanted.x, 0.05, 0.4, a, b + 0.1, c))
        home = ha.Pose.from_matrix(forward(arm.robot, ha.deg(0, 30, 0, -90, 0, 60, 0)))
        assert reached(last, ha.Pose.of([home.x, home.y, 0.4], home.quat))
        with pytest.raises(ha.CommandRejected, match=r"motions\[1\] keeps coordinates .* not known yet"):
            arm.move([ha.lin_rel(z=0.01, moving="flange"), up])
        with pytest.raises(ha.CommandRejected, match=r"motions\[1\] keeps coordinates .* not known yet"):
            arm.move([up, ha.lin(ha.PartialPose(z=0.4))])  # of another motion frame
    assert len(sent) == 1


def reached(motion: object, wanted: ha.Pose) -> bool:
    assert isinstance(motion, wire.Lin | wire.PtpPose)
    target = ha.Pose.of(motion.target.xyz, motion.target.quat)
    return target.distance_to(wanted) < 1e-9 and target.angle_to(wanted) < 1e-7


def test_arcs_whose_start_is_known_are_checked_before_they_are_sent(peer: Peer) -> None:
    sent: list[wire.Run] = []
    for number in range(1, 3):
        peer.runs(
            number, wire.ItemReached(id=number, item=0), peer.finished(number, item=1), check=sent.append
        )
    with peer.arm() as arm:
        here = arm.pose("flange")
        end, behind = here.shifted(0.2), ha.ptp(arm.state.q)
        beside, line = ha.circ(here.shifted(0.1, 0.01), end), ha.circ(here.shifted(0.1), end)
        wave = ha.spline([here, line], moving="flange")
        for motions, parameter in (
            ([replace(line, moving="flange")], "via"),
            ([ha.lin(here), line], r"motions\[1\].via"),
            ([behind, ha.hold(0.1), wave], r"motions\[2\].segments\[1\].via"),
        ):
            with pytest.raises(ha.CommandRejected, match="start, via and end lie on a line") as refused:
                arm.move(motions)
            assert re.fullmatch(parameter, str(refused.value.parameter))
        arm.move([ha.lin(here), beside])
        arm.move([ha.lin_rel(z=0.1), line])  # nobody knows where it starts: the cabinet decides
    assert len(sent) == 2


def test_a_batch_is_one_program(peer: Peer) -> None:
    sent: list[wire.Run] = []
    peer.runs(1, wire.ItemReached(id=1, item=0), peer.finished(1, item=1), check=sent.append)
    with peer.arm() as arm:
        assert arm.move([HOME, ha.lin_rel(z=0.1)]).item == 1
    (run,) = sent
    assert [type(item.motion).__name__ for item in run.items] == ["Ptp", "LinRel"]


def test_the_ceiling_only_slows_down(peer: Peer) -> None:
    sent: list[wire.Run] = []
    for number in range(1, 4):
        peer.runs(number, peer.finished(number), check=sent.append)
    with peer.arm() as arm:
        arm.speed = 0.5
        arm.move(HOME)
        arm.move(HOME, speed=0.9)
        arm.move(ha.ptp(np.zeros(7), speed=0.1), speed=0.3)
        for wrong in (0.0, 1.5, float("nan")):
            with pytest.raises(ha.LimitError):
                arm.speed = wrong
    assert [run.items[0].motion.dynamics.velocity[0] for run in sent] == [0.5, 0.5, 0.1]  # type: ignore[index]


def test_a_target_outside_the_robot_is_refused_before_it_is_sent(peer: Peer) -> None:
    with peer.arm() as arm:
        with pytest.raises(ha.LimitError, match="A2") as error:
            arm.move(ha.ptp([0, 2.05, 0, 0, 0, 0, 0]))
        assert error.value.parameter == "q[1]" and error.value.value == 2.05 and error.value.hint
        with pytest.raises(ha.LimitError, match=r"motions\[1\]"):
            arm.start([HOME, ha.ptp([0, 2.05, 0, 0, 0, 0, 0])])
        for wrong in ("up", [], [1.0] * 7, None):
            with pytest.raises(ha.ShapeError):
                arm.move(wrong)  # type: ignore[arg-type]
        with pytest.raises(ha.ShapeError, match="when"):
            arm.start(HOME, when="later")  # type: ignore[arg-type]
        with pytest.raises(ha.ShapeError, match="cancelled"):
            arm.move(ha.hold())


@pytest.mark.parametrize(
    ("code", "kind"),
    [
        (Code.UNREACHABLE, ha.LimitError),
        (Code.BUSY, ha.ModeConflict),
        (Code.NOT_IN_CONTROL, ha.NotInControl),
        (Code.NOT_READY, ha.NotReady),
        (Code.NEEDS_OPERATOR, ha.NeedsOperator),
        (999, ha.CommandRejected),
    ],
)
def test_a_rejection_becomes_the_error_of_its_code(
    peer: Peer, code: int, kind: type[ha.HeptarmError]
) -> None:
    peer.expect(
        wire.Run, wire.Rejected(code=code, parameter="items[0]", value="7", allowed="[0, 1]", text="no")
    )
    with peer.arm() as arm, pytest.raises(kind) as error:
        arm.move(HOME)
    assert type(error.value) is kind
    assert (error.value.code, error.value.parameter, error.value.allowed) == (code, "items[0]", "[0, 1]")
    assert "[0, 1]" in str(error.value)


def test_a_stopped_move_carries_its_evidence(peer: Peer) -> None:
    def stop() -> None:
        before = arm.state.stamp
        arm.wait_until(lambda state: state.stamp > before + 300_000_000)  # some states for the history
        peer.tell(peer.finished(1, wire.Cause.STOPPED, text="red button"))

    button = threading.Thread(target=stop)
    peer.runs(1, wire.MotionStarted(id=1, item=0), lambda *_: button.start())
    with peer.arm() as arm, pytest.raises(ha.MotionAborted, match="red button") as error:
        arm.move(HOME)
        button.join()
    assert error.value.cause is ha.Cause.STOPPED
    assert error.value.state is not None and 10 <= len(error.value.history) <= 50
    assert error.value.history[-1].stamp > error.value.history[0].stamp


def test_a_motion_that_cannot_be_planned_is_a_rejection(peer: Peer) -> None:
    failed = peer.finished(1, wire.Cause.FAILED, code=Code.UNREACHABLE, residual=float("nan"), text="too far")
    peer.runs(1, failed)
    with peer.arm() as arm, pytest.raises(ha.LimitError, match="too far"):
        arm.move(HOME)


@pytest.mark.parametrize(
    ("cause", "kind"),
    [
        (wire.Cause.LOST, ha.ConnectionLost),
        (wire.Cause.STARVED, ha.Starved),
        (wire.Cause.SAFETY, ha.MotionAborted),
        (wire.Cause.DROPPED, ha.MotionAborted),
    ],
)
def test_bad_ends_are_errors(peer: Peer, cause: wire.Cause, kind: type[Exception]) -> None:
    peer.runs(1, peer.finished(1, cause))
    with peer.arm() as arm:
        handle = arm.start(HOME)
        with pytest.raises(kind):
            handle.wait(timeout=20.0)
        assert handle.done and handle.result is None


def test_cancelling_is_a_result(peer: Peer) -> None:
    peer.runs(3, wire.MotionStarted(id=3, item=0))
    peer.expect(
        wire.Cancel, wire.Accepted(id=0), peer.finished(3, wire.Cause.CANCELLED), check=lambda m: m.id == 3
    )
    peer.motion = 3
    with peer.arm() as arm:
        handle = arm.start(HOME)
        arm.wait_until(lambda s: handle.started)
        assert not handle.done and handle.progress == 0.5 and handle.id == 3
        handle.cancel()
        assert handle.wait(timeout=20.0).cause is ha.Cause.CANCELLED
        handle.cancel()
        peer.motion = 0


def test_cancelling_what_has_just_ended_is_no_error(peer: Peer) -> None:
    ended = wire.Rejected(
        code=int(Code.UNKNOWN_MOTION), parameter="id", value="3", allowed="", text="it has ended"
    )
    peer.runs(3, wire.MotionStarted(id=3, item=0))
    peer.expect(wire.Cancel, ended, later(0.05, peer.finished(3)))  # its end is still under way
    with peer.arm() as arm:
        handle = arm.start(HOME)
        handle.cancel()
        assert handle.wait(timeout=20.0).arrived


def test_a_move_that_takes_too_long_is_cancelled(peer: Peer) -> None:
    peer.runs(3)
    peer.expect(wire.Cancel, wire.Accepted(id=0), peer.finished(3, wire.Cause.CANCELLED))
    with peer.arm() as arm, pytest.raises(ha.Timeout, match="motion 3"):
        arm.move(HOME, timeout=0.05)


def test_stop_from_another_thread_ends_a_blocking_move(peer: Peer) -> None:
    arms: list[ha.Arm] = []

    def stop() -> None:
        arms[0].stop()

    timer = threading.Timer(0.05, stop)
    peer.runs(1, wire.MotionStarted(id=1, item=0), lambda *_: timer.start())
    peer.expect(wire.Stop, wire.Accepted(id=0), peer.finished(1, wire.Cause.STOPPED))
    with peer.arm() as arm:
        arms.append(arm)
        with pytest.raises(ha.MotionAborted):
            arm.move(HOME, timeout=20.0)
        timer.join()
        arm.stop()
        arm.stop(kind="fast")
        with pytest.raises(ha.ShapeError):
            arm.stop(kind="now")  # type: ignore[arg-type]


def test_handles_can_be_awaited(peer: Peer) -> None:
    peer.runs(1, later(0.05, peer.finished(1)))

    async def program(arm: ha.Arm) -> ha.Result:
        return await arm.start(HOME)

    with peer.arm() as arm:
        assert asyncio.run(program(arm)).arrived


def test_a_callback_receives_the_end(peer: Peer) -> None:
    heard = threading.Event()
    peer.runs(1, peer.finished(1))
    with peer.arm() as arm:
        arm.start(HOME).add_done_callback(lambda handle: heard.set() if handle.done else None)
        assert heard.wait(20.0)


def test_a_callback_may_talk_to_the_cabinet(peer: Peer) -> None:
    done = threading.Event()
    peer.runs(1, later(0.05, peer.finished(1)))
    with peer.arm() as arm:

        def stop(_: ha.MotionHandle) -> None:
            arm.stop()
            done.set()

        arm.start(HOME).add_done_callback(stop)
        assert done.wait(20.0)
        assert arm.connected


def test_ctrl_c_stops_the_arm_and_goes_on(peer: Peer) -> None:
    timer = threading.Timer(
        0.05, lambda: signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    )
    peer.runs(1, wire.MotionStarted(id=1, item=0), lambda *_: timer.start())
    peer.expect(wire.Stop, wire.Accepted(id=0), peer.finished(1, wire.Cause.STOPPED))
    with peer.arm() as arm:
        with ctrl_c_interrupts(), pytest.raises(KeyboardInterrupt):
            arm.move(HOME, timeout=20.0)
        timer.join()


# ----------------------------------------------------------------------- what a program receives


def test_a_handle_that_failed_reports_why_and_its_callback_receives_it(peer: Peer) -> None:
    peer.runs(1, later(0.05, peer.finished(1, wire.Cause.SAFETY, code=int(Code.SAFETY_STOP))))
    peer.runs(2, peer.finished(2))
    seen: list[ha.HeptarmError | None] = []
    done = threading.Event()
    with peer.arm() as arm:
        handle = arm.start(HOME)
        handle.add_done_callback(lambda one: seen.append(one.error))
        handle.add_done_callback(lambda _: done.set())
        with pytest.raises(ha.MotionAborted) as raised:
            handle.wait(timeout=20.0)
        assert done.wait(20.0)
        assert seen == [raised.value] == [handle.error]
        assert handle.result is None and "failed" in repr(handle)
        good = arm.start(HOME)
        good.wait(timeout=20.0)
        assert good.error is None and good.result is not None


@pytest.mark.parametrize("wrong", [float("nan"), -1.0, "5", True, float("inf")])
def test_a_wrong_timeout_is_refused_before_anything_is_sent(peer: Peer, wrong: object) -> None:
    with peer.arm() as arm:
        before = len(peer.seen)
        calls = (
            lambda: arm.move(HOME, timeout=wrong),  # type: ignore[arg-type]
            lambda: arm.wait_until(lambda _: True, timeout=wrong),  # type: ignore[arg-type]
            lambda: arm.wait_for_rest(timeout=wrong),  # type: ignore[arg-type]
            lambda: arm.servo(goal_timeout=wrong),  # type: ignore[call-overload]
            lambda: arm.servo(speed_timeout=wrong),  # type: ignore[call-overload]
        )
        for call in calls:
            with pytest.raises(ha.CommandRejected, match="timeout must be"):
                call()
        assert not [one for one in peer.seen[before:] if not isinstance(one, wire.Pong)]


@pytest.mark.parametrize("wrong", [float("nan"), -1.0, "5", True, float("inf")])
def test_a_handle_refuses_a_wrong_timeout(peer: Peer, wrong: object) -> None:
    peer.runs(1, later(0.1, peer.finished(1)))
    with peer.arm() as arm:
        handle = arm.start(HOME)
        for call in (handle.wait, lambda timeout: list(handle.events(timeout=timeout))):
            with pytest.raises(ha.CommandRejected, match="timeout must be"):
                call(timeout=wrong)  # type: ignore[arg-type]
        handle.wait(timeout=20.0)


def test_after_a_move_the_states_show_rest(peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("heptarm.arm.motion.rest._SETTLING", 20.0)
    peer.dq, peer.motion = (0.5,) * 7, 1

    def rest() -> None:
        peer.dq, peer.motion = (0.0,) * 7, 0

    timer = threading.Timer(0.15, rest)
    peer.runs(1, peer.finished(1), check=lambda _: timer.start())
    with peer.arm() as arm:
        result = arm.move(HOME)
        timer.join()
        assert not arm.state.motion.active and not arm.state.dq.any()
        assert result.state is not None and not result.state.dq.any()


def test_a_move_does_not_wait_for_an_arm_that_never_rests(peer: Peer) -> None:
    peer.runs(1, peer.finished(1))
    with peer.arm() as arm:
        peer.dq = (0.5,) * 7
        result = arm.move(HOME)
        assert result.arrived and result.state is not None and result.state.dq.any()
        peer.dq = (0.0,) * 7


def test_the_first_state_has_velocities(peer: Peer) -> None:
    count = 0
    whole = peer.state

    def states() -> wire.State:
        nonlocal count
        count += 1
        peer.dq = (np.nan if count == 1 else 0.0,) * 7
        return whole()

    peer.state = states  # type: ignore[method-assign]
    with peer.arm(rate=20.0) as arm:
        assert np.isfinite(arm.state.dq).all()
