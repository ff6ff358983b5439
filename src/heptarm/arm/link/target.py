"""Targets: the text that names what to connect to."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from urllib.parse import parse_qsl, urlsplit

from heptarm.errors import CommandRejected, ConnectFailed
from heptarm.io.targets import SavedTarget, saved_target
from heptarm.values.checks import shown
from heptarm.values.robot import ROBOTS, Flange, flange
from heptarm.values.simulator_options import check_target_option
from heptarm.wire.messages import PORT

#: Environment variable that names the default target.
VARIABLE = "HEPTARM_TARGET"

#: Longest name of a host, and of a part of it (RFC 1035) [characters].
_LONGEST_HOST, _LONGEST_LABEL = 253, 63

_EXAMPLES = (
    'examples: "172.31.1.147" or "172.31.1.147:30001" (a cabinet), "sim://iiwa14" or "sim://iiwa7?speed=5" '
    '(a private simulator), "sim://localhost:30001" (a running `heptarm sim`)'
)


@dataclass(frozen=True, slots=True)
class Target:
    """What to connect to: a listening cabinet, or a private virtual cabinet to start.

    Attributes:
        host: name or address; empty for a private virtual cabinet.
        port: TCP port.
        model: robot of the private virtual cabinet; empty otherwise.
        options: (name, value) pairs of the private virtual cabinet.
        saved: the saved target that was named; None: an address was given.
    """

    host: str = ""
    port: int = PORT
    model: str = ""
    options: tuple[tuple[str, str], ...] = ()
    saved: SavedTarget | None = None

    @property
    def name(self) -> str:
        """Name of the saved target; empty: an address was given."""
        return "" if self.saved is None else self.saved.name

    @property
    def key_file(self) -> str | None:
        """File with the key of the saved target; None: it has none of its own."""
        return None if self.saved is None else self.saved.key_file or None

    @property
    def flange(self) -> Flange | None:
        """Media flange of the private virtual cabinet or of the saved target; None: neither names one."""
        named = dict(self.options).get("flange", "") or ("" if self.saved is None else self.saved.flange)
        return flange(named) if named else None

    def with_flange(self, given: str | float | None) -> Target:
        """The target with a media flange; None: as it is.

        Raises:
            CommandRejected: there is no such flange, or the target has another one.
        """
        named, mounted = None if given is None else flange(given), self.flange
        if named is not None and mounted is not None and named != mounted:
            raise CommandRejected(
                f'flange must be "{mounted.name}", which the target {self} has, got "{named.name}"',
                parameter="flange",
                value=given,
                hint="leave out one of them",
            )
        chosen = named or mounted
        if chosen is None or not self.is_private or "flange" in dict(self.options):
            return self
        return replace(self, options=(*self.options, ("flange", chosen.name)))

    @property
    def is_private(self) -> bool:
        """Whether a private virtual cabinet has to be started."""
        return bool(self.model)

    def __str__(self) -> str:
        """The target as text."""
        if self.is_private:
            query = "&".join(f"{name}={value}" for name, value in self.options)
            return f"sim://{self.model}{'?' + query if query else ''}"
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


def target_from_env() -> str:
    """Read the target from the environment variable HEPTARM_TARGET.

    Raises:
        ConnectFailed: it is not set.
    """
    value = os.environ.get(VARIABLE, "").strip()
    if not value:
        raise ConnectFailed(
            f"no target was given and {VARIABLE} is not set",
            hint=f'connect("sim://iiwa14"); on the command line --target sim://iiwa14; or set {VARIABLE}; {_EXAMPLES}',
        )
    return value


def parse_target(text: str) -> Target:
    """Parse a target.

    Args:
        text: "ADDRESS[:PORT]", "sim://MODEL[?OPTION=VALUE&...]", "sim://HOST:PORT", or the name of a saved target.

    Raises:
        ConnectFailed: it has none of these forms; the text shows examples.
        CommandRejected: the file of saved targets cannot be read.
    """
    saved = saved_target(text)
    return _parsed(text) if saved is None else replace(_parsed(saved.address), saved=saved)


def _parsed(text: str) -> Target:
    try:
        if not text.startswith("sim://"):
            return _address(text)
        parts = urlsplit(text)
        if parts.path.strip("/") or parts.fragment or "@" in parts.netloc:
            raise ValueError(f"{parts.path or parts.netloc!r} is not allowed in it")
        options = tuple(parse_qsl(parts.query, keep_blank_values=True, strict_parsing=bool(parts.query)))
        if parts.netloc in ROBOTS:
            for name, value in options:
                if b"\0" in os.fsencode(
                    value
                ):  # and UnicodeEncodeError, a ValueError, at half of a surrogate pair
                    raise ValueError(f"{name} has a NUL")
                check_target_option(name, value)
            return Target(model=parts.netloc, options=options)
        if options:
            raise ValueError("only a private simulator, such as sim://iiwa14, has options")
        if parts.port is None:  # "HOST:" as well
            raise ValueError(
                f"{parts.netloc!r} is neither a robot ({', '.join(ROBOTS)}) nor HOST:PORT with a port"
            )
        return _address(parts.netloc)
    except ValueError as error:
        raise ConnectFailed(
            f"target must be an address or a simulator, got {shown(text)}: {error}", hint=_EXAMPLES
        ) from None


def _address(text: str) -> Target:
    if "://" in text or "/" in text:
        raise ValueError("the only scheme is sim://")
    parts = urlsplit(f"//{text}")
    port = parts.port  # raises ValueError unless it is a number in range
    if not parts.hostname or any(character.isspace() or not character.isprintable() for character in text):
        raise ValueError("it has no host")
    if any(not 0 < len(label) <= _LONGEST_LABEL for label in parts.hostname.rstrip(".").split(".")) or (
        len(parts.hostname) > _LONGEST_HOST
    ):
        raise ValueError(f"a host has at most {_LONGEST_HOST} characters, {_LONGEST_LABEL} between two dots")
    if parts.username is not None or parts.query or port == 0:
        raise ValueError("an address is HOST or HOST:PORT with a port of 1 to 65535")
    return Target(host=parts.hostname, port=PORT if port is None else port)
