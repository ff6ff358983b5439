"""Diagnosis of an FRI session that does not open, runs badly or has ended: the likely cause and the remedy."""

from __future__ import annotations

from collections.abc import Mapping

from heptarm.errors import HeptarmError, MotionAborted, QualityLost, StreamError
from heptarm.fri.loop.client import Client
from heptarm.fri.loop.user_api import Stats
from heptarm.fri.protocol.messages import Quality, SessionState
from heptarm.values.result import Cause
from heptarm.wire import messages as wire

#: A smaller fraction of lost messages or answers is harmless.
_HARMLESS = 0.01
#: Smallest number of answers that is judged.
_ENOUGH = 20


def advice(client: Client, *, host: str) -> str:
    """The likely cause with its remedy in one line; empty if nothing is wrong.

    Args:
        client: the client, open or closed.
        host: address to which the cabinet sends.
    """
    stats = client.stats
    if not client.is_running:
        return f"the FRI loop has ended: {client.trouble}"
    if not stats.received:
        return strangers(client) if stats.malformed else silence(host, client.port)
    if client.trouble:
        return client.trouble
    state = client.state
    if state.quality >= Quality.GOOD and state.session is not SessionState.IDLE:
        return ""
    return cause(stats, state.period, client.refused)


def silence(host: str, port: int) -> str:
    """What to do when no message arrives.

    Args:
        host: address to which the cabinet sends; empty: not known.
        port: UDP port on which the client listens.
    """
    return (
        f"no FRI message arrived on UDP port {port}; check in this order: is the cabinet's FRI application started, "
        f"and does it send to {host or 'an address of this machine'}, port {port} (KUKA's examples send to 127.0.0.1)? "
        "Does `ping` reach the cabinet, with one netmask on both sides, on the network card that FRI uses there (KONI "
        f"or X66)? Does the firewall here let UDP in (`sudo ufw allow {port}/udp`)?"
    )


def strangers(client: Client) -> str:
    """What to do when datagrams arrive, but no FRI messages that this client understands."""
    trouble = client.trouble
    if "version" in trouble:
        return trouble
    return (
        f"{client.stats.malformed} datagrams arrived on UDP port {client.port}, and none was an FRI message: "
        "another program sends to it; choose another port"
    )


def cause(stats: Stats, period: float, refused: list[str], *, late: float | None = None) -> str:
    """The main cause of a bad quality, with the remedy; empty if there is none.

    Args:
        stats: statistics of the client.
        period: send period [s].
        refused: what the operating system refused the client.
        late: 99th percentile of the latency [s]; None: that of all answers.
    """
    expected = stats.received + stats.lost
    late = stats.latency[1] if late is None else late
    if stats.malformed > _HARMLESS * expected:
        return (
            f"{stats.malformed} datagrams were no FRI messages: check whether another program sends to this port, "
            "and the cable"
        )
    if late > 0.5 * period and stats.answered > _ENOUGH:
        remedy = f"; {refused[0]}" if refused else "; check the load of this machine"
        return f"this machine answers late, 1 % after more than {late * 1e3:.2f} ms of {period * 1e3:g} ms{remedy}"
    if stats.lost > _HARMLESS * expected:
        return (
            f"{stats.lost} of {expected} messages of the cabinet were lost on the network: use a cable and a direct "
            "connection, no busy switch and no wireless network"
        )
    if stats.missed > _HARMLESS * max(stats.answered, 1):
        return (
            f"{stats.missed} of {stats.answered} answers left this machine in time and did not reach the cabinet in "
            "time: check the network between them, or choose a longer period"
        )
    if stats.answered > _ENOUGH and not (stats.quality["good"] or stats.quality["excellent"]):
        return "answers leave this machine, but the cabinet does not count them: check whether a firewall lets UDP out"
    return ""


def summary(client: Client, *, before: Mapping[str, int]) -> list[str]:
    """Summary of a session in a few lines.

    Args:
        client: the client, open or closed.
        before: messages by quality before the start, which do not count.
    """
    stats = client.stats
    counts = {name: count - before.get(name, 0) for name, count in stats.quality.items()}
    total = max(1, sum(counts.values()))
    lines = [
        f"messages  {stats.received} received, {stats.lost} lost, {stats.malformed} malformed",
        f"answers   {stats.answered} sent, {stats.missed} missed by the cabinet, {stats.commanded} effective",
        "quality   " + ", ".join(f"{100 * count / total:.1f} % {name}" for name, count in counts.items()),
        f"latency   {_micros(stats.latency)}",
        f"jitter    {_micros(stats.jitter)}",
    ]
    if stats.filled:
        lines.append(f"policy    {stats.filled} answers without a fresh command")
    if stats.stale:
        lines.append(
            f"stale     {stats.stale} commands older than the session, not executed: the arm was held"
        )
    lines += [f"limited   {line}" for line in client.limited]
    return lines + [f"refused   {line}" for line in client.refused]


def _micros(numbers: tuple[float, ...]) -> str:
    median, late, later, longest = (1e6 * number for number in numbers)
    return f"{median:.0f} us median, {late:.0f} us 99 %, {later:.0f} us 99.9 %, {longest:.0f} us longest"


def no_report(session: int) -> wire.FriChanged:
    """Stand-in for the last report on a session on which the cabinet sent none."""
    return wire.FriChanged(
        session=session,
        state=wire.FriSessionState.IDLE,
        quality=wire.FriQuality.EXCELLENT,
        code=0,
        text="",
    )


def end_text(*, in_control: bool) -> str:
    """The reason where the cabinet gives none; `in_control`: this client still controls the robot."""
    if in_control:
        return "the FRI session was ended by the cabinet"
    return "the cabinet ended the FRI session, since this client no longer controls the robot"


def early_end(
    error: MotionAborted | None, report: wire.FriChanged, *, hint: str, in_control: bool, limited: list[str]
) -> HeptarmError:
    """The error of a session that ended early.

    Args:
        error: how the motion under an overlay ended; None for a monitoring session.
        report: the cabinet's last report on the session.
        hint: the likely cause, as far as this side knows it.
        in_control: this client still controls the robot.
        limited: what the guard limited, in words.
    """
    text, code = (report.text, report.code) if error is None else (error.text, error.code)
    if report.quality.value < Quality.GOOD and (error is None or error.cause is Cause.FAILED):
        return QualityLost(text or end_text(in_control=in_control), code=code, hint=hint)
    if error is None:
        return StreamError(text or end_text(in_control=in_control), code=code, hint=hint)
    guard = f"the guard had limited: {'; '.join(limited[:3])}" if limited else ""
    return MotionAborted(
        text, result=error.result, history=error.history, code=code, hint=guard or error.hint
    )
