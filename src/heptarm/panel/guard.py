"""Who may open the panel: a browser that was given the URL with its token.

The panel listens on a port of this machine. Any web page that a browser on this machine shows could connect to it. The
guard looks at every request before viser does: its Host must be the panel's own (against DNS rebinding), its Origin too
if it has one (against other pages), and it must bring the token, in the URL or in the cookie that the first page sets.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import hmac
import http
import ipaddress
import secrets
import socket
import threading
from collections.abc import Callable, Iterator, Mapping
from http.cookies import CookieError, SimpleCookie
from typing import Any, TypeAlias
from urllib.parse import parse_qs, urlsplit

from heptarm.errors import CommandRejected, HeptarmError, shortage
from heptarm.values.checks import integer
from heptarm.values.frames import check_printable

LAST_PORT = 65535
#: Makes an answer, in a thread of its own: status, media type, text.
Page: TypeAlias = Callable[[], tuple[http.HTTPStatus, str, str]]
#: Names under which a browser on this machine reaches a panel that listens on an address of it.
_LOCAL = ("127.0.0.1", "localhost", "[::1]")
#: A remote address, to look up which own one is used for it; nothing is sent to it (RFC 5737, TEST-NET-1).
_SOMEWHERE = ("192.0.2.1", 9)


def is_local(host: str) -> bool:
    """Whether only this machine reaches what listens on an address."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.lower() == "localhost"


def _is_everywhere(host: str) -> bool:
    """Whether an address stands for all addresses of this machine."""
    return host in ("0.0.0.0", "::", "")


def _own_address() -> str:
    """This machine's address towards the network; without a network its name."""
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect(_SOMEWHERE)
            return str(probe.getsockname()[0])
    except OSError:
        return socket.gethostname()


def free_port(host: str, port: int) -> int:
    """The first free port from a port on; 0: any.

    Args:
        host: address of this machine to listen on.
        port: TCP port, [0, 65535].

    Raises:
        ShapeError: the address cannot be printed.
        LimitError: there is no such port.
        CommandRejected: this machine does not have that address, or no port from there on is free.
    """
    integer(port, "port", 0, LAST_PORT)
    check_printable(host, "host")
    for candidate in range(port, LAST_PORT + 1):
        try:
            with socket.create_server((host, candidate), family=_family(host)):
                return candidate if port else 0
        except OSError as error:
            if remedy := shortage(error):
                raise CommandRejected("the panel has no socket to listen on", hint=remedy) from error
            if error.errno not in (errno.EADDRINUSE, errno.EACCES):
                raise CommandRejected(
                    f"host must be an address of this machine, got {host!r}: {str(error.strerror).partition(' (')[0]}",
                    parameter="host",
                    value=host,
                    hint="127.0.0.1 for this machine alone, 0.0.0.0 for the whole network",
                ) from None
    raise CommandRejected(
        f"no port from {port} to {LAST_PORT} is free on {host}",
        parameter="port",
        value=port,
        hint="0 takes a free one",
    )


def _family(host: str) -> socket.AddressFamily:
    return socket.AF_INET6 if ":" in host else socket.AF_INET


class PageGuard:
    """Checks requests to the panel.

    Args:
        host: address on which the panel listens.

    Attributes:
        token: secret of this panel, in its URL.
        port: TCP port of the panel; 0 until it is known, and nobody gets in.
    """

    def __init__(self, host: str) -> None:
        self.token = secrets.token_urlsafe(24)
        self.port = 0
        self._host = host

    @property
    def url(self) -> str:
        """URL with the token, to print once."""
        host = _own_address() if _is_everywhere(self._host) else self._host
        return f"http://{f'[{host}]' if ':' in host else host}:{self.port}/?token={self.token}"

    @property
    def cookie(self) -> str:
        """Name of the cookie; cookies belong to a host, so it names the port."""
        return f"heptarm_panel_{self.port}"

    def refusal(self, path: str, *, host: str, origin: str, cookies: str) -> str:
        """Say why a request is refused; empty: it is not.

        Args:
            path: path and query of the request.
            host: header Host.
            origin: header Origin; empty: there is none.
            cookies: header Cookie.
        """
        if not self.port or not self._is_own(host.lower()):
            return "the header Host names another host than the panel"
        if origin and origin.lower() != f"http://{host.lower()}":
            return "a page of another origin asks for the panel"
        if not (self.is_token(self.token_in(path)) or self.is_token(self._token_in_cookie(cookies))):
            return "the token is missing or wrong; open the URL that `heptarm panel` or `heptarm sim` has printed"
        return ""

    def _is_own(self, place: str) -> bool:
        """Whether a host with its port is the panel's own.

        A panel that listens everywhere is reached by any address of this machine. Rebinding needs a name, which has to
        be this machine's.
        """
        names = {*_LOCAL, self._host, f"[{self._host}]"}
        name, _, port = place.rpartition(":") if f":{self.port}" in place else (place, "", "80")
        if port != str(self.port):
            return False
        if not _is_everywhere(self._host):
            return name in names
        try:
            ipaddress.ip_address(name.strip("[]"))
            return True
        except ValueError:
            return name in (*names, socket.gethostname().lower(), socket.getfqdn().lower())

    def is_token(self, given: str) -> bool:
        """Whether a text is the token, in constant time."""
        return hmac.compare_digest(given.encode(), self.token.encode())

    @staticmethod
    def token_in(path: str) -> str:
        """The token in the query of a path; empty: there is none."""
        return parse_qs(urlsplit(path).query).get("token", [""])[0]

    def _token_in_cookie(self, cookies: str) -> str:
        found: SimpleCookie = SimpleCookie()
        with contextlib.suppress(CookieError):
            found.load(cookies)
        return found[self.cookie].value if self.cookie in found else ""

    # ------------------------------------------------------------------------------------ in viser's server

    @contextlib.contextmanager
    def installed(self, pages: Mapping[str, Page]) -> Iterator[None]:
        """Guard the servers of websockets that are started in this block.

        Args:
            pages: what they serve beside viser's files, by path.

        Raises:
            HeptarmError: none was started: this version of viser works in another way, and all could open the panel.
        """
        from websockets.asyncio import server

        original = server.serve
        guarded = False

        def serve(*arguments: Any, process_request: Any = None, **keywords: Any) -> Any:
            nonlocal guarded
            guarded = True
            return original(*arguments, process_request=self._checked(process_request, pages), **keywords)

        server.serve = serve  # type: ignore[assignment,misc]
        try:
            yield
        finally:
            server.serve = original  # type: ignore[misc]
        if not guarded:
            raise HeptarmError(
                "the panel cannot be protected with this version of viser", hint="pip install 'viser>=1,<2'"
            )

    def _checked(
        self, then: Callable[[Any, Any], Any] | None, pages: Mapping[str, Page]
    ) -> Callable[[Any, Any], Any]:
        """Check a request, and answer it with a page of ours, or hand it on to viser; the answer sets the cookie."""

        async def process(connection: Any, request: Any) -> Any:
            headers = request.headers
            try:
                several = [name for name in ("Host", "Origin") if len(headers.get_all(name)) > 1]
                reason = (
                    f"several headers {several[0]}"
                    if several
                    else self.refusal(
                        request.path,
                        host=headers.get("Host", ""),
                        origin=headers.get("Origin", ""),
                        cookies="; ".join(headers.get_all("Cookie")),
                    )
                )
            except ValueError:
                reason = "the request is malformed"
            if reason:
                return connection.respond(http.HTTPStatus.FORBIDDEN, f"{reason}\n")
            page = None if "Upgrade" in headers else pages.get(urlsplit(request.path).path)
            if page is not None:
                status, kind, text = await _in_a_thread(page)
                response = connection.respond(status, text)
                del response.headers["Content-Type"]
                response.headers["Content-Type"] = f"{kind}; charset=utf-8"
                response.headers["Cache-Control"] = "no-store"
                response.headers["Content-Security-Policy"] = "frame-ancestors 'none'"
            else:
                response = None if then is None else then(connection, request)
            if response is not None and self.is_token(self.token_in(request.path)):
                response.headers["Set-Cookie"] = (
                    f"{self.cookie}={self.token}; Path=/; HttpOnly; SameSite=Strict"
                )
                response.headers["Referrer-Policy"] = "no-referrer"
            return response

        return process


async def _in_a_thread(page: Page) -> tuple[http.HTTPStatus, str, str]:
    """An answer, made by a thread of its own: those of a pool may all be waiting for arms that do not answer."""
    loop = asyncio.get_running_loop()
    answer: asyncio.Future[tuple[http.HTTPStatus, str, str]] = loop.create_future()

    def hand_over(made: tuple[http.HTTPStatus, str, str]) -> None:
        if not answer.done():  # the browser may have gone
            answer.set_result(made)

    def make() -> None:
        made = page()
        with contextlib.suppress(RuntimeError):  # the panel has ended meanwhile
            loop.call_soon_threadsafe(hand_over, made)

    threading.Thread(target=make, name="heptarm-panel-page", daemon=True).start()
    return await answer
