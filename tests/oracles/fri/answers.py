"""Answers of a session: the setpoint of a cycle, and its datagram; what native/fri_cycle.c has to do."""

from __future__ import annotations

from dataclasses import dataclass

from heptarm.errors import CommandRejected
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.version import Version

from .codec import encode_command
from .sample import Sample


@dataclass(slots=True)
class Setpoint:
    """Setpoint of a cycle in COMMANDING_ACTIVE; a field that is None has no effect on the motion.

    Attributes:
        q: joint position [rad]; None mirrors the interpolator.
        tau: superposed joint torques [Nm]; None is zero. TORQUE only.
        wrench: superposed wrench [N, Nm]; None is zero. WRENCH only.
        pose: Cartesian pose [mm, quaternion]; None mirrors the interpolator. CARTESIAN_POSE only.
        redundancy: of the pose; None mirrors the interpolator.
        io: outputs to set.
        transformations: values of the requested transformations.
    """

    q: m.Joints | None = None
    tau: m.Joints | None = None
    wrench: tuple[float, ...] | None = None
    pose: m.Transformation | None = None
    redundancy: m.Redundancy | None = None
    io: tuple[m.IoValue, ...] = ()
    transformations: tuple[m.Transformation, ...] = ()

    @property
    def is_plain(self) -> bool:
        """Whether it has no outputs and no transformations."""
        return not self.io and not self.transformations

    def check(self, full: m.Monitoring) -> None:
        """Check outputs and transformations against those of the session.

        Args:
            full: the message to answer.

        Raises:
            CommandRejected: the session lacks an output or a transformation; `allowed` lists those that it has.
        """
        signals = {one.name: one for one in (full.monitor.io if full.monitor is not None else ())}
        for value in self.io:
            offered = signals.get(value.name)
            if offered is None or offered.direction is not m.IoDirection.OUTPUT:
                outputs = [name for name, one in signals.items() if one.direction is m.IoDirection.OUTPUT]
                raise CommandRejected(
                    f"this FRI session has no output {value.name!r}",
                    parameter=value.name,
                    allowed=", ".join(outputs) or "none",
                    hint="register the signal in the cabinet's FRI configuration",
                )
            if offered.type is not value.type:
                raise CommandRejected(
                    f"the type of {value.name!r} must be {offered.type.name}, got {value.type.name}",
                    parameter=value.name,
                )
        requested = [one.name for one in full.requested]
        for one in self.transformations:
            if one.name not in requested:
                raise CommandRejected(
                    f"the controller requests no transformation {one.name!r}",
                    parameter=one.name,
                    allowed=", ".join(requested) or "none",
                )


#: Setpoint that mirrors the interpolator.
NOTHING = Setpoint()


_ZEROS7, _ZEROS6 = (0.0,) * 7, (0.0,) * 6
_MONITORING = (m.SessionState.MONITORING_WAIT, m.SessionState.MONITORING_READY)


class Answers:
    """Builder of answers.

    Args:
        version: wire format.

    Attributes:
        missing: what the last answer lacks, as text; empty if nothing.
    """

    def __init__(self, version: Version) -> None:
        self._version = version
        self.missing = ""

    def make(
        self,
        sample: Sample,
        setpoint: Setpoint,
        header: m.Header,
        *,
        state: m.SessionState,
        mode: m.CommandMode,
    ) -> bytes:
        """Make the answer to a message.

        Args:
            sample: the message.
            setpoint: setpoint of the cycle; its motion counts in COMMANDING_ACTIVE only, outputs and transformations
                always.
            header: header of the answer.
            state: state of the session.
            mode: client command mode.
        """
        self.missing = ""
        motion = setpoint if state is m.SessionState.COMMANDING_ACTIVE else NOTHING
        q: m.Joints | None = None
        if state in _MONITORING:
            mode = m.CommandMode.POSITION
            q = None if self._version.traits.quaternions else sample.q_cmd
        elif mode is m.CommandMode.CARTESIAN_POSE:
            return self._pose_answer(sample, motion, setpoint, header)
        elif mode is not m.CommandMode.NO_COMMAND:
            q = motion.q if motion.q is not None else sample.q_ipo
            if q is None:
                self.missing = "the controller sends no interpolator position to mirror"
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

    def _pose_answer(self, sample: Sample, motion: Setpoint, setpoint: Setpoint, header: m.Header) -> bytes:
        ipo = sample.message.ipo or m.IpoData()
        pose, redundancy = motion.pose or ipo.pose, motion.redundancy or ipo.redundancy
        if pose is None:
            self.missing, redundancy = "the controller sends no interpolator pose to mirror", None
        command = m.Command(
            header,
            pose=pose,
            redundancy=redundancy,
            io=setpoint.io,
            transformations=setpoint.transformations,
        )
        return encode_command(command, self._version)
