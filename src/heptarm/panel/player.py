"""Recordings on the page of the panel: the arm as it moved, by a slider or in time; pictures, its twin as a ghost."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from heptarm.errors import CommandRejected
from heptarm.io.panel_box import PlanOutline
from heptarm.panel.process import RATE, PanelOptions, open_server, shapes_of
from heptarm.record.episodes import LABEL, NUMBER, REASON, TASK, episode_files
from heptarm.record.recording import Recording, load
from heptarm.values.checks import Array
from heptarm.values.pose import Pose

#: Speeds at which a recording plays: simulated seconds per second, by their names on the page.
SPEEDS = {"1/4": 0.25, "1/2": 0.5, "1": 1.0, "2": 2.0, "5": 5.0}
#: Steps of the slider [s], and events that are listed.
_STEP, _EVENTS = 0.01, 5
#: Numbers of a stream that are shown.
_NUMBERS = 8
#: Most points of the path that is drawn.
_POINTS = 2000


def open_player(file: Path, options: PanelOptions) -> Player:
    """A page that plays a file, or the episodes of a folder; of one that `Twin.save` wrote the twin is the ghost.

    Raises:
        CommandRejected: the file is no recording, or cannot be played; or the folder has no episodes.
    """
    if file.is_dir():
        episodes = [path for _, path in episode_files(file)]
        if not episodes:
            raise CommandRejected(
                f"{file} has no episodes",
                parameter="play",
                value=str(file),
                hint="arm.episodes(folder) and heptarm teleop --record record some",
            )
        return Player(_first(episodes), options, episodes=episodes)
    try:
        recorded = load(file, arm="recorded")
    except CommandRejected:
        return Player(load(file), options)
    return Player(recorded, options, ghost=load(file, arm="simulated"))


def _first(files: Sequence[Path]) -> Recording:
    """The first of the files that can be read.

    Raises:
        CommandRejected: there is none; the text is that of the first one.
    """
    failure: CommandRejected | None = None
    for path in files:
        try:
            return load(path)
        except CommandRejected as error:
            failure = failure or error
    assert failure is not None
    raise failure


class Player:
    """A page that plays a recording; nothing moves by it but the drawing.

    Args:
        recording: what is played.
        options: of the panel; those that concern control do not matter.
        ghost: another recording over the same time line, drawn translucent; None: none.
        episodes: files among which the page chooses; the recording is one of them. None: there are no others.

    Attributes:
        url: with the token, to print once.
        server: of viser.

    Raises:
        CommandRejected: a recording has no joint positions, or is of an unknown robot; or as `Panel` does.
    """

    def __init__(
        self,
        recording: Recording,
        options: PanelOptions,
        *,
        ghost: Recording | None = None,
        episodes: Sequence[Path] = (),
    ) -> None:
        self._t, self._q = _positions(recording)
        shadow = None if ghost is None else _positions(ghost)
        meshes, scene = shapes_of(options)
        server, guard = open_server(options, {})
        from heptarm.panel.drawing import DrawnGhost, DrawnMarks, DrawnWorld

        self.server = server
        self._robot = robot = recording.facts["robot"]
        self._world = DrawnWorld(server, robot, scene, None, meshes, root="/arm")
        self._marks = DrawnMarks(server, "/arm")
        self._ghost = DrawnGhost(server, robot, meshes, "/arm")
        self._outline = None
        if ghost is not None and shadow is not None:
            path = np.asarray(ghost["xyz"] if "xyz" in ghost else np.zeros((0, 3)))
            self._outline = PlanOutline(robot, *shadow, _thinned(path), np.zeros(0))
        self._ended = threading.Event()
        self._episodes = {path.stem: path for path in episodes}
        #: Which episode is shown; None: there are no others.
        self.episode = (
            server.gui.add_dropdown("episode", tuple(self._episodes), initial_value=recording.path.stem)
            if self._episodes
            else None
        )
        self._played = "" if self.episode is None else str(self.episode.value)
        self._refusal = ""  # of the episode that was chosen last
        begin = float(self._t[0])
        self.slider = server.gui.add_slider("time [s]", begin, begin + _STEP, _STEP, begin)
        self.is_playing = server.gui.add_checkbox("play", True)
        self._speed = server.gui.add_dropdown("speed", tuple(SPEEDS), initial_value="1")
        #: Label and task of an episode, and what its streams gave.
        self.about = server.gui.add_markdown("")
        self.events = server.gui.add_markdown("")
        #: What the cameras saw, by their names; each with the picture that is shown.
        self.pictures: dict[str, Any] = {}
        server.initial_camera.position = (1.7, -1.5, 1.15)
        server.initial_camera.look_at = (0.15, 0.0, 0.5)
        guard.port = server.get_port()  # from now on it lets in who has the token
        self.url = guard.url
        self._take(recording)

    def _take(self, recording: Recording) -> None:
        """Show another recording from its beginning.

        Raises:
            CommandRejected: it has no joint positions, or is of another robot; what was shown stays.
        """
        t, q = _positions(recording)
        if recording.facts["robot"] != self._robot:
            raise CommandRejected(
                f"{recording.path.name} is of an {recording.facts['robot']}, the page shows an {self._robot}",
                parameter="play",
                value=str(recording.path),
                hint="play it by itself",
            )
        self._t, self._q = t, q
        self._recording = recording
        begin, end = float(self._t[0]), float(self._t[-1])
        self.slider.min, self.slider.max = begin, max(end, begin + _STEP)
        self.slider.value = begin
        self._marks.show_trail(_thinned(recording["xyz"]) if "xyz" in recording else np.zeros((0, 3)))
        for picture in self.pictures.values():
            picture.remove()
        views = {**recording.views, **({"camera": recording.pictures} if len(recording.pictures) else {})}
        self._views = {name: view for name, view in views.items() if len(view)}
        self.pictures = {
            name: self.server.gui.add_image(view[0], label=name) for name, view in self._views.items()
        }
        self._shown = dict.fromkeys(self._views, 0)
        self.show(begin)

    def _choose(self) -> None:
        """Show the episode that is chosen on the page."""
        if self.episode is None or self.episode.value == self._played:
            return
        chosen, self._refusal = str(self.episode.value), ""
        try:
            self._take(load(self._episodes[chosen]))
            self._played = chosen
        except CommandRejected as error:
            self.episode.value, self._refusal = self._played, str(error)

    def show(self, t: float) -> None:
        """Draw both arms at a time of the recording [s]."""
        run, q = self._recording, _at(t, self._t, self._q)
        self._world.show(q)
        if "pose" in run:
            pose = _at(t, run.t, run["pose"])
            force = _at(t, run.t, run["force"]) if "force" in run else None
            if not np.isnan(pose).any():
                is_felt = force is not None and not np.isnan(force).any()
                tcp = Pose.of(pose[:3], pose[3:] / np.linalg.norm(pose[3:]))
                self._marks.show(tcp, self._world.flange.xpos.copy(), force if is_felt else None)
        self._ghost.show(self._outline, t)
        for name, view in self._views.items():
            index = int(np.abs(view.t - t).argmin())
            if index != self._shown[name]:
                self._shown[name], self.pictures[name].image = index, view[index]
        self.about.content = self._refusal or _about(run, t)
        past = [event for event in run.events if event.t <= t and event.kind != "signals"]
        self.events.content = "\n".join(
            f"- `{event.t:.2f} s` {event.text[:120]}" for event in past[-_EVENTS:]
        )

    def step(self, seconds: float) -> None:
        """Draw one picture, so many seconds after the last one; at the end it begins again."""
        self._choose()
        t = float(self.slider.value)
        if self.is_playing.value:
            t += seconds * SPEEDS[self._speed.value]
            t = float(self._t[0]) if t > self._t[-1] else t
            self.slider.value = round(t, 3)
        with self.server.atomic():
            self.show(t)

    def run(self) -> None:
        """Play until `close` is called."""
        before = time.monotonic()
        while not self._ended.wait(1.0 / RATE):
            now = time.monotonic()
            if self.server.get_clients():
                self.step(now - before)
            before = now

    def close(self) -> None:
        """End the server."""
        self._ended.set()
        self.server.stop()


def _about(run: Recording, t: float) -> str:
    """Label and task of an episode, and the newest numbers of its streams at a time of it [s]."""
    rows = []
    if NUMBER in run.facts:
        label = run.outcome.get(LABEL, "unfinished")
        reason = f" ({run.outcome[REASON]})" if run.outcome.get(REASON) else ""
        rows.append(f"**{label}**{reason} {run.facts.get(TASK, '')}")
    for name, stream in run.streams.items():
        if len(stream) and stream.t[0] <= t:
            row = stream.values[int(np.searchsorted(stream.t, t, side="right")) - 1]
            rows.append(f"{name}: {', '.join(f'{value:.3g}' for value in row[:_NUMBERS])}")
    return "\n\n".join(rows)


def _positions(recording: Recording) -> tuple[Array, Array]:
    """Times [s], shape (n,), and joint positions [rad], shape (n, 7), where they are known."""
    if recording.robot is None or "q" not in recording:
        known = np.zeros(0, bool)
    else:
        known = ~np.isnan(recording["q"]).any(axis=1)
    if known.sum() < 2:
        raise CommandRejected(
            f"{recording.path.name} cannot be played: it has fewer than 2 joint positions of a known robot",
            parameter="play",
            value=str(recording.path),
            hint='record the state group "joints"',
        )
    return recording.t[known], recording["q"][known]


def _at(t: float, times: Array, rows: Array) -> Array:
    """Values at a time, linear between two rows, shape (k,)."""
    return np.array([np.interp(t, times, column) for column in rows.T])


def _thinned(path: Array) -> Array:
    known = path[~np.isnan(path).any(axis=1)]
    return known[:: max(1, len(known) // _POINTS)]
