"""The preview of a program: how it would go, before anything moves."""

from __future__ import annotations

import tempfile
import webbrowser
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from heptarm.io.panel_box import PlanOutline, hand_over
from heptarm.record.plot.chart import Chart
from heptarm.record.plot.content import Band, ChartRow, Line, Mark, Style
from heptarm.record.plot.signals import path_line, path_row
from heptarm.values.checks import Array, Value, word
from heptarm.values.clearance import ForeseenCollision
from heptarm.values.condition.condition import Condition
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel
from heptarm.values.text import fixed, lines

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DEG = 180.0 / np.pi
#: Limits of the joints: the name, what a joint has of it, the factor and unit in which people read it.
LIMITS = {
    "position": ("range", _DEG, "deg"),
    "velocity": ("speed", _DEG, "deg/s"),
    "acceleration": ("acceleration", _DEG, "deg/s²"),
    "torque": ("torque", 1.0, "Nm"),
}
#: Motions that the text of a preview lists.
_LISTED = 12


@dataclass(frozen=True, slots=True)
class LimitApproach(Value):
    """Where a program comes closest to a limit of the joints.

    Attributes:
        limit: "position", "velocity", "acceleration" or "torque".
        axis: the joint, 1 to 7.
        fraction: of the limit that is used; a position counts from the middle of the joint's range to its end.
        value: there [rad, rad/s, rad/s² or Nm].
        allowed: the limit itself, in the same unit.
        t: time from the beginning of the program [s].
    """

    limit: str
    axis: int
    fraction: float
    value: float
    allowed: float
    t: float

    def __str__(self) -> str:
        """In words: "A4 at 97 % of its speed, 1.83 s"."""
        name, factor, unit = LIMITS[self.limit]
        numbers = f"{fixed(self.value * factor, 1)} of {fixed(self.allowed * factor, 1)} {unit}"
        return f"A{self.axis} at {100 * self.fraction:.0f} % of its {name}, {self.t:.2f} s ({numbers})"


@dataclass(frozen=True, slots=True, eq=False)
class PreviewedMotion(Value):
    """One motion of a previewed program.

    Attributes:
        name: its kind, such as "Lin".
        begin: time at which it begins [s]; behind a blend the middle of the blend.
        duration: until the next one begins, or until the program ends [s].
        is_blended: the next one begins without a stop.
    """

    name: str
    begin: float
    duration: float
    is_blended: bool


@dataclass(frozen=True, slots=True, eq=False)
class ProgramPreview(Value):
    """How a program would go: made by `Arm.plan`, which moves nothing. n samples over time.

    It holds at full override, on the path of the commanded position. The arm needs some ten milliseconds more to settle
    wherever it stops. The torques are those of the nominal model with the load of the attached tool; the forces of
    contacts and of friction are not in them.

    Attributes:
        robot: the robot.
        t: times from its beginning [s], shape (n,).
        q: joint positions, shape (n, 7) [rad].
        dq: joint velocities, shape (n, 7) [rad/s].
        ddq: joint accelerations, shape (n, 7) [rad/s²].
        tau: joint torques, shape (n, 7) [Nm].
        tcp: poses of the tool frame in the base, shape (n, 7): x y z [m], quaternion x y z w.
        motions: its motions, in their order.
        collisions: where bodies would touch, at most one for each motion; empty if none do, or if nothing checked it.
        is_checked: whether a collision model has checked it. That is no safety function.
        until: break condition, which may end it earlier than planned; None: there is none.
    """

    robot: RobotModel
    t: Array
    q: Array
    dq: Array
    ddq: Array
    tau: Array
    tcp: Array
    motions: tuple[PreviewedMotion, ...]
    collisions: tuple[ForeseenCollision, ...] = ()
    is_checked: bool = False
    until: Condition | None = None

    @property
    def duration(self) -> float:
        """Its duration at full override [s]."""
        return float(self.t[-1])

    @property
    def length(self) -> float:
        """Length of the path of the tool frame [m]."""
        return float(np.linalg.norm(np.diff(self.tcp[:, :3], axis=0), axis=1).sum())

    @property
    def end(self) -> Pose:
        """Pose of the tool frame at its end, in the base."""
        return Pose.of(self.tcp[-1, :3], self.tcp[-1, 3:])

    def q_at(self, t: float) -> Array:
        """Joint positions at a time [s], shape (7,) [rad]; before its beginning and behind its end those there."""
        return np.array([np.interp(t, self.t, column) for column in self.q.T])

    def closest(self, limit: str = "velocity") -> LimitApproach:
        """Where it comes closest to a limit of the joints.

        Args:
            limit: "position", "velocity", "acceleration" or "torque".

        Raises:
            CommandRejected: no such limit.
        """
        word(limit, "limit", tuple(LIMITS))
        values, middle, room = self._limited(limit)
        fractions = np.abs(values - middle) / room
        sample, joint = np.unravel_index(int(fractions.argmax()), fractions.shape)
        value = float(values[sample, joint])
        side = 1.0 if value >= middle[joint] else -1.0
        allowed = float(middle[joint] + side * room[joint])
        return LimitApproach(
            limit, int(joint) + 1, float(fractions[sample, joint]), value, allowed, float(self.t[sample])
        )

    def _limited(self, limit: str) -> tuple[Array, Array, Array]:
        """Values of a quantity, and the middle and half width of its range."""
        robot, none = self.robot, np.zeros(7)
        if limit == "position":
            return self.q, 0.5 * (robot.q_max + robot.q_min), 0.5 * (robot.q_max - robot.q_min)
        if limit == "velocity":
            return self.dq, none, robot.dq_max
        if limit == "acceleration":
            return self.ddq, none, robot.ddq_max
        return self.tau, none, robot.tau_max

    def __str__(self) -> str:
        """Aligned lines: duration, motions, limits, collisions."""
        count = len(self.motions)
        rows = {
            "duration": f"{self.duration:.2f} s at full override",
            "until": "" if self.until is None else f"{self.until}; it may end earlier",
            "motions": "\n".join(self._listed()),
            "path": f"{self.length:.3f} m of the tool frame, to {self.end}",
        }
        rows |= {name: str(self.closest(name)) for name in ("position", "velocity", "torque")}
        found = "\n".join(map(str, self.collisions)) or "none on the path, by the collision model"
        rows["collisions"] = found if self.is_checked else "not checked"
        return lines(f"Preview of {count} motion{'s' * (count != 1)}; nothing was moved", rows)

    def _listed(self) -> list[str]:
        rows = [
            f"{motion.begin:7.2f} s  {motion.name:<11} {motion.duration:7.2f} s"
            + ("  blended" if motion.is_blended else "")
            for motion in self.motions[:_LISTED]
        ]
        more = len(self.motions) - _LISTED
        return [*rows, f"... {more} more"] if more > 0 else rows

    # ----------------------------------------------------------------------------------- figures

    def chart(self) -> Chart:
        """Joint positions, speeds and torques beside their limits over time, and the path of the tool frame."""
        rows = []
        for limit in ("position", "velocity", "torque"):
            values, middle, room = self._limited(limit)
            fractions = (values - middle) / room
            lines = (
                Line(self.t, fractions[:, joint], label=f"A{joint + 1}", colour=joint) for joint in range(7)
            )
            rows.append(ChartRow(LIMITS[limit][0], "fraction of limit", tuple(lines), edges=(-1.0, 1.0)))
        touched = [int(np.abs(self.t - found.t).argmin()) for found in self.collisions]
        path = self.tcp[:, :3]
        rows.append(path_row("tool frame", (path_line(path, "path"),), path[touched] * 1e3))
        return Chart(
            f"preview: {self.robot.title}, {len(self.motions)} motions, {self.duration:.2f} s",
            tuple(rows),
            tuple(Band(motion.begin, motion.begin + motion.duration) for motion in self.motions),
            tuple(Mark(found.t, "collision", is_alarm=True) for found in self.collisions),
        )

    def plot(self, *, style: Style = "screen") -> Figure:
        """A Matplotlib figure of the chart.

        Raises:
            MissingExtra: Matplotlib is not installed.
        """
        return self.chart().figure(style=style)

    def outline(self) -> PlanOutline:
        """What a panel shows of it."""
        touches = np.array([collision.t for collision in self.collisions], float)
        return PlanOutline(self.robot.name, self.t, self.q, self.tcp[:, :3], touches)

    def show(self) -> Path | None:
        """Show it: as a ghost of the arm in an open panel of this user, otherwise as a page in the web browser.

        Returns:
            The page, a file that stays; None: a panel shows it.

        Raises:
            MissingExtra: no panel is open, and plotly is not installed.
        """
        if hand_over(self.outline()):
            return None
        folder = Path(tempfile.mkdtemp(prefix="heptarm-preview-"))
        page = self.chart().save(folder / "preview.html")
        webbrowser.open(page.as_uri())
        return page
