"""One FRI session of a node, opened and closed by services and commanded by topics; free of ROS."""

from __future__ import annotations

import logging
import threading
from typing import Any, Literal

from heptarm.arm.arm import Arm
from heptarm.arm.fri import Fri
from heptarm.errors import HeptarmError, ModeConflict, NotReady
from heptarm.values.arrays import Array
from heptarm.values.pose import Pose

_log = logging.getLogger("heptarm.bridge")

#: What may be asked for.
Kind = Literal["position", "torque", "wrench", "pose", "monitor"]


class FriSession:
    """At most one session at a time.

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
        """Whether a session stands."""
        session = self._session
        return session is not None and session.active

    def open(self, kind: Kind, **settings: Any) -> str:
        """Open a session; what is commanded is a hold until the first command comes.

        Args:
            kind: as of `Arm.fri`.
            **settings: likewise.

        Returns:
            What was opened, in words.

        Raises:
            ModeConflict: one is open.
            HeptarmError: refused, or no session came to stand; the text says what to do.
        """
        with self._lock:
            if self.active:
                raise ModeConflict("an FRI session is open", hint="close it first")
            self.close()
            self._text = ""
            self._session = self._arm.fri(kind, **settings).__enter__()
            return f"the session of kind {kind} stands"

    def close(self) -> str:
        """End it; why it ended earlier, in words. Closing twice is legal."""
        with self._lock:
            session, self._session = self._session, None
            if session is not None:
                try:
                    session.close()
                    self._text = ""
                except HeptarmError as error:
                    self._text = str(error)
                    _log.warning("the FRI session ended: %s", error)
            return self._text

    def command(
        self,
        *,
        q: Array | None = None,
        tau: Array | None = None,
        wrench: Array | None = None,
        pose: Pose | None = None,
    ) -> None:
        """Give a command, see `Fri.command`.

        Raises:
            NotReady: no session stands.
            ModeConflict: this session commands something else.
        """
        self._standing().command(q=q, tau=tau, wrench=wrench, pose=pose)

    def output(self, name: str, value: float) -> None:
        """Set an output that the session offers.

        Raises:
            NotReady: no session stands.
        """
        self._standing().output(name, value)

    def _standing(self) -> Fri:
        session = self._session
        if session is None or not session.active:
            raise NotReady(f"no FRI session stands{f': {self._text}' if self._text else ''}", hint="open one")
        return session

    def status(self) -> dict[str, Any]:
        """How it is, by the fields of heptarm_msgs/FriStatus; a session that has ended is closed."""
        if not self._lock.acquire(blocking=False):
            return {"text": "an FRI session is being opened or closed"}
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
