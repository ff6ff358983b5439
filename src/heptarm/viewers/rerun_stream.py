"""What rerun gets of one arm: its shapes once, transforms of its joints, signals, contact, events.

Entities, below the name of the arm: `base/link_0/…/link_7` (the chain of links with their shapes), `base/tcp` (the
motion frame), `base/force` (the external force at it), `base/trail` (where it was), `q`, `dq`, `tau_ext`, … (signals
as scalars), `fri/q`, … (FRI cycles at their own rate) and `events`. All times are on the time line "time": of a state
the moment of its sampling, of an FRI cycle its receipt, on this computer's clock.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from heptarm.errors import require
from heptarm.record.journal import REFUSAL, REQUEST, JournalEntry
from heptarm.record.layout import cycle_rows
from heptarm.record.mcap_file import SHOWN_REQUESTS, sampling_times
from heptarm.record.samples import StateSample, labels, signals_of, state_rows
from heptarm.sim.plant.appearance import ArmMeshes
from heptarm.sim.plant.shapes import drawn_shapes
from heptarm.sim.plant.world import compiled
from heptarm.values.checks import Array

TIMELINE = "time"
#: Signals of states and of FRI cycles that are drawn over time.
STATE_SIGNALS = (*("q", "dq", "tau", "tau_ext", "force", "torque"), "override")
CYCLE_SIGNALS = ("q", "q_sent", "tau", "tau_ext", "tau_sent", "latency")
#: Units of the plots by the name of the signal.
UNITS = {
    "q": "rad",
    "dq": "rad/s",
    "tau": "Nm",
    "tau_ext": "Nm",
    "force": "N",
    "torque": "Nm",
    "latency": "ns",
}
_RED_GREEN_BLUE = ((230, 60, 60), (60, 190, 80), (70, 110, 240))
_ORANGE, _BLUE = (255, 107, 10), (64, 160, 255)
#: Length of the arrow of a contact [m/N], of the axes of the motion frame [m].
_ARROW_SCALE, _AXIS = 0.01, 0.1
#: Distance between two places of the trail [m], and the most of them.
_STEP, _MOST_PLACES = 0.002, 500
#: Levels of events in rerun.
_LEVELS = {"info": "INFO", "warning": "WARN", "error": "ERROR"}


class JointChain:
    """The links of an arm as rerun has them: each below the one before, turned about its joint.

    Args:
        model: of the arm, such as "iiwa14".
        root: entity of the base.
    """

    def __init__(self, model: str, root: str) -> None:
        self._model = compiled(model, meshes=ArmMeshes())
        self._paths = {0: root}
        self._joints: list[tuple[str, int, int]] = []
        for body in range(1, self._model.nbody):
            parent = int(self._model.body_parentid[body])
            self._paths[body] = f"{self._paths[parent]}/{self._model.body(body).name}"
            if self._model.body_jntnum[body]:
                self._joints.append((self._paths[body], body, int(self._model.body_jntadr[body])))

    def log(self, recording: Any) -> None:
        """Log the shapes and the links that do not turn, once."""
        rerun, model = require("rerun", extra="rerun"), self._model
        turning = {body for _, body, _ in self._joints}
        for body, path in self._paths.items():
            if body and body not in turning:
                x, y, z, w = _xyzw(model.body_quat[body])
                still = rerun.Transform3D(translation=model.body_pos[body], quaternion=(x, y, z, w))
                recording.log(path, still, static=True)
        for shape in drawn_shapes(model):
            turn = np.zeros(9)
            mujoco.mju_quat2Mat(turn, model.geom_quat[shape.index])
            vertices = shape.vertices @ turn.reshape(3, 3).T + model.geom_pos[shape.index]
            mesh = rerun.Mesh3D(
                vertex_positions=vertices,
                triangle_indices=shape.faces,
                vertex_normals=_normals(vertices, shape.faces),
                albedo_factor=(*shape.colour, 255),
            )
            recording.log(f"{self._paths[shape.body]}/shape_{shape.index}", mesh, static=True)

    def transforms(self, q: Array) -> list[tuple[str, Array, Array]]:
        """Path, translation [m] and quaternion x y z w of each joint's link in the one before.

        Args:
            q: joint positions, shape (n, 7) [rad].

        Returns:
            For each joint: its entity, shape (3,), shape (n, 4).
        """
        model, found = self._model, []
        for number, (path, body, joint) in enumerate(self._joints):
            half = 0.5 * q[:, number, None]
            turn = np.hstack([np.cos(half), np.sin(half) * model.jnt_axis[joint]])
            found.append((path, model.body_pos[body], _product(model.body_quat[body], turn)))
        return found


def _xyzw(quat: Array) -> Array:
    return quat[[1, 2, 3, 0]]


def _product(left: Array, right: Array) -> Array:
    """Quaternion left * right, w x y z of shape (4,) and (n, 4), as x y z w of shape (n, 4)."""
    w, v = left[0], left[1:]
    s, u = right[:, :1], right[:, 1:]
    return np.hstack([w * u + s * v + np.cross(v, u), w * s - u @ v[:, None]])


def _normals(vertices: Array, faces: npt.NDArray[np.int64]) -> Array:
    """Normals of the vertices: of their faces, weighted by area."""
    corners = vertices[faces]
    of_faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    summed = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(summed, faces[:, corner], of_faces)
    sizes = np.linalg.norm(summed, axis=1, keepdims=True)
    return summed / np.where(sizes > 0.0, sizes, 1.0)


class RerunStream:
    """Sends what one arm reports to a recording stream of rerun; a sink of the recorder.

    Args:
        recording: rerun's recording stream; `flush` and `finish` are for all arms in it.
        model: of the arm, such as "iiwa14".
        name: entity that everything is below.
        place: of the base in the scene, x y z [m].
        epoch: nanoseconds since 1970 at our clock's zero; None: times are from the beginning of a recording.
    """

    def __init__(
        self,
        recording: Any,
        model: str,
        *,
        name: str,
        place: Sequence[float] = (0.0, 0.0, 0.0),
        epoch: int | None,
    ) -> None:
        self._rerun = require("rerun", extra="rerun")
        self._recording, self._name = recording, name
        self._epoch, self._is_dated = epoch or 0, epoch is not None
        self._chain = JointChain(model, f"{name}/base")
        self._trail: deque[Array] = deque(maxlen=_MOST_PLACES)
        self._named: set[str] = set()
        recording.log(f"{name}/base", self._rerun.Transform3D(translation=place), static=True)
        self._chain.log(recording)
        axes = self._rerun.Arrows3D(vectors=np.eye(3) * _AXIS, colors=_RED_GREEN_BLUE)
        recording.log(f"{name}/base/tcp", axes, static=True)

    # --------------------------------------------------------------------------------- a sink of the recorder

    def states(
        self, samples: Sequence[StateSample], *, to_ours: Callable[[int], int], signals: Sequence[str] = ()
    ) -> None:
        """Send pushed states: transforms, scalars, contact and trail."""
        rows = state_rows([sample.body for sample in samples])
        self.signals(sampling_times(rows["stamp"], to_ours) + self._epoch, signals_of(rows))

    def signals(self, times: npt.NDArray[np.int64], found: Mapping[str, npt.NDArray[Any]]) -> None:
        """Send the signals of states by their names; times of the time line, shape (n,) [ns]."""
        if "q" in found:
            self._send_chain(times, found["q"])
        if all(name in found for name in ("xyz", "quat", "force")):
            self._send_tcp(times, found["xyz"], found["quat"], found["force"])
        for name in STATE_SIGNALS:
            if name in found:
                self._send_scalars(name, name, times, found[name])

    def numbers(self, path: str, times: npt.NDArray[np.int64], values: Array) -> None:
        """Send numbers of a stream as scalars, shape (n, m)."""
        self._send_scalars(path, path.rpartition("/")[2], times, values)

    def pictures(self, path: str, times: npt.NDArray[np.int64], files: Sequence[bytes]) -> None:
        """Send pictures, each the bytes of a JPEG file."""
        columns = self._rerun.EncodedImage.columns(blob=files, media_type=["image/jpeg"] * len(files))
        self._send(path, times, columns)

    def text(self, path: str, times: npt.NDArray[np.int64], texts: Sequence[str]) -> None:
        """Send lines of text."""
        self._send(path, times, self._rerun.TextLog.columns(text=texts))

    def cycles(self, words: npt.NDArray[np.float64]) -> None:
        """Send FRI cycles, shape (n, 122), as scalars."""
        rows = cycle_rows(words)
        times = rows["received"] + self._epoch
        for name in CYCLE_SIGNALS:
            self._send_scalars(f"fri/{name}", name, times, np.asarray(rows[name], float))

    def entry(self, entry: JournalEntry) -> None:
        """Send what happened as text."""
        if entry.kind == REQUEST and not isinstance(entry.content, SHOWN_REQUESTS):
            return
        source = "cabinet" if entry.kind in ("event", REFUSAL) else entry.kind
        columns = self._rerun.TextLog.columns(
            text=[f"{source}: {entry.text}"], level=[_LEVELS.get(entry.level, "INFO")]
        )
        self._send("events", np.array([entry.time + self._epoch]), columns)

    def flush(self) -> None:
        """Nothing: rerun's own thread sends what was logged within some milliseconds."""

    def finish(self, facts: Mapping[str, str]) -> None:
        """Send the rest, and end the stream."""
        self._recording.flush()
        self._recording.disconnect()

    def abandon(self) -> None:
        """End the stream."""
        self._recording.disconnect()

    # ------------------------------------------------------------------------------------------------- parts

    def _send(self, path: str, times: npt.NDArray[np.int64], columns: Any) -> None:
        time.sleep(0.0)  # the thread that receives states is not held up by the interpreter's lock
        at = self._rerun.TimeColumn(TIMELINE, **self._moment(times))
        self._recording.send_columns(f"{self._name}/{path}" if path else self._name, [at], columns)

    def _moment(self, times: Any) -> dict[str, Any]:
        """Times in [ns] as rerun takes them."""
        if self._is_dated:
            return {"timestamp": times.astype("datetime64[ns]")}
        return {"duration": times.astype("timedelta64[ns]")}

    def _send_chain(self, times: npt.NDArray[np.int64], q: Array) -> None:
        known = ~np.isnan(q).any(axis=1)
        if not known.any():
            return
        prefix = len(self._name) + 1
        for path, place, turns in self._chain.transforms(q[known]):
            places = np.tile(place, (len(turns), 1))
            columns = self._rerun.Transform3D.columns(translation=places, quaternion=turns)
            self._send(path[prefix:], times[known], columns)

    def _send_tcp(self, times: npt.NDArray[np.int64], xyz: Array, quat: Array, force: Array) -> None:
        known = ~np.isnan(xyz).any(axis=1)
        if not known.any():
            return
        times, xyz = times[known], xyz[known]
        columns = self._rerun.Transform3D.columns(translation=xyz, quaternion=quat[known])
        self._send("base/tcp", times, columns)
        felt = np.nan_to_num(force[known]) * _ARROW_SCALE
        columns = self._rerun.Arrows3D.columns(origins=xyz, vectors=felt, colors=[_ORANGE] * len(xyz))
        self._send("base/force", times, columns)
        before = len(self._trail)
        for place in xyz:
            if not self._trail or float(np.linalg.norm(place - self._trail[-1])) > _STEP:
                self._trail.append(place)
        if len(self._trail) > max(1, before) or before == _MOST_PLACES:
            line = self._rerun.LineStrips3D([np.array(self._trail)], colors=_BLUE)
            self._recording.set_time(TIMELINE, **self._moment(times[-1]))
            self._recording.log(f"{self._name}/base/trail", line)

    def _send_scalars(self, path: str, name: str, times: npt.NDArray[np.int64], values: Array) -> None:
        if np.isnan(values).all():
            return
        size = 1 if values.ndim == 1 else values.shape[1]
        if path not in self._named:
            self._named.add(path)
            texts = [name] if size == 1 else [f"{name} {label}" for label in labels(name, size)]
            self._recording.log(f"{self._name}/{path}", self._rerun.SeriesLines(names=texts), static=True)
        self._send(path, times, self._rerun.Scalars.columns(scalars=values))
