"""Following poses: an arm follows a hand, a phone, a VR controller or a second arm that a person guides."""

from __future__ import annotations

from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np

from heptarm import laws
from heptarm.arm.verbs import ArmVerbs
from heptarm.devices.device import Roles
from heptarm.devices.pose_stream import PoseDevice, PoseInput
from heptarm.errors import CollisionForeseen, OutsideWorkspace, ShapeError
from heptarm.skills.gripper import Gripper
from heptarm.values.checks import Array, flag, instance, shown, within
from heptarm.values.frames import BASE, TOOL
from heptarm.values.mode.compliance import compliance
from heptarm.values.mode.impedance import JointImpedance
from heptarm.values.motion.motion import hold
from heptarm.values.pose import Pose, check_pose
from heptarm.values.sealed import Sealed

if TYPE_CHECKING:
    from heptarm.arm.fri.session import Fri
    from heptarm.arm.motion.handle import MotionHandle
    from heptarm.arm.motion.servo import PoseServo, ServoStats
    from heptarm.model.velocity import Elbow
    from heptarm.values.clearance import ClearanceModel

#: Defaults of rate [Hz] and of speed and acceleration, fractions of the joints' maxima.
RATE, SPEED, ACCELERATION = 100.0, 0.4, 0.4
#: A device that moves so far between two readings has lost its place: the arm stays [m, rad].
_JUMP, _TURN_JUMP = 0.1, 0.6
#: Forces and moments below these are not felt [N, Nm].
_DEAD_BAND, _MOMENT_DEAD_BAND = 2.0, 0.5


class LeaderArm(Sealed):
    """A second arm that a person guides by hand, as a device whose pose another arm follows; use it in a `with` block.

    The arm is compliant in all directions from the beginning of the block: somebody should hold it.

    Args:
        arm: the leader, in control.
        clutch: signal of its IO that is held while the follower is to follow, such as "UserButton"; "": always.
        gripper: signal whose press opens and closes the follower's gripper; "": none.
        reflect: fraction of the follower's force that the hand feels, over FRI, 0 to 1; see
            `heptarm.laws.reflected_force`. 0: none, and no FRI.

    Raises:
        CommandRejected: there is no such signal.
        LimitError: `reflect` is outside its range.
    """

    name = "leader"
    roles: Roles

    def __init__(self, arm: ArmVerbs, *, clutch: str = "", gripper: str = "", reflect: float = 0.0) -> None:
        self._arm = arm
        self._signals = [
            instance(name, str, key) for key, name in (("clutch", clutch), ("gripper", gripper)) if name
        ]
        for name in self._signals:
            _ = arm.io[name]
        self.roles = Roles(dead_man=clutch, gripper=gripper)
        self._reflect = within(reflect, "reflect", 0.0, 1.0)
        self._handle: MotionHandle | None = None
        self._fri: Fri | None = None

    def __enter__(self) -> LeaderArm:
        """Make the leader compliant.

        Raises:
            CommandRejected: refused, as while another motion runs.
            MotionAborted: the FRI session could not begin.
        """
        if self._reflect:
            law = laws.reflected_force()
            self._fri = self._arm.fri("torque", mode=JointImpedance(stiffness=0.0), law=law).__enter__()
        else:
            self._handle = self._arm.start(hold(), mode=compliance("xyzabc"), when="reject")
        return self

    def read(self) -> PoseInput:
        """Where the leader is, and which of its signals are on.

        Raises:
            MotionAborted: the leader was stopped.
        """
        if self._handle is not None and self._handle.done:
            self._handle.wait()
        if self._fri is not None and not self._fri.active:
            self._fri.close()
        on = frozenset(name for name in self._signals if self._arm.io[name])
        return PoseInput(self._arm.pose(), on)

    def feel(self, wrench: Array) -> None:
        """Let the hand feel a fraction of a wrench, in base axes at the flange, shape (6,) [N, Nm]."""
        if self._fri is not None:
            limit = laws.ready.WRENCH
            self._fri.params.wrench = np.clip(self._reflect * wrench, -limit, limit)

    def close(self) -> None:
        """Let the leader rest; calling it again has no effect."""
        handle, self._handle = self._handle, None
        if handle is not None:
            handle.cancel()
        session, self._fri = self._fri, None
        if session is not None:
            session.close()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Let the leader rest."""
        self.close()


class _Anchor:
    """Where device and arm were when the clutch was pressed; movements count from there."""

    def __init__(self, device: Pose, arm: Pose, *, axes: Pose, scale: float, turns: bool) -> None:
        self._device, self._arm, self._axes = device, arm, axes
        self._scale, self._turns = scale, turns

    def target(self, device: Pose) -> Pose:
        """The target for a pose of the device."""
        axes = Pose.of([0.0, 0.0, 0.0], self._axes.quat)
        moved = self._scale * (axes.rotation @ (device.xyz - self._device.xyz))
        if not self._turns:
            return Pose.of(self._arm.xyz + moved, self._arm.quat)
        turned = Pose.of([0.0, 0.0, 0.0], device.quat) @ Pose.of([0.0, 0.0, 0.0], self._device.quat).inverse()
        start = Pose.of([0.0, 0.0, 0.0], self._arm.quat)
        return Pose.of(self._arm.xyz + moved, (axes @ turned @ axes.inverse() @ start).quat)


def follow_poses(
    arm: ArmVerbs,
    device: PoseDevice,
    *,
    scale: float = 1.0,
    turns: bool = True,
    axes: Pose | None = None,
    clutch: str | None = None,
    gripper: Gripper | None = None,
    rate: float = RATE,
    speed: float = SPEED,
    acceleration: float = ACCELERATION,
    duration: float | None = None,
    while_true: Callable[[PoseInput], bool] | None = None,
    watchdog: float | None = None,
    keep_clear_of: ClearanceModel | None = None,
    elbow: Elbow | None = None,
) -> ServoStats:
    """Let an arm follow the movements of a device that knows its pose, while its clutch is held.

    Movements count from where device and arm were when the clutch was pressed, so nothing jumps, and letting go and
    reaching back moves the arm beyond the reach of the hand. `arm.workspace` and `keep_clear_of` hold. A device that
    jumps, as one that loses its tracking does, moves nothing; the movement goes on from there. The force on the
    follower is felt at a `LeaderArm` that reflects it.

    Args:
        arm: in control; the follower.
        device: `heptarm.devices.pose_stream()`, a `LeaderArm`, or your own.
        scale: movement of the arm per movement of the device, up to 10.
        turns: whether the arm turns with the device; False: it keeps its orientation.
        axes: orientation of the device's axes in the base of the arm; None: the same.
        clutch: button that is held while the arm follows; None: that of the device; "": none, it always follows.
        gripper: that the device's gripper button opens and closes; None: there is none.
        rate: targets per second [Hz].
        speed: ceiling of the joints' speeds, a fraction of their maxima.
        acceleration: likewise.
        duration: end after this time [s]; None: never.
        while_true: called with each reading; it ends when this returns something false. None: it goes on.
        watchdog: silence of this program after which the cabinet stops the arm [s]; None: that of `Arm.servo`.
        keep_clear_of: model of bodies to keep clear of; see `Arm.servo`.
        elbow: what the redundant joint does, "keep" or "center"; see `Arm.servo`. None: "keep".

    Returns:
        Statistics of the stream of poses.

    Raises:
        ShapeError: no device.
        LimitError: a value outside its range.
        NotReady: the device is gone; the arm was brought to rest.
        MotionAborted: the motion ended early, as by a stop.
    """
    if not callable(getattr(device, "read", None)):
        raise ShapeError(
            f"device must be a device that knows its pose, got {shown(device)}",
            parameter="device",
            value=device,
            hint="for example heptarm.devices.pose_stream()",
        )
    factor = within(scale, "scale", 0.0, 10.0, above=True)
    limit = None if duration is None else within(duration, "duration", 0.0, 1e6, above=True, unit="s")
    turned = Pose.at() if axes is None else axes
    check_pose(turned, "axes")
    button = device.roles.dead_man if clutch is None else instance(clutch, str, "clutch")
    with arm.servo(
        "pose",
        rate=rate,
        speed=speed,
        acceleration=acceleration,
        watchdog=watchdog,
        keep_clear_of=keep_clear_of,
        elbow=elbow,
    ) as sv:
        follower = _Follower(arm, sv, device, factor, flag(turns, "turns"), turned, button, gripper)
        while sv.tick() is not None and (limit is None or sv.t < limit):
            seen = device.read()
            if device.roles.quit in seen.buttons or (while_true is not None and not while_true(seen)):
                break
            follower.step(seen)
    return sv.stats


class _Follower:
    """What `follow_poses` keeps from reading to reading."""

    def __init__(
        self,
        arm: ArmVerbs,
        servo: PoseServo,
        device: PoseDevice,
        scale: float,
        turns: bool,
        axes: Pose,
        button: str,
        gripper: Gripper | None,
    ) -> None:
        self._arm, self._servo, self._device = arm, servo, device
        self._scale, self._turns, self._axes = scale, turns, axes
        self._button, self._gripper = button, gripper
        self._released, self._pressed = not button, False
        self._anchor: _Anchor | None = None
        self._last: Pose | None = None
        self._target = arm.pose(state=servo.start)  # the last one that was not refused
        self._rest_wrench = np.zeros(6)

    def step(self, seen: PoseInput) -> None:
        """Send the target of a reading."""
        self._released = self._released or self._button not in seen.buttons
        follows = (
            seen.pose is not None and self._released and (not self._button or self._button in seen.buttons)
        )
        target = self._target
        if seen.pose is None or not follows:
            self._anchor = None
        elif self._anchor is None or self._jumped(seen.pose):
            self._anchor = _Anchor(
                seen.pose, self._target, axes=self._axes, scale=self._scale, turns=self._turns
            )
            self._rest_wrench = self._wrench()
        else:
            target = self._anchor.target(seen.pose)
        self._last = seen.pose
        try:
            self._target = self._servo.set(target)
        except (OutsideWorkspace, CollisionForeseen):
            pass  # it rests before the wall, where the next press of the clutch begins; the hand has to come back
        feel = getattr(self._device, "feel", None)
        if feel is not None:
            feel(self._felt() if follows else np.zeros(6))
        self._grip(seen)

    def _jumped(self, pose: Pose) -> bool:
        if self._last is None:
            return True
        left = self._last.displacement(pose)
        return bool(np.linalg.norm(left[:3]) > _JUMP or np.linalg.norm(left[3:]) > _TURN_JUMP)

    def _wrench(self) -> Array:
        """Wrench on the tool in base axes, shape (6,) [N, Nm]."""
        if "wrench" not in self._arm.groups:
            return np.zeros(6)
        wrench = self._arm.wrench(TOOL, axes=BASE)
        return np.concatenate([wrench.force, wrench.torque])

    def _felt(self) -> Array:
        """The wrench that has come since the clutch was pressed, without its noise, in the axes of the device."""
        wrench = self._wrench() - self._rest_wrench
        for part, band in ((slice(0, 3), _DEAD_BAND), (slice(3, 6), _MOMENT_DEAD_BAND)):
            size = float(np.linalg.norm(wrench[part]))
            wrench[part] *= max(0.0, 1.0 - band / size) if size > 0.0 else 0.0
        turn = self._axes.rotation.T
        return np.concatenate([turn @ wrench[:3], turn @ wrench[3:]])

    def _grip(self, seen: PoseInput) -> None:
        """Open or close the gripper once per press; the arm rests meanwhile."""
        role = self._device.roles.gripper
        grips = bool(role) and role in seen.buttons
        if self._gripper is not None and grips and not self._pressed:
            self._servo.hold()
            if self._gripper.is_open:
                self._gripper.close()
            else:
                self._gripper.open()
            self._anchor = None
        self._pressed = grips
