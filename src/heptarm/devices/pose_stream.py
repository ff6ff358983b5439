"""Poses from a phone, a VR controller or another program: a small datagram of JSON for each, over UDP.

A datagram is one object: `{"position": [x, y, z], "quaternion": [x, y, z, w], "buttons": ["clutch"], "t": 12.3}`, with
metres, a unit quaternion, the names of the buttons that are held, and the sender's time in seconds, which may be left
out. Any fixed axes will do: only movements count. The newest datagram wins; one that is older by its time is left out;
and when none comes for a while, no button is held.
"""

from __future__ import annotations

import json
import math
import socket
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Final, Protocol

from heptarm.devices.device import Roles
from heptarm.errors import NotReady
from heptarm.io.clock import Clock, RealClock
from heptarm.values.checks import Value, instance, integer, within
from heptarm.values.pose import Pose
from heptarm.values.sealed import Sealed

#: Default UDP port; 0 chooses a free one.
PORT = 30310
#: Default of the silence after which no button counts as held [s].
SILENCE = 0.2
#: Largest datagram [bytes], datagrams that one reading handles, buttons, and farthest place from the origin [m].
_LARGEST, _MOST, _BUTTONS, _FARTHEST = 4096, 1000, 32, 1e3
#: Largest deviation of a quaternion's norm from 1.
_NORM = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class PoseInput(Value):
    """What a device that knows its pose reports.

    Attributes:
        pose: of the device in fixed axes of its own; None: not known yet.
        buttons: names of the buttons that are held.
    """

    pose: Pose | None = None
    buttons: frozenset[str] = frozenset()


class PoseDevice(Protocol):
    """A device that knows its pose; your own class may be one."""

    @property
    def name(self) -> str:
        """For people."""

    @property
    def roles(self) -> Roles:
        """What its buttons are for; the dead-man button is the clutch: the arm follows while it is held."""

    def read(self) -> PoseInput:
        """What it reports now; does not wait."""

    def close(self) -> None:
        """Release it; calling it again has no effect."""


class PoseStream(Sealed):
    """Receives poses by UDP; made by `pose_stream`.

    Args:
        port: UDP port; 0: any free one.
        host: address of this machine at which it listens.
        silence: time without a datagram after which no button counts as held [s].
        clock: its time.

    Attributes:
        port: the port.
        refused: datagrams that were no poses so far.
        error: why the last one was none.
    """

    name = "pose stream"
    roles: Roles
    port: Final[int]

    def __init__(self, port: int, *, host: str, silence: float, clock: Clock | None = None) -> None:
        self.roles = Roles(dead_man="clutch", gripper="gripper", quit="quit")
        self._clock = RealClock() if clock is None else clock
        self._silence = round(within(silence, "silence", 0.01, 10.0, unit="s") * 1e9)
        self._seen = PoseInput()
        self._at, self._sent = 0, -math.inf
        self._refused, self._error = 0, ""
        self._socket: socket.socket | None = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setblocking(False)
            self._socket.bind((host, port))
        except OSError as error:
            self._socket.close()
            raise NotReady(
                f"poses cannot be received at {host}:{port}: {error.strerror or error}",
                hint="choose another port, or an address of this machine",
            ) from error
        self.port = int(self._socket.getsockname()[1])

    @property
    def refused(self) -> int:
        """Datagrams that were no poses so far."""
        return self._refused

    @property
    def error(self) -> str:
        """Why the last one was none; empty: all were."""
        return self._error

    def read(self) -> PoseInput:
        """The newest pose, and the buttons that are held."""
        now = self._clock.nanos()
        for _ in range(_MOST):
            if self._socket is None:
                return PoseInput()
            try:
                data = self._socket.recv(_LARGEST + 1)
            except OSError:  # nothing more has come
                break
            self._take(data, now)
        if now - self._at > self._silence:
            return PoseInput(self._seen.pose)
        return self._seen

    def _take(self, data: bytes, now: int) -> None:
        try:
            seen, sent = _decoded(data)
        except (ValueError, TypeError, KeyError, RecursionError) as error:
            self._refused += 1
            self._error = " ".join(str(error).split())[:200] or type(error).__name__
            return
        if (
            sent <= self._sent and now - self._at <= self._silence
        ):  # overtaken; a sender that began again is not
            return
        self._seen, self._at, self._sent = seen, now, sent if math.isfinite(sent) else -math.inf

    def close(self) -> None:
        """Stop listening; calling it again has no effect."""
        opened, self._socket = self._socket, None
        if opened is not None:
            opened.close()

    def __enter__(self) -> PoseStream:
        """The stream itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Stop listening."""
        self.close()


def _decoded(data: bytes) -> tuple[PoseInput, float]:
    """Pose and buttons of a datagram, and the sender's time; infinite: it has none.

    Raises:
        ValueError: it is no such datagram.
    """
    if len(data) > _LARGEST:
        raise ValueError(f"a datagram must have at most {_LARGEST} bytes")
    content: Any = json.loads(data.decode("utf-8"))
    if not isinstance(content, dict):
        raise ValueError("a datagram must be an object of JSON")
    xyz, quat = _numbers(content["position"], 3, "position"), _numbers(content["quaternion"], 4, "quaternion")
    if max(map(abs, xyz)) > _FARTHEST:
        raise ValueError(f"position must be within {_FARTHEST:g} m, got {xyz}")
    norm = math.sqrt(sum(value * value for value in quat))
    if abs(norm - 1.0) > _NORM:
        raise ValueError(f"quaternion must have norm 1, got {norm:.4g}")
    buttons = content.get("buttons", [])
    if (
        not isinstance(buttons, list)
        or len(buttons) > _BUTTONS
        or not all(isinstance(b, str) for b in buttons)
    ):
        raise ValueError(f"buttons must be a list of up to {_BUTTONS} names")
    (sent,) = _numbers([content.get("t", 0.0)], 1, "t")
    pose = Pose.of(xyz, [value / norm for value in quat])
    return PoseInput(pose, frozenset(buttons)), sent if "t" in content else math.inf


def _numbers(values: object, count: int, name: str) -> list[float]:
    if (
        not isinstance(values, list)
        or len(values) != count
        or not all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in values)
    ):
        raise ValueError(f"{name} must have {count} numbers")
    found = [float(value) for value in values]
    if not all(map(math.isfinite, found)):
        raise ValueError(f"{name} must be finite")
    return found


def pose_stream(port: int = PORT, *, host: str = "127.0.0.1", silence: float = SILENCE) -> PoseStream:
    """Receive poses by UDP from a phone, a VR controller or another program; see the guide for the datagrams.

    It listens to this machine alone unless you say otherwise, since any client that reaches the port moves the arm. The
    buttons "clutch", "gripper" and "quit" have a role in `heptarm.skills.follow_poses`.

    Args:
        port: UDP port; 0: any free one.
        host: address of this machine at which it listens; "127.0.0.1": for programs on this machine only.
        silence: time without a datagram after which no button counts as held [s].

    Raises:
        NotReady: the port is taken, or the address is not of this machine.
    """
    return PoseStream(integer(port, "port", 0, 65535), host=instance(host, str, "host"), silence=silence)
