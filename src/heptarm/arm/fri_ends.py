"""What ended an FRI session early, in words: from what the cabinet told, and what this side knows."""

from __future__ import annotations

from heptarm.errors import HeptarmError, MotionAborted, QualityLost, StreamError
from heptarm.fri.messages import Quality
from heptarm.values.result import Cause
from heptarm.wire import messages as wire


def nothing_told(session: int) -> wire.FriChanged:
    """The last word on a session of which the cabinet has said nothing."""
    return wire.FriChanged(
        session=session,
        state=wire.FriSessionState.IDLE,
        quality=wire.FriQuality.EXCELLENT,
        code=0,
        text="",
    )


def ended(*, controls: bool) -> str:
    """What is known where the cabinet gives no reason; `controls`: this client still controls the robot."""
    if controls:
        return "the FRI session was ended by the cabinet"
    return "the cabinet ended the FRI session, since this client no longer controls the robot"


def explained(
    error: MotionAborted | None, told: wire.FriChanged, *, hint: str, controls: bool, limited: list[str]
) -> HeptarmError:
    """The error that tells it.

    Args:
        error: how the motion under an overlay ended; None for a session that only monitors.
        told: the cabinet's last word on the session.
        hint: the likely cause, as far as this side can tell.
        controls: this client still controls the robot.
        limited: what the guard has limited, in words.
    """
    text, code = (told.text, told.code) if error is None else (error.text, error.code)
    if told.quality.value < Quality.GOOD and (error is None or error.cause is Cause.FAILED):
        return QualityLost(text or ended(controls=controls), code=code, hint=hint)
    if error is None:
        return StreamError(text or ended(controls=controls), code=code, hint=hint)
    guard = f"the guard had limited: {'; '.join(limited[:3])}" if limited else ""
    return MotionAborted(
        text, result=error.result, history=error.history, code=code, hint=guard or error.hint
    )
