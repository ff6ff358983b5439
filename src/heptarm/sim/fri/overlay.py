"""Overlays of an FRI client on a motion, as values, and the arm that executes them.

Position and pose overlays move the set-point of whatever control mode is in force; torque and wrench overlays do that
too, and add a load on top of what the control mode gives.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from heptarm.errors import CommandRejected, ModeConflict
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.version import Version
from heptarm.sim.control_laws.laws import Superposition
from heptarm.sim.fri.settings import SessionConfiguration
from heptarm.values.mode.impedance import JointImpedance
from heptarm.values.mode.mode import Mode, Position
from heptarm.values.robot import RobotModel

Seven = tuple[float, ...]
_ZEROS: Seven = (0.0,) * 7

#: Longest receive period of a torque overlay [ms].
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
    """The overlay that the application adds to a motion so that the client may command.

    Attributes:
        mode: client command mode.
        control: control mode of the motion underneath.
    """

    mode: m.CommandMode = m.CommandMode.POSITION
    control: m.ControlMode = m.ControlMode.POSITION

    @property
    def kind(self) -> m.Overlay:
        """Whether joints or a pose are superposed."""
        return m.Overlay.CARTESIAN if self.mode is m.CommandMode.CARTESIAN_POSE else m.Overlay.JOINT

    def check(self, configuration: SessionConfiguration) -> None:
        """Check that the overlay is legal in a session.

        Raises:
            CommandRejected: this version has no such command mode, or the session is too slow for it.
            ModeConflict: the command mode does not go with the control mode.
        """
        name = self.mode.name
        legal = CONTROLS.get(self.mode)
        if legal is None:
            raise CommandRejected(
                f"client command mode {name} commands nothing",
                parameter="mode",
                hint="choose " + ", ".join(mode.name for mode in CONTROLS),
            )
        if self.mode is m.CommandMode.CARTESIAN_POSE and not configuration.version.traits.quaternions:
            raise CommandRejected(
                f"FRI {configuration.version.value} has no command mode {name}",
                parameter="mode",
                hint=f"use FRI {Version.V2_5.value} or later",
            )
        if self.control not in legal:
            raise ModeConflict(
                f"client command mode {name} is not possible in control mode {self.control.name}",
                parameter="mode",
                allowed=" or ".join(control.name for control in legal),
                hint=f"hold the position in control mode {' or '.join(c.name for c in legal)}",
            )
        if self.mode is m.CommandMode.TORQUE and configuration.receive_ms > TORQUE_MS:
            raise CommandRejected(
                f"client command mode TORQUE: receive period must be in [1, {TORQUE_MS}] ms, got "
                f"{configuration.receive_ms} ms",
                parameter="period_ms",
                value=configuration.receive_ms,
                allowed=f"[1, {TORQUE_MS}] ms",
            )


def control_mode(mode: Mode) -> m.ControlMode:
    """The control mode as FRI numbers it."""
    if isinstance(mode, Position):
        return m.ControlMode.POSITION
    return (
        m.ControlMode.JOINT_IMPEDANCE
        if isinstance(mode, JointImpedance)
        else m.ControlMode.CARTESIAN_IMPEDANCE
    )


def missing(mode: m.CommandMode, command: m.Command) -> str:
    """Name of the field that a command of this mode lacks; empty if it has all."""
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


class OverlayTarget(Protocol):
    """An arm with overlays; all calls come from the thread that ticks it, between two ticks."""

    @property
    def robot(self) -> RobotModel:
        """Dimensions and limits."""

    @property
    def command_delay(self) -> int:
        """Delay of a client's commands beyond their interpolation [ticks]."""

    def reading(self) -> Reading:
        """The state after the last tick."""

    def overlay(self, action: Superposition | None) -> None:
        """Set the overlay of the next tick; None: none.

        The first None after an overlay brakes every axis within its limits; the interpolator continues from there.
        """
