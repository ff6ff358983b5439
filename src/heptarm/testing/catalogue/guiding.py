"""Scenarios: hand guiding, taps and teaching; intended contacts and collisions."""

from __future__ import annotations

from threading import Event, Thread

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.errors import CollisionDetected, NoContact
from heptarm.testing.catalogue.modes import let_go
from heptarm.testing.measure import Unfit, above, below, fresh, holds, near, note
from heptarm.testing.scenario import Risk, scenario
from heptarm.testing.stage import DEEPEST, HOME
from heptarm.values.checks import Array
from heptarm.values.mode.compliance import compliance
from heptarm.values.motion.hand_guiding import hand_guide
from heptarm.values.motion.line import lin_rel
from heptarm.values.motion.motion import hold
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import deg

_LONG = 120.0
#: Time between a cabinet and its client about a motion, of a simulator that runs several times faster than time [s].
_HANDSHAKE = 0.3


def _guide(arm: Arm, push: tuple[float, float, float], offset: float, *, at_most: float = _LONG) -> None:
    """Push until a joint has turned by this angle [rad], and for at most so many seconds of the robot."""
    before = arm.state.q
    arm.operator.start_push(push, duration=at_most)
    arm.wait_until(lambda s: np.abs(s.q - before).max() > offset, timeout=60.0)
    arm.operator.start_push((0.0, 0.0, 0.0), duration=0.0)
    arm.wait_until(lambda s: np.abs(s.wrench.force).max() < 5.0, timeout=20.0)


@scenario(line=8, rows="H9", risk=Risk.CONTACT, operator=True, space=0.6, needs=("hand_guide",))
def by_hand(arm: Arm) -> None:
    """KUKA's hand guiding: the arm follows the hand while the switch is held, and stops when it is released."""
    handle = arm.start(hand_guide(cartesian_velocity=0.3))
    handle.wait_started(20.0)
    arm.operator.guide()
    arm.wait_until(lambda s: s.safety.hand_guiding_switch, timeout=20.0)
    _guide(arm, (0.0, 15.0, 15.0), 0.2)
    holds(not handle.done, "it continues while the switch is held")
    arm.operator.let_go()
    holds(handle.wait(timeout=30.0).arrived, "it ends when the switch is let go")
    rests = arm.wait_for_rest()
    above(float(np.abs(rests.q - HOME).max()), 0.05, "a joint was guided by", unit="rad")
    near(fresh(arm, after=0.2).q, rests.q, 1e-3, "and it stays there", unit="rad")


@scenario(line=8, rows="H10", risk=Risk.CONTACT, operator=True, space=0.3, needs=("cartesian_impedance",))
def precise(arm: Arm) -> None:
    """Hand guiding along one axis without a hand guiding device; all other directions are held."""
    start = arm.wait_for_rest().pose
    handle = arm.start(hold(_LONG), mode=compliance("y", frame="base"))
    handle.wait_started(20.0)
    # the speed along the axis is bounded, so a hand may push on until this program sees it
    _guide(arm, (10.0, 10.0, 10.0), 0.05, at_most=1.0)
    let_go(arm, handle)
    end = arm.wait_for_rest().pose
    above(float(end.xyz[1] - start.xyz[1]), 0.01, "guided by", unit="m")
    below(float(np.abs((end.xyz - start.xyz)[[0, 2]]).max()), 5e-3, "across by", unit="m")
    below(end.angle_to(start), 0.02, "turned by", unit="rad")


@scenario(line=8, rows="H3 H4 H14", risk=Risk.CONTACT, space=0.3, needs=("conditions", "lin_rel"))
def touched(arm: Arm) -> None:
    """Touch and retreat; a second, slow touch measures the height of the table within a millimetre."""
    offset = DEEPEST - 0.05
    try:
        rough = arm.touch("-z", frame="base", distance=offset, force=10.0, speed_mps=0.08, retreat=0.02)
    except NoContact as error:
        raise Unfit(f"there is no table within {offset:g} m below the flange") from error
    above(float(rough.force[2]), 8.0, "force at the contact", unit="N")
    near(arm.wait_for_rest().pose.xyz[2] - rough.pose.xyz[2], 0.02, 2e-3, "retreated by", unit="m")
    fine = arm.touch_twice("-z", frame="base", distance=0.05, force=8.0, retreat=0.02)
    below(fine.spread, 0.01, "its two contacts are apart by", unit="m")
    again = arm.touch_twice("-z", frame="base", distance=0.05, force=8.0, retreat=0.05)
    near(again.pose.xyz[2], fine.pose.xyz[2], 1e-3, "found once more at", unit="m")


@scenario(line=8, rows="H12 H13", risk=Risk.CONTACT, operator=True, space=0.1, needs=("ptp",))
def taps(arm: Arm) -> None:
    """A tap interrupts a motion, two more resume it."""
    from heptarm.values.condition.force import force

    target = ptp(HOME + deg(0, 0, 0, 0, 0, 0, 60), speed=0.2)
    handle = arm.start(target, until=force > 15)
    arm.wait_until(lambda s: s.q[6] > 0.1 or handle.done, timeout=20.0)
    arm.operator.start_push((0.0, 0.0, 30.0), duration=0.15)
    holds(handle.wait().stopped_by == (force > 15), "the first tap ends the motion")
    arm.wait_until(lambda s: np.abs(s.wrench.force).max() < 5.0, timeout=20.0)
    done = Event()

    def tap() -> None:
        while not done.wait(0.4 / max(arm.real_time_factor, 1.0)):
            arm.operator.start_push((0.0, 0.0, 30.0), duration=0.1)

    hand = Thread(target=tap)
    hand.start()
    try:
        arm.wait_for_taps(2, force=8.0, gap=10.0, timeout=60.0)
    finally:
        done.set()
        hand.join()
    note("two taps were detected")
    arm.operator.start_push((0.0, 0.0, 0.0), duration=0.0)
    arm.wait_until(lambda s: np.abs(s.wrench.force).max() < 5.0, timeout=20.0)
    holds(arm.move(target).arrived, "then it continues to its end")


@scenario(line=8, rows="H6 G18", risk=Risk.CONTACT, space=0.3, virtual=True, needs=("conditions",))
def guard(arm: Arm) -> None:
    """A collision guard passes free motions and ends one that hits the table; it names the joint."""
    with arm.guarded(arm.collision_guard(12.0)):
        holds(arm.move(lin_rel(z=0.03, frame="base", speed_mps=0.15)).arrived, "a free motion arrives")
        try:
            arm.move(lin_rel(z=-DEEPEST, frame="base", speed_mps=0.08))
            raise Unfit("there is no table below the flange")
        except CollisionDetected as error:
            found = error.collision
    holds(found is not None, f"{found}")
    above(abs(found.torque), 12.0, "external torque then", unit="Nm")
    holds(arm.move(lin_rel(z=0.08, frame="base", speed_mps=0.2)).arrived, "up it goes")


@scenario(
    line=8,
    rows="H16 H17",
    risk=Risk.CONTACT,
    operator=True,
    space=0.4,
    needs=("cartesian_impedance", "servo"),
)
def taught(arm: Arm) -> None:
    """Guided by hand, recorded with its times, and replayed on the same path."""

    def person() -> None:
        arm.operator.guide()
        arm.wait_until(lambda s: s.motion is not None and s.motion.active, timeout=30.0)
        _guide(arm, (0.0, 8.0, 8.0), 0.1)
        arm.operator.let_go()

    hand = Thread(target=person)
    hand.start()
    whole = arm.teach(hand_guide(joint_velocity=0.5), timeout=60.0)
    hand.join()
    offset: Array = np.ptp(whole.q, axis=0)
    above(float(offset.max()), 0.05, "taught: a joint was guided by", unit="rad")
    trajectory = whole.trimmed().thinned()
    above(float(len(trajectory)), 1.5, "positions kept, each with its time")
    replay = arm.replay(trajectory, by="spline", speed_scaling=0.25)
    holds(replay.result.arrived, "it was done again")
    longer = 4.0 * trajectory.duration
    near(
        replay.result.duration,
        longer,
        0.05 * longer + _HANDSHAKE,
        "a quarter of the taught speed takes four times as long",
        unit="s",
    )
    below(replay.deviation, 0.05, "farthest from what was taught", unit="rad")
    near(arm.wait_for_rest().q, trajectory.q[-1], 2e-3, "its end", unit="rad")
