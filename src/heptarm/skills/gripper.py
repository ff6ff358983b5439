"""Grippers behind signals of the cabinet, and what every gripper offers to programs."""

from __future__ import annotations

from collections.abc import Mapping
from inspect import getattr_static
from math import inf
from typing import Protocol

from heptarm.arm.verbs import ArmVerbs
from heptarm.errors import CommandRejected, ShapeError, Timeout
from heptarm.values.checks import shown, within
from heptarm.values.io import SignalValues, find_signal
from heptarm.values.sealed import Sealed

#: Default of the longest time for opening or closing [s].
PATIENCE = 2.0
#: Default of the time for which neither end switch may be on before the gripper counts as closed on something [s].
SETTLE = 0.5
#: The robot's clock decides; this bounds the wait in case that clock has stopped: a factor, and added to it [s].
_GENEROUS, _AND_MORE = 3.0, 15.0


class Gripper(Protocol):
    """What skills and programs need of a gripper; your own class may be one."""

    def open(self) -> None:
        """Open it, and wait until it is open."""

    def close(self) -> None:
        """Close it, and wait until it is closed or holds something."""

    @property
    def is_open(self) -> bool:
        """Whether it is open."""

    @property
    def holds_something(self) -> bool:
        """Whether something is between its closed fingers."""


def check_gripper(gripper: Gripper) -> None:
    """Refuse what is no gripper, before anything moves.

    Raises:
        ShapeError: it lacks what `Gripper` names.
    """
    needed = ("open", "close", "is_open", "holds_something")
    missing = [name for name in needed if getattr_static(gripper, name, None) is None]
    if missing:
        raise ShapeError(
            f"gripper must have {', '.join(missing)}, got {shown(gripper)}",
            parameter="gripper",
            value=gripper,
            hint='for example heptarm.TwoSignalGripper(arm, open="OutputX3Pin1", close="OutputX3Pin2")',
        )


def _wired(arm: ArmVerbs, role: str, name: str, others: Mapping[str, str]) -> str:
    """The full name of a signal of a gripper, checked.

    Args:
        arm: whose signals.
        role: "open" and "close" are outputs, others inputs.
        name: as in `arm.io`.
        others: full names of the signals that are known already, by their roles.

    Raises:
        CommandRejected: there is no such signal, it is of another kind, or has another role.
    """
    known = tuple(arm.io.signals.values())
    signal = find_signal(name, known)
    needs_output = role in ("open", "close")
    wanted = "output" if needs_output else "input"
    if signal.is_output != needs_output or signal.kind != "boolean":
        fitting = [
            signal.name for signal in known if signal.is_output == needs_output and signal.kind == "boolean"
        ]
        is_kind = "output" if signal.is_output else "input"
        raise CommandRejected(
            f"{role} must be a boolean {wanted}, got {signal.name}, a signal of kind {signal.kind}, {is_kind}",
            parameter=role,
            value=name,
            allowed=", ".join(fitting),
            hint=f"boolean {wanted}s of this cabinet are {', '.join(fitting) or 'none'}",
        )
    for other, taken in others.items():
        if taken == signal.name:
            raise CommandRejected(
                f"{role} must be another signal than {other}, got {signal.name} for both",
                parameter=role,
                value=name,
                hint="each signal of a gripper has one meaning",
            )
    return signal.name


class TwoSignalGripper(Sealed):
    """A gripper that one output opens and another one closes, confirmed by two end switches.

    The switch of the closed end is on when the gripper is closed with nothing between its fingers. Where they hold
    something, neither switch is on; the gripper counts as closed when that has been so for `settle`. Closing takes so
    much longer then, and `settle` must be longer than the whole stroke. A cabinet that reports a gripped part by an
    input of its own needs no such wait: name it as `holds`.

    Args:
        arm: in control.
        open: output that opens it, by a name as in `arm.io`.
        close: output that closes it.
        is_open: input of the switch at the open end.
        is_closed: input of the switch at the closed end.
        holds: input that is on while it holds something; None: there is none.
        timeout: longest time for opening or closing [s], of the robot's clock.
        settle: see above [s].

    Raises:
        CommandRejected: no signal, or more than one, has such a name; or it is of another kind, or is named twice.
        LimitError: a time outside its range.
    """

    def __init__(
        self,
        arm: ArmVerbs,
        *,
        open: str,
        close: str,
        is_open: str,
        is_closed: str,
        holds: str | None = None,
        timeout: float = PATIENCE,
        settle: float = SETTLE,
    ) -> None:
        self._arm = arm
        found: dict[str, str] = {}
        named = [("open", open), ("close", close), ("is_open", is_open), ("is_closed", is_closed)]
        for role, name in named if holds is None else [*named, ("holds", holds)]:
            found[role] = _wired(arm, role, name, found)
        self._open, self._close = found["open"], found["close"]
        self._is_open, self._is_closed = found["is_open"], found["is_closed"]
        self._holds = found.get("holds")
        self._timeout = within(timeout, "timeout", 0.0, 600.0, above=True, unit="s")
        self._settle = within(settle, "settle", 0.0, self._timeout, unit="s")

    def __repr__(self) -> str:
        """Short form: its signals."""
        switches = ", ".join(filter(None, (self._is_open, self._is_closed, self._holds)))
        return f"<TwoSignalGripper {self._open}, {self._close}; {switches}>"

    @property
    def is_open(self) -> bool:
        """Whether the switch of the open end is on."""
        return bool(self._arm.io[self._is_open])

    @property
    def is_closed(self) -> bool:
        """Whether the switch of the closed end is on: nothing is between the fingers."""
        return bool(self._arm.io[self._is_closed])

    @property
    def holds_something(self) -> bool:
        """Whether it was closed on something: it is commanded to close, and neither end switch is on.

        Without an input of its own this is also so while it closes, until `close` returns.
        """
        return self._holding(self._arm.io.values_now)

    def open(self) -> None:
        """Open it, and wait until its switch confirms that.

        Raises:
            Timeout: the switch is not on in time.
        """
        self._command(opens=True)

    def close(self) -> None:
        """Close it, and wait until it is closed or holds something; `holds_something` is the difference.

        Raises:
            Timeout: neither is so in time, such as when the gripper has no air and stays open.
        """
        self._command(opens=False)

    def _holding(self, values: SignalValues) -> bool:
        if self._holds is not None:
            return bool(values[self._holds])
        between = not values[self._is_open] and not values[self._is_closed]
        return between and bool(values[self._close]) and not values[self._open]

    def _command(self, *, opens: bool) -> None:
        """Set both outputs, and wait for the inputs in the pushed states; all times are the robot's."""
        before = self._arm.io.values_now.stamp  # subscribes to the signals, too
        self._arm.io.set({self._open: opens, self._close: not opens})
        began = free_since = inf

        def is_done(values: SignalValues) -> bool:
            nonlocal began, free_since
            now = values.stamp * 1e-9
            if values.stamp <= before or bool(values[self._open]) != opens:
                return False
            began = min(began, now)
            if opens:
                return bool(values[self._is_open])
            if values[self._is_closed] or (self._holds is not None and values[self._holds]):
                return True
            free_since = inf if values[self._is_open] else min(free_since, now)
            return self._holds is None and now - free_since >= self._settle

        def has_ended(values: SignalValues) -> bool:
            return is_done(values) or values.stamp * 1e-9 - began > self._timeout

        last = self._arm.wait_until(
            lambda state: state.groups.io is not None and has_ended(state.groups.io),
            timeout=_GENEROUS * self._timeout / min(self._arm.real_time_factor, 1.0) + _AND_MORE,
        ).groups.io
        assert last is not None
        if not is_done(last):
            switch = self._is_open if opens else self._is_closed
            raise Timeout(
                f"the gripper did not {'open' if opens else 'close'} within {self._timeout:g} s: "
                f"the switch {switch} is {'on' if last[switch] else 'off'}",
                hint="check its air or power and the wiring of its switches, or give a longer timeout",
            )
