"""Targets: what to connect to, as text."""

from __future__ import annotations

import os
from dataclasses import dataclass
from urllib.parse import parse_qsl, urlsplit

from heptarm.errors import ConnectFailed
from heptarm.values.robot import ROBOTS
from heptarm.wire.messages import PORT

#: Environment variable that names the default target.
VARIABLE = "HEPTARM_TARGET"

#: Options of a private virtual cabinet besides its speed: a box around the arm; what hangs on the flange whatever the
#: controller is told; the project's RoboticsAPI.data.xml.
_OTHERS = ("box", "payload", "project", "fault")

_EXAMPLES = (
    'examples: "172.31.1.147" or "172.31.1.147:30001" (a cabinet), "sim://iiwa14" or "sim://iiwa7?speed=5" '
    '(a private simulator), "sim://localhost:30001" (a running `heptarm sim`)'
)


@dataclass(frozen=True, slots=True)
class Target:
    """What to connect to: a port that listens, or a private virtual cabinet to start.

    Attributes:
        host: name or address; empty for a private virtual cabinet.
        port: TCP port.
        model: robot of the private virtual cabinet; empty otherwise.
        options: further options of the private virtual cabinet, by name.
    """

    host: str = ""
    port: int = PORT
    model: str = ""
    options: tuple[tuple[str, str], ...] = ()

    @property
    def is_private(self) -> bool:
        """Whether a virtual cabinet has to be started."""
        return bool(self.model)

    def __str__(self) -> str:
        """The target as text."""
        if self.is_private:
            query = "&".join(f"{name}={value}" for name, value in self.options)
            return f"sim://{self.model}{'?' + query if query else ''}"
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


def target_from_env() -> str:
    """The target that the environment variable HEPTARM_TARGET names.

    Raises:
        ConnectFailed: it is not set.
    """
    value = os.environ.get(VARIABLE, "").strip()
    if not value:
        raise ConnectFailed(
            f"no target: none was given and {VARIABLE} is not set",
            hint=f'set it, as in {VARIABLE}=sim://iiwa14, or connect("sim://iiwa14"); {_EXAMPLES}',
        )
    return value


def parse_target(text: str) -> Target:
    """Read a target.

    Args:
        text: "ADDRESS[:PORT]", "sim://MODEL[?OPTION=VALUE&...]" or "sim://HOST:PORT".

    Raises:
        ConnectFailed: it is none of these; the text shows examples.
    """
    try:
        if not text.startswith("sim://"):
            return _address(text)
        parts = urlsplit(text)
        if parts.path.strip("/") or parts.fragment or "@" in parts.netloc:
            raise ValueError(f"{parts.path or parts.netloc!r} has no meaning in it")
        options = tuple(parse_qsl(parts.query, keep_blank_values=True, strict_parsing=bool(parts.query)))
        if parts.netloc in ROBOTS:
            _check(options)
            return Target(model=parts.netloc, options=options)
        if options:
            raise ValueError("options belong to a private simulator")
        if ":" not in parts.netloc:
            raise ValueError(f"{parts.netloc!r} is no robot ({', '.join(ROBOTS)}) and has no port")
        return _address(parts.netloc)
    except ValueError as error:
        raise ConnectFailed(f"{text!r} is no target: {error}", hint=_EXAMPLES) from None


def _address(text: str) -> Target:
    if "://" in text or "/" in text:
        raise ValueError("only sim:// is known")
    parts = urlsplit(f"//{text}")
    port = parts.port  # raises ValueError unless it is a number in range
    if not parts.hostname or any(character.isspace() for character in text):
        raise ValueError("it names no host")
    if parts.username is not None or parts.query or port == 0:
        raise ValueError("an address is HOST or HOST:PORT")
    return Target(host=parts.hostname, port=PORT if port is None else port)


def _check(options: tuple[tuple[str, str], ...]) -> None:
    for name, value in options:
        if name in _OTHERS:
            continue  # the cabinet looks at it
        if name != "speed":
            raise ValueError(f"there is no option {name!r}; there are speed, {', '.join(_OTHERS)}")
        try:
            good = 0.01 <= float(value) <= 100.0
        except ValueError:
            good = False
        if not good:
            raise ValueError(f"speed is {value}; allowed is [0.01, 100]")
