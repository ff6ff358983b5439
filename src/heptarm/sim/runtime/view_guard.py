"""Who may see the view: a browser that was given the URL with its token.

The view listens on a port of this machine. Any web page that a browser on this machine shows could connect to it. The
guard looks at every request before viser does: its Host must be the view's own (against DNS rebinding), its Origin too
if it has one (against other pages), and it must bring the token, in the URL or in the cookie that the first page sets.
"""

from __future__ import annotations

import contextlib
import hmac
import http
import secrets
from collections.abc import Callable, Iterator
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

from heptarm.errors import HeptarmError

#: Names under which a browser on this machine reaches a view that listens on an address of it.
_LOCAL = ("127.0.0.1", "localhost", "[::1]")


class ViewGuard:
    """Checks requests to the view.

    Args:
        host: address on which the view listens.

    Attributes:
        token: secret of this view, in its URL.
        port: TCP port of the view; 0 until it is known, and nobody gets in.
    """

    def __init__(self, host: str) -> None:
        self.token = secrets.token_urlsafe(24)
        self.port = 0
        self._host = host

    @property
    def url(self) -> str:
        """URL with the token, to print once."""
        return f"http://{self._host}:{self.port}/?token={self.token}"

    @property
    def cookie(self) -> str:
        """Name of the cookie; cookies belong to a host, so it names the port."""
        return f"heptarm_view_{self.port}"

    def refusal(self, path: str, *, host: str, origin: str, cookies: str) -> str:
        """Say why a request is refused; empty: it is not.

        Args:
            path: path and query of the request.
            host: header Host.
            origin: header Origin; empty: there is none.
            cookies: header Cookie.
        """
        names = {*_LOCAL, self._host}
        own = {f"{name}:{self.port}" for name in names} | (names if self.port == 80 else set())
        if not self.port or host.lower() not in own:
            return "the header Host names another host than the view"
        if origin and origin.lower() not in {f"http://{name}" for name in own}:
            return "a page of another origin asks for the view"
        if not (self.is_token(self.token_in(path)) or self.is_token(self._token_in_cookie(cookies))):
            return "the token is missing or wrong; open the URL that `heptarm sim --view` has printed"
        return ""

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
    def installed(self) -> Iterator[None]:
        """Guard the servers of websockets that are started in this block.

        Raises:
            HeptarmError: none was started: this version of viser works in another way, and all could see the view.
        """
        from websockets.asyncio import server

        original = server.serve
        guarded = False

        def serve(*arguments: Any, process_request: Any = None, **keywords: Any) -> Any:
            nonlocal guarded
            guarded = True
            return original(*arguments, process_request=self._checked(process_request), **keywords)

        server.serve = serve  # type: ignore[assignment,misc]
        try:
            yield
        finally:
            server.serve = original  # type: ignore[misc]
        if not guarded:
            raise HeptarmError(
                "the view cannot be protected with this version of viser", hint="pip install 'viser>=1,<2'"
            )

    def _checked(self, then: Callable[[Any, Any], Any] | None) -> Callable[[Any, Any], Any]:
        """Check a request, and hand it on to viser; its answer sets the cookie."""

        def process(connection: Any, request: Any) -> Any:
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
            response = None if then is None else then(connection, request)
            if response is not None and self.is_token(self.token_in(request.path)):
                response.headers["Set-Cookie"] = (
                    f"{self.cookie}={self.token}; Path=/; HttpOnly; SameSite=Strict"
                )
                response.headers["Referrer-Policy"] = "no-referrer"
            return response

        return process
