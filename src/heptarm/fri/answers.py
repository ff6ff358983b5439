"""The answers of one session: a header, and what state and client command mode want with it."""

from __future__ import annotations

from heptarm.fri import messages as m
from heptarm.fri.encoder import encode_command
from heptarm.fri.setpoint import NOTHING, Setpoint
from heptarm.fri.template import CommandTemplate, Sample
from heptarm.fri.version import Version

_ZEROS7, _ZEROS6 = (0.0,) * 7, (0.0,) * 6
_MONITORING = (m.SessionState.MONITORING_WAIT, m.SessionState.MONITORING_READY)


class Answers:
    """Makes answers.

    Args:
        version: wire format.

    Attributes:
        lack: what the last answer had to go without, in words; empty if nothing.
    """

    def __init__(self, version: Version) -> None:
        self._version = version
        self._templates: dict[m.CommandMode, CommandTemplate] = {}
        self.lack = ""

    def make(
        self,
        sample: Sample,
        setpoint: Setpoint,
        header: m.Header,
        *,
        state: m.SessionState,
        mode: m.CommandMode,
    ) -> bytes:
        """The answer to a message.

        Args:
            sample: the message.
            setpoint: what is wanted; its motion counts in COMMANDING_ACTIVE only, outputs and transformations always.
            header: of the answer.
            state: of the session.
            mode: client command mode.
        """
        self.lack = ""
        motion = setpoint if state is m.SessionState.COMMANDING_ACTIVE else NOTHING
        q: m.Joints | None = None
        if state in _MONITORING:
            mode = m.CommandMode.POSITION
            q = None if self._version.traits.quaternions else sample.q_cmd
        elif mode is m.CommandMode.CARTESIAN_POSE:
            return self._posed(sample, motion, setpoint, header)
        elif mode is not m.CommandMode.NO_COMMAND:
            q = motion.q if motion.q is not None else sample.q_ipo
            if q is None:
                self.lack = "the controller sends no interpolator position to mirror"
        if q is not None and setpoint.is_plain:
            return self._joints(mode, q, motion, header)
        commands = q is not None
        command = m.Command(
            header,
            q=q,
            tau=motion.tau or _ZEROS7 if commands and mode is m.CommandMode.TORQUE else None,
            wrench=motion.wrench or _ZEROS6 if commands and mode is m.CommandMode.WRENCH else None,
            io=setpoint.io,
            transformations=setpoint.transformations,
        )
        return encode_command(command, self._version)

    def _joints(self, mode: m.CommandMode, q: m.Joints, motion: Setpoint, header: m.Header) -> bytes:
        """The frequent answers, from templates."""
        template = self._templates.get(mode)
        if template is None:
            template = self._templates[mode] = CommandTemplate(
                self._version, torque=mode is m.CommandMode.TORQUE, wrench=mode is m.CommandMode.WRENCH
            )
        template.q[:] = q
        if template.tau is not None:
            template.tau[:] = motion.tau or _ZEROS7
        if template.wrench is not None:
            template.wrench[:] = motion.wrench or _ZEROS6
        return template.encode(header.sequence, header.reflected)

    def _posed(self, sample: Sample, motion: Setpoint, setpoint: Setpoint, header: m.Header) -> bytes:
        ipo = sample.message.ipo or m.IpoData()
        pose, redundancy = motion.pose or ipo.pose, motion.redundancy or ipo.redundancy
        if pose is None:
            self.lack, redundancy = "the controller sends no interpolator pose to mirror", None
        command = m.Command(
            header,
            pose=pose,
            redundancy=redundancy,
            io=setpoint.io,
            transformations=setpoint.transformations,
        )
        return encode_command(command, self._version)
