"""The FRI session of a node, opened and closed by services and commanded by topics."""

from __future__ import annotations

import logging
import threading
from typing import Any, Literal

from heptarm.arm.arm import Arm
from heptarm.arm.fri.session import Fri
from heptarm.errors import HeptarmError, ModeConflict, NotReady
from heptarm.fri import State as FriState
from heptarm.values.checks import Array
from heptarm.values.pose import Pose

_log = logging.getLogger("heptarm.ros")

#: Kinds of sessions.
Kind = Literal["position", "torque", "wrench", "pose", "monitor"]


class NodeFriSession:
    """Holds at most one FRI session at a time.

    Args:
        arm: in control, unless the session only monitors.
    """

    def __init__(self, arm: Arm) -> None:
        self._arm = arm
        self._lock = threading.RLock()
        self._session: Fri | None = None
        self._text = ""

    @property
    def active(self) -> bool:
        """Whether a session is open."""
        session = self._session
        return session is not None and session.active

    @property
    def newest(self) -> FriState | None:
        """The newest message of the open session; None: none is open."""
        session = self._session
        return session.state if session is not None and session.active else None

    def open(self, kind: Kind, **settings: Any) -> str:
        """Open a session; it holds the arm until the first command.

        Args:
            kind: see `Arm.fri`.
            **settings: see `Arm.fri`.

        Returns:
            What was opened.

        Raises:
            ModeConflict: another one is open.
            HeptarmError: refused, or not established; the text has the remedy.
        """
        with self._lock:
            if self.active:
                raise ModeConflict("another FRI session is open", hint="close it first")
            self.close()
            self._text = ""
            self._session = self._arm.fri(kind, **settings).__enter__()
            return f"{kind} session is open"

    def close(self) -> str:
        """Close the session; closing twice is legal.

        Returns:
            Why it ended before; empty: it did not.
        """
        with self._lock:
            session, self._session = self._session, None
            if session is not None:
                try:
                    session.close()
                    self._text = ""
                except HeptarmError as error:
                    self._text = str(error)
                    _log.warning("FRI session ended: %s", error)
            return self._text

    def command(
        self,
        *,
        q: Array | None = None,
        tau: Array | None = None,
        wrench: Array | None = None,
        pose: Pose | None = None,
    ) -> None:
        """Send a command, see `Fri.command`.

        Raises:
            NotReady: no session is open.
            ModeConflict: this session is of another kind.
        """
        self._open_session().command(q=q, tau=tau, wrench=wrench, pose=pose)

    def output(self, name: str, value: float) -> None:
        """Write an output that the session carries.

        Raises:
            NotReady: no session is open.
        """
        self._open_session().output(name, value)

    def _open_session(self) -> Fri:
        session = self._session
        if session is None or not session.active:
            raise NotReady(
                f"no FRI session is open{f': {self._text}' if self._text else ''}", hint="open one"
            )
        return session

    def status(self) -> dict[str, Any]:
        """Fields of heptarm_msgs/FriStatus; closes a session that has ended."""
        if not self._lock.acquire(blocking=False):
            return {"text": "an FRI session is opening or closing"}
        try:
            session = self._session
            if session is None:
                return {"text": self._text}
            if not session.active:
                return {"text": self.close()}
            stats, inputs = session.stats, session.inputs
            return {
                "kind": session.kind,
                "session": session.session.name,
                "quality": session.quality.name,
                "received": stats.received,
                "lost": stats.lost,
                "answered": stats.answered,
                "missed": stats.missed,
                "limited": stats.limited,
                "latency": stats.latency[0],
                "latency_longest": stats.latency[3],
                "input_names": list(inputs),
                "inputs": [float(value) for value in inputs.values()],
            }
        finally:
            self._lock.release()
