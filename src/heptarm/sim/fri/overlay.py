"""Overlays: what an FRI client lays on a motion, as values, and what carries them out.

Position and pose overlays move the set-point of whatever control mode is in force; torque and wrench overlays do that
too, and add a load on top of what the control mode gives.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from heptarm.errors import CommandRejected, ModeConflict
from heptarm.fri import messages as m
from heptarm.fri.version import Version
from heptarm.values.arrays import Array
from heptarm.values.mode import Mode
from heptarm.values.robot import RobotModel
from heptarm.virtual.fri.configuration import Configuration

Seven = tuple[float, ...]
_ZEROS: Seven = (0.0,) * 7

#: A torque overlay wants a command at least this often [ms].
TORQUE_MS = 5

_ANY = (m.ControlMode.POSITION, m.ControlMode.JOINT_IMPEDANCE, m.ControlMode.CARTESIAN_IMPEDANCE)
#: Under which control modes each client command mode is legal.
CONTROLS: dict[m.CommandMode, tuple[m.ControlMode, ...]] = {
    m.CommandMode.POSITION: _ANY,
    m.CommandMode.WRENCH: (m.ControlMode.CARTESIAN_IMPEDANCE,),
    m.CommandMode.TORQUE: (m.ControlMode.JOINT_IMPEDANCE,),
    m.CommandMode.CARTESIAN_POSE: _ANY,
}


@dataclass(frozen=True, slots=True)
class MotionOverlay:
    """What the application adds to a motion so that the client may command.

    Attributes:
        mode: what the client commands.
        control: control mode of the motion underneath.
    """

    mode: m.CommandMode = m.CommandMode.POSITION
    control: m.ControlMode = m.ControlMode.POSITION

    @property
    def kind(self) -> m.Overlay:
        """Whether joints or a pose are superposed."""
        return m.Overlay.CARTESIAN if self.mode is m.CommandMode.CARTESIAN_POSE else m.Overlay.JOINT

    def check(self, configuration: Configuration) -> None:
        """Check that the overlay is legal in a session.

        Raises:
            CommandRejected: this version has no such command mode, or the session is too slow for it.
            ModeConflict: the command mode does not go with the control mode.
        """
        name = self.mode.name
        legal = CONTROLS.get(self.mode)
        if legal is None:
            raise CommandRejected(
                f"client command mode {name}: with it the client commands nothing",
                parameter="mode",
                hint="choose " + ", ".join(mode.name for mode in CONTROLS),
            )
        if self.mode is m.CommandMode.CARTESIAN_POSE and not configuration.version.traits.quaternions:
            raise CommandRejected(
                f"FRI {configuration.version.value} has no command mode {name}",
                parameter="mode",
                hint=f"it came with FRI {Version.V2_5.value}",
            )
        if self.control not in legal:
            raise ModeConflict(
                f"client command mode {name} under control mode {self.control.name}",
                parameter="mode",
                allowed=" or ".join(control.name for control in legal),
                hint=f"hold the position in control mode {' or '.join(c.name for c in legal)}",
            )
        if self.mode is m.CommandMode.TORQUE and configuration.receive_ms > TORQUE_MS:
            raise CommandRejected(
                f"client command mode TORQUE with an answer every {configuration.receive_ms} ms",
                parameter="period_ms",
                value=configuration.receive_ms,
                allowed=f"[1, {TORQUE_MS}] ms",
            )


def missing(mode: m.CommandMode, command: m.Command) -> str:
    """The field that a command of this mode lacks, in words; empty if it has all."""
    if mode is m.CommandMode.CARTESIAN_POSE:
        return "" if command.pose is not None else "Cartesian pose"
    if command.q is None:
        return "joint position"
    if mode is m.CommandMode.TORQUE and command.tau is None:
        return "joint torque"
    if mode is m.CommandMode.WRENCH and command.wrench is None:
        return "wrench"
    return ""


@dataclass(frozen=True, slots=True)
class Reading:
    """State of the arm in one tick, in SI; tuples have 7 entries unless said otherwise.

    Attributes:
        q: measured positions [rad].
        q_cmd: commanded positions, overlay included [rad].
        q_ipo: interpolator's positions, without the overlay [rad].
        tau: torques at the sensors [Nm].
        tau_cmd: commanded torques [Nm].
        tau_ext: external torques [Nm], measured less model.
        wrench: external force and torque at the flange, base axes, 6 entries [N, Nm].
        safety: state of the safety controller.
        drives: state of all drives.
        operation_mode: as chosen at the smartPAD.
        control_mode: in force.
    """

    q: Seven
    q_cmd: Seven
    q_ipo: Seven
    tau: Seven = _ZEROS
    tau_cmd: Seven = _ZEROS
    tau_ext: Seven = _ZEROS
    wrench: Seven = (0.0,) * 6
    safety: m.Safety = m.Safety.NORMAL_OPERATION
    drives: m.DriveState = m.DriveState.ACTIVE
    operation_mode: m.OperationMode = m.OperationMode.AUT
    control_mode: m.ControlMode = m.ControlMode.POSITION


@dataclass(frozen=True, slots=True, eq=False)
class Superposition:
    """What the arm does in the next tick instead of following its interpolator.

    Attributes:
        q: set-point of the next tick, shape (7,) [rad].
        tau: torques on top, shape (7,) [Nm]; None: none.
        wrench: force and torque on top, acting by the arm at the flange, base axes, shape (6,) [N, Nm]; None: none.
    """

    q: Array
    tau: Array | None = None
    wrench: Array | None = None


class OverlayTarget(Protocol):
    """An arm that overlays act on; all calls come from the thread that ticks it, between two ticks."""

    @property
    def robot(self) -> RobotModel:
        """Dimensions and limits."""

    def reading(self) -> Reading:
        """The state after the last tick."""

    def overlay(self, action: Superposition | None) -> None:
        """Take what the next tick does; None: no overlay acts (any more), the arm rests where it can.

        The first None after an overlay brakes every axis within its limits; the interpolator then is where they rest.
        """


class HoldingTarget(OverlayTarget, Protocol):
    """An arm that can also hold its position in a control mode by itself, without an application."""

    def hold(self, mode: Mode) -> None:
        """Hold the present position in a control mode, until `release`."""

    def release(self) -> None:
        """End the hold; the arm rests in position control."""
