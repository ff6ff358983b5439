"""The monitoring message of a tick, with what each version can carry."""

from __future__ import annotations

from dataclasses import dataclass

from heptarm.fri import messages as m
from heptarm.values.robot import RobotModel
from heptarm.virtual.fri import cartesian
from heptarm.virtual.fri.configuration import Configuration
from heptarm.virtual.fri.overlay import MotionOverlay, Reading


@dataclass(frozen=True, slots=True)
class Status:
    """The session as its messages show it; `tracking` only while commanding is active."""

    state: m.SessionState
    quality: m.Quality
    overlay: MotionOverlay | None
    tracking: float | None


def report(
    reading: Reading,
    *,
    header: m.Header,
    stamp: m.TimeStamp,
    status: Status,
    configuration: Configuration,
    robot: RobotModel,
    signals: tuple[m.IoValue, ...],
    requested: tuple[m.Transformation, ...],
) -> m.Monitoring:
    """The message of a tick."""
    traits = configuration.version.traits
    return m.Monitoring(
        header,
        robot=m.RobotInfo(
            7, reading.safety, (reading.drives,) * 7, reading.operation_mode, reading.control_mode
        ),
        monitor=m.MonitorData(
            q=reading.q,
            tau=reading.tau,
            q_cmd=None if traits.quaternions else reading.q_cmd,
            tau_cmd=reading.tau_cmd,
            tau_ext=reading.tau_ext,
            wrench=reading.wrench if traits.framed else None,
            io=signals,
            pose=cartesian.transformation(robot, reading.q) if traits.quaternions else None,
            redundancy=_redundancy(reading.q) if traits.quaternions else None,
            stamp=stamp,
        ),
        connection=m.ConnectionInfo(
            status.state, status.quality, configuration.period_ms, configuration.multiplier
        ),
        ipo=_ipo(reading, status, robot),
        requested=requested,
    )


def _ipo(reading: Reading, status: Status, robot: RobotModel) -> m.IpoData:
    """Interpolator's data; its positions are in it only while somebody is to mirror or to lead them."""
    overlay = status.overlay
    if overlay is None:
        return m.IpoData(command_mode=m.CommandMode.NO_COMMAND, overlay=m.Overlay.NONE)
    pose = redundancy = None
    if overlay.kind is m.Overlay.CARTESIAN:
        pose, redundancy = cartesian.transformation(robot, reading.q_ipo), _redundancy(reading.q_ipo)
    return m.IpoData(reading.q_ipo, pose, redundancy, overlay.mode, overlay.kind, status.tracking)


def _redundancy(q: tuple[float, ...]) -> m.Redundancy:
    return m.Redundancy(m.RedundancyStrategy.E1, q[2])
