"""Why an FRI session does not stand, or not well: the likely cause and the remedy, from what the client has seen."""

from __future__ import annotations

from collections.abc import Mapping

from heptarm.fri.messages import Quality, SessionState
from heptarm.rt import Client, Stats

#: A smaller share of lost messages or answers is nobody's cause for concern.
_SHARE = 0.01
#: Answers that have to be there before anything is said of them.
_ENOUGH = 20


def advice(client: Client, *, host: str) -> str:
    """The likely cause with its remedy, in one line; empty if nothing is wrong.

    Args:
        client: the client, open or closed.
        host: the address to which the cabinet sends.
    """
    stats = client.stats
    if not client.is_running:
        return "the loop's process has ended: was it killed, or is there too little memory?"
    if not stats.received:
        return strangers(client) if stats.malformed else silence(host, client.port)
    if client.trouble:
        return client.trouble
    state = client.state
    if state.quality >= Quality.GOOD and state.session is not SessionState.IDLE:
        return ""
    return cause(stats, state.period, client.refused)


def silence(host: str, port: int) -> str:
    """What to do when nothing arrives.

    Args:
        host: the address to which the cabinet sends; empty if it is not known.
        port: on which the client listens.
    """
    return (
        f"no FRI message arrived on UDP port {port}; look in this order: is the cabinet's FRI application started, and "
        f"does it send to {host or 'an address of this machine'}, port {port} (KUKA's examples send to 127.0.0.1)? "
        "Does `ping` reach the cabinet, with one netmask on both sides, on the network card that FRI uses there (KONI "
        f"or X66)? Does the firewall here let UDP in (`sudo ufw allow {port}/udp`)?"
    )


def strangers(client: Client) -> str:
    """What to do when datagrams arrive, and none of them is a message that this client understands."""
    trouble = client.trouble
    if "version" in trouble:
        return trouble
    return (
        f"{client.stats.malformed} datagrams arrived on UDP port {client.port}, and none was an FRI message: "
        "something else sends there; choose another port"
    )


def cause(stats: Stats, period: float, refused: list[str], *, late: float | None = None) -> str:
    """What spoils the quality most, with the remedy; empty if nothing does.

    Args:
        stats: of the client.
        period: send period [s].
        refused: what the system has refused the client.
        late: latency that 99 % of the answers stay below [s]; None: of all answers since the client began.
    """
    expected = stats.received + stats.lost
    late = stats.latency[1] if late is None else late
    if stats.malformed > _SHARE * expected:
        return (
            f"{stats.malformed} datagrams were no FRI messages: does something else send to this port, "
            "or is a cable broken?"
        )
    if late > 0.5 * period and stats.answered > _ENOUGH:
        remedy = f"; {refused[0]}" if refused else "; look for load on this machine"
        return f"this machine answers late, 1 % after more than {late * 1e3:.2f} ms of {period * 1e3:g} ms{remedy}"
    if stats.lost > _SHARE * expected:
        return (
            f"{stats.lost} of {expected} messages of the cabinet were lost on their way: use a cable and a direct "
            "connection, no switch that is busy and no wireless network"
        )
    if stats.missed > _SHARE * max(stats.answered, 1):
        return (
            f"{stats.missed} of {stats.answered} answers left this machine in time and did not reach the cabinet in "
            "time: look at the network between them, or choose a longer period"
        )
    if stats.answered > _ENOUGH and not (stats.quality["good"] or stats.quality["excellent"]):
        return "answers leave this machine and do not count: does a firewall let UDP out, to the cabinet's own port?"
    return ""


def summary(client: Client, *, before: Mapping[str, int]) -> list[str]:
    """How it went so far, in some lines for a person.

    Args:
        client: the client, open or closed.
        before: messages by their quality that do not count, since the quality had to be earned first.
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
    lines += [f"limited   {line}" for line in client.limited]
    return lines + [f"refused   {line}" for line in client.refused]


def _micros(numbers: tuple[float, ...]) -> str:
    median, late, later, longest = (1e6 * number for number in numbers)
    return f"{median:.0f} us median, {late:.0f} us 99 %, {later:.0f} us 99.9 %, {longest:.0f} us longest"
