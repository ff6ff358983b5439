"""`heptarm demo`: five motions through the whole stack, a table, and a plot of joints commanded against measured."""

from __future__ import annotations

import importlib.util
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter
from rich.console import Console
from rich.table import Table
from rich.text import Text

from heptarm.arm.arm import Arm
from heptarm.cli.options import (
    NO_TARGET,
    CommandTarget,
    Json,
    Overwrite,
)
from heptarm.cli.output import emit
from heptarm.errors import CommandRejected, require
from heptarm.values.checks import Array
from heptarm.values.files import writable_file
from heptarm.values.motion.line import lin, lin_rel
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import Pose, deg
from heptarm.values.result import Cause, Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_RATE = 250.0


@dataclass(frozen=True, slots=True)
class DemoStep:
    """A motion of the demo and its outcome."""

    name: str
    cause: str
    text: str
    begin: float
    end: float
    residual: float
    as_designed: bool


class _Recorder:
    """Collects every pushed state."""

    def __init__(self, arm: Arm) -> None:
        self._stream = arm.states(size=100_000)
        self.times: list[float] = []
        self.q: list[Array] = []
        self.q_cmd: list[Array] = []

    def take(self, arm: Arm) -> None:
        """Take all states received so far."""
        last = arm.state.stamp
        for state in self._stream:
            self.times.append(state.stamp * 1e-9)
            self.q.append(state.q)
            self.q_cmd.append(state.q_cmd)
            if state.stamp >= last:
                return


def demo(
    *,
    plot: Annotated[
        Path | None,
        Parameter(help="Where to save the plot. Default: heptarm-demo.png, if Matplotlib is installed."),
    ] = None,
    overwrite: Overwrite = False,
    target: CommandTarget = NO_TARGET,
    as_json: Json = False,
) -> int:
    """Move a virtual arm through the whole stack; a table and a plot show the result.

    For example:

        heptarm demo

        heptarm demo --plot demo.png --target sim://localhost:30001
    """
    logging.getLogger("heptarm").setLevel(logging.ERROR)
    if plot is not None:
        require("matplotlib", extra="viz")
        writable_file(plot, overwrite=overwrite, name="plot")
    elif importlib.util.find_spec("matplotlib") is not None:
        plot = Path("heptarm-demo.png")
    began = time.monotonic()
    chosen = target if target.text else replace(target, text="sim://iiwa14")  # a robot only if it is named
    with chosen.connect(state_rate=_RATE) as arm:
        if not arm.is_virtual:
            raise CommandRejected(
                f"--target must be a virtual arm, got the real {arm.robot.title}: the demo moves it far and fast",
                parameter="target",
                value=target.text,
                hint="heptarm move asks before it moves a robot, at 10 % speed",
            )
        ready = time.monotonic() - began
        recorder = _Recorder(arm)
        steps = [step(arm) for step in (_ptp, _lin, _lin_rel, _cancelled, _refused, _home)]
        recorder.take(arm)
        title = arm.robot.title
        controlled = f"{title}{' (virtual)' if arm.is_virtual else ''}, cabinet application {arm.software}"
    if plot is not None:
        _draw(recorder, steps, plot, title)
    if as_json:
        for step in steps:
            emit(
                {
                    "motion": step.name,
                    "duration_s": step.end - step.begin,
                    "residual_rad": step.residual,
                    "cause": step.cause,
                }
                | {"text": step.text, "as_designed": step.as_designed}
            )
    else:
        console = Console()
        console.print(f"{controlled}, ready after {ready:.1f} s")
        console.print(_table(steps))
        where = f"plotted in {plot}" if plot else "not plotted: for that, pip install 'heptarm[viz]'"
        print(f"{len(recorder.q)} states, {where}")
    return 0 if all(step.as_designed for step in steps) else 1


def _timed(arm: Arm, name: str, wanted: Cause, work: Callable[[], Result]) -> DemoStep:
    begin = arm.state.stamp * 1e-9
    result = work()
    state = arm.wait_for_rest()
    return DemoStep(
        name,
        result.cause.value,
        result.text,
        begin,
        state.stamp * 1e-9,
        result.residual,
        result.cause is wanted,
    )


def _ptp(arm: Arm) -> DemoStep:
    return _timed(
        arm,
        "PTP to joint positions",
        Cause.FINISHED,
        lambda: arm.move(ptp(deg(20, 35, 0, -80, 0, 65, 20)), speed=0.6),
    )


def _lin(arm: Arm) -> DemoStep:
    start = arm.wait_for_rest()
    goal = Pose.of(start.pose.xyz + [0.0, -0.25, 0.10], start.pose.quat)
    return _timed(
        arm, "LIN to a pose", Cause.FINISHED, lambda: arm.move(lin(goal, near=start.q, speed_mps=0.25))
    )


def _lin_rel(arm: Arm) -> DemoStep:
    motion = lin_rel(z=0.12, c=0.4, frame="tool", speed_mps=0.15)
    return _timed(arm, "LIN_REL in the tool frame", Cause.FINISHED, lambda: arm.move(motion))


def _cancelled(arm: Arm) -> DemoStep:
    def work() -> Result:
        handle = arm.start(ptp(deg(-50, 20, 0, -100, 0, 50, -40)), speed=0.4)
        arm.wait_until(lambda state: handle.progress > 0.3, timeout=10.0)
        handle.cancel()
        return handle.wait()

    return _timed(arm, "PTP, cancelled under way", Cause.CANCELLED, work)


def _refused(arm: Arm) -> DemoStep:
    now = arm.state.stamp * 1e-9
    try:
        arm.move(ptp(deg(0, 150, 0, -90, 0, 60, 0)))
    except CommandRejected as error:
        return DemoStep(
            "PTP beyond a joint limit", "refused", error.text, now, arm.state.stamp * 1e-9, float("nan"), True
        )
    return DemoStep(
        "PTP beyond a joint limit", "accepted", "it should have been refused", now, now, float("nan"), False
    )


def _home(arm: Arm) -> DemoStep:
    return _timed(
        arm, "PTP home", Cause.FINISHED, lambda: arm.move(ptp(deg(0, 0, 0, -90, 0, 90, 0)), speed=0.6)
    )


def _table(steps: list[DemoStep]) -> Table:
    table = Table()
    table.add_column("motion")
    table.add_column("duration", justify="right")
    table.add_column("residual", justify="right")
    table.add_column("cause")
    for step in steps:
        residual = "" if np.isnan(step.residual) else f"{step.residual:.1e} rad"
        duration = "" if step.cause == "refused" else f"{step.end - step.begin:.2f} s"
        cause = step.cause + (f": {step.text}" if step.text else "")
        # a text is no markup: its brackets are to be seen
        table.add_row(step.name, duration, residual, Text(cause), style=None if step.as_designed else "red")
    return table


def _draw(recorder: _Recorder, steps: list[DemoStep], path: Path, title: str) -> None:
    matplotlib = require("matplotlib", extra="viz")
    matplotlib.use("Agg")
    plt: Any = require("matplotlib.pyplot", extra="viz")
    times = np.array(recorder.times) - recorder.times[0]
    q, q_cmd = np.degrees(np.array(recorder.q)), np.degrees(np.array(recorder.q_cmd))
    figure, (upper, lower) = plt.subplots(
        2, 1, figsize=(11, 7), sharex=True, height_ratios=(3, 1), layout="constrained"
    )
    colours = plt.get_cmap("tab10").colors
    for axis in range(7):
        upper.plot(times, q_cmd[:, axis], color=colours[axis], linewidth=3.5, alpha=0.3)
        upper.plot(times, q[:, axis], color=colours[axis], linewidth=1.1, label=f"A{axis + 1}")
        lower.plot(times, (q_cmd - q)[:, axis], color=colours[axis], linewidth=0.9)
    _shade(upper, lower, steps, recorder.times[0])
    upper.set_ylabel("joint position [deg]")
    upper.set_title(f"{title}: measured (thin) on commanded (broad)", loc="left", fontsize=11)
    upper.legend(ncols=7, loc="lower center", frameon=False, fontsize=9)
    upper.margins(y=0.16)
    lower.set_ylabel("difference [deg]")
    lower.set_xlabel("time [s]")
    for axes in (upper, lower):
        axes.grid(alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _shade(upper: Axes, lower: Axes, steps: list[DemoStep], zero: float) -> None:
    """Bands for the motions, with their names above."""
    top = upper.get_xaxis_transform()
    for index, step in enumerate(steps):
        begin, end = step.begin - zero, step.end - zero
        if step.cause == "refused":
            upper.axvline(begin, color="firebrick", linestyle=":", linewidth=1.2)
            upper.text(begin, 0.90, " refused", transform=top, color="firebrick", fontsize=8, va="top")
            continue
        for axes in (upper, lower):
            axes.axvspan(begin, end, color="0.5", alpha=0.10 if index % 2 else 0.05, linewidth=0)
        label = step.name.split(" to ")[0].split(" in ")[0].replace(", ", "\n").replace(" under way", "")
        upper.text((begin + end) / 2, 0.985, label, transform=top, fontsize=8, ha="center", va="top")
