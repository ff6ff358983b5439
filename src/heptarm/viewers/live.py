"""The live view: an arm, or several, in the rerun viewer while they move, or in a file for it."""

from __future__ import annotations

import os
import socket
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from heptarm.arm.arm import Arm
from heptarm.arm.several import Arms
from heptarm.errors import CommandRejected, require, shortage
from heptarm.record.recorder import Recorder, RecordSource, epoch_of
from heptarm.values.checks import flag, instance, within
from heptarm.values.files import path_of, refuse_existing, unwritable
from heptarm.values.sealed import Sealed

if TYPE_CHECKING:
    from heptarm.viewers.rerun_stream import RerunStream

#: Time between two looks at what has arrived [s]: twenty pictures per second cost little.
_PERIOD = 0.05
#: Port of rerun's viewer, and longest time for its answer [s].
_PORT, _PATIENCE = 9876, 3.0
#: Distance of the bases of several arms [m].
_APART = 1.4
#: Signals of the plots beside the arm.
_PLOTTED = ("q", "dq", "tau_ext", "force")


class LiveView(Sealed):
    """Shows what one arm or several report; made by `live`. A `with` block ends it.

    Args:
        arms: by the name under which rerun shows them.
        file: also written, or written alone; None: none.
        to: address of a viewer that runs already; empty: none.
        spawn: open a viewer here.
        rate: have at least so many states pushed per second meanwhile [Hz]; None: as many as are.

    Raises:
        MissingExtra: the package rerun or mujoco is not installed.
        LimitError: a rate outside its range.
        CommandRejected: the file cannot be written, no viewer answers at the address, or there is no display.
    """

    def __init__(
        self, arms: Mapping[str, Arm], *, file: Path | None, to: str, spawn: bool, rate: float | None
    ) -> None:
        for module in ("rerun", "mujoco"):
            require(module, extra="rerun")
        self._arms, self._file, self._to, self._spawn = dict(arms), file, to, spawn
        sources = {name: arm.connection for name, arm in self._arms.items()}
        path = Path("rerun") if file is None else file
        self._recorder = Recorder(sources, path, rate=rate, sinks=self._open, period=_PERIOD)
        self._recorder.start()

    @property
    def states(self) -> int:
        """Pushed states sent so far, of all arms."""
        return self._recorder.states

    @property
    def lost(self) -> int:
        """States and FRI cycles that could not be sent."""
        return self._recorder.lost

    @property
    def is_running(self) -> bool:
        """Whether it shows what arrives."""
        return self._recorder.is_running

    def note(self, text: str) -> None:
        """Put a line into the events.

        Raises:
            ShapeError: not a text.
            CommandRejected: it is empty or longer than 1000 characters.
        """
        self._recorder.note(text)

    def close(self) -> None:
        """Send what has arrived, and end; the viewer stays open. Calling it again has no effect."""
        self._recorder.close()

    def __enter__(self) -> LiveView:
        """The view itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """End it."""
        self.close()

    def __repr__(self) -> str:
        """Short form."""
        state = "running" if self.is_running else "closed"
        return f"<LiveView of {', '.join(self._arms)}, {state}, {self.states} states, {self.lost} lost>"

    # ------------------------------------------------------------------------------------------------ opening

    def _open(self, sources: Mapping[str, RecordSource]) -> Sequence[RerunStream]:
        """A stream of rerun, and what fills it for each arm."""
        rerun = require("rerun", extra="rerun")
        from heptarm.viewers.rerun_stream import RerunStream

        recording = rerun.RecordingStream("heptarm")
        outputs: list[Any] = []
        if self._to:
            _check_viewer(self._to)
            outputs.append(rerun.GrpcSink(self._to))
        if self._spawn:
            _check_display()
        if self._file is not None:  # after what may be refused: it is created, or emptied
            _check_writable(self._file)
            outputs.append(rerun.FileSink(str(self._file)))
        if self._spawn:
            rerun.spawn(port=_PORT, connect=False, hide_welcome_screen=True)
            outputs.append(rerun.GrpcSink(f"rerun+http://127.0.0.1:{_PORT}/proxy"))
        recording.set_sinks(*outputs, default_blueprint=blueprint(tuple(self._arms)))
        return [
            RerunStream(
                recording,
                arm.robot.name,
                name=name,
                place=(0.0, _APART * number, 0.0),
                epoch=epoch_of(source),
            )
            for number, ((name, arm), source) in enumerate(zip(self._arms.items(), sources.values()))
        ]


def live(
    arm: Arm | Arms,
    *,
    save: str | Path | None = None,
    to: str = "",
    viewer: bool | None = None,
    rate: float | None = None,
    overwrite: bool = False,
) -> LiveView:
    """Show an arm in the rerun viewer while it moves: its shapes, plots of its signals, and its events.

    ::

        with ha.live(arm):
            arm.move(...)

    A thread of its own sends what arrives, as a recording does; it never holds up the states.

    Args:
        arm: connected; it need not be in control. Several are shown side by side on one time line.
        save: file for rerun (.rrd), for machines without a viewer; `rerun FILE` opens it. None: none.
        to: address of a viewer that runs already, such as "rerun+http://192.168.0.5:9876/proxy"; empty: none.
        viewer: open a viewer on this machine; None: if neither `save` nor `to` is given.
        rate: have at least so many states pushed per second meanwhile [Hz]; None: as many as are.
        overwrite: replace a file that exists.

    Returns:
        The view: end it with `close`, or use it as a `with` block.

    Raises:
        MissingExtra: the package rerun or mujoco is not installed.
        ShapeError: not an arm, or not a text.
        LimitError: a rate outside its range.
        CommandRejected: the file exists or cannot be written, no viewer answers at the address, or this machine has no
            display.
    """
    instance(arm, (Arm, Arms), "arm")
    replaces = flag(overwrite, "overwrite")
    file = None if save is None else refuse_existing(path_of(save, "save"), overwrite=replaces, name="save")
    address = instance(to, str, "to")
    is_asked = (file is None and not address) if viewer is None else flag(viewer, "viewer")
    if rate is not None:
        within(rate, "rate", 0.0, 1000.0, above=True, unit="Hz")
    if not is_asked and file is None and not address:
        raise CommandRejected(
            "viewer is False, and neither save nor to is given: nothing would be shown",
            parameter="viewer",
            hint="give save=FILE, to=ADDRESS or viewer=True",
        )
    arms = {"arm": arm} if isinstance(arm, Arm) else {name: arm[name] for name in arm.names}
    return LiveView(arms, file=file, to=address, spawn=is_asked, rate=rate)


def _check_writable(file: Path) -> None:
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.open("wb").close()
    except OSError as error:
        raise unwritable(file, error, name="save") from error


def _check_viewer(address: str) -> None:
    """Ask whether a viewer answers: rerun itself would try for ever, in silence."""
    refused = CommandRejected(
        f"to must be the address of a rerun viewer, such as rerun+http://127.0.0.1:{_PORT}/proxy, got {address!r}",
        parameter="to",
        value=address,
    )
    try:
        parts = urlsplit(address)
        host, port = parts.hostname, parts.port or _PORT
    except ValueError:
        raise refused from None
    if parts.scheme not in ("rerun", "rerun+http", "rerun+https") or not host:
        raise refused
    try:
        socket.create_connection((host, port), timeout=_PATIENCE).close()
    except OSError as error:
        raise CommandRejected(
            f"no rerun viewer answers at {host}:{port}: {error.strerror or error}",
            parameter="to",
            value=address,
            hint=shortage(error) or "start one there with: rerun --port 9876",
        ) from error


def _check_display() -> None:
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise CommandRejected(
            "this machine has no display for the rerun viewer",
            parameter="viewer",
            hint="write a file with --save FILE.rrd (save=), or name a viewer elsewhere with --to ADDRESS (to=)",
        )


def blueprint(names: Sequence[str], *, more: Sequence[Any] = ()) -> Any:
    """What the viewer shows first: the arms, plots of their signals, their events, and more views below the plots."""
    views = require("rerun.blueprint", extra="rerun")
    plots = [
        views.TimeSeriesView(
            origin=f"/{name}", contents=[f"/{name}/{signal}"], name=_title(names, name, signal)
        )
        for name in names
        for signal in _PLOTTED
    ]
    return views.Blueprint(
        views.Horizontal(
            views.Vertical(
                views.Spatial3DView(origin="/", contents=[f"/{name}/base/**" for name in names], name="Arm"),
                views.TextLogView(origin="/", contents=[f"/{name}/events" for name in names], name="Events"),
                row_shares=[3, 1],
            ),
            views.Vertical(*plots, *more),
            column_shares=[3, 2],
        ),
        collapse_panels=True,
    )


def _title(names: Sequence[str], name: str, signal: str) -> str:
    from heptarm.viewers.rerun_stream import UNITS

    title = f"{signal} [{UNITS[signal]}]"
    return title if len(names) == 1 else f"{name}: {title}"
