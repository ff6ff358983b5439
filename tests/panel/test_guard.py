"""Who may see the view: requests with a wrong host, of another page, or without the token are refused."""

from __future__ import annotations

import http.client
import socket
import urllib.parse
from collections.abc import Iterator
from typing import Any

import pytest

from heptarm.cli.panel import panel
from heptarm.errors import HeptarmError
from heptarm.panel.guard import free_port
from tests.cli.running import sim

pytest.importorskip("viser")
client = pytest.importorskip("websockets.sync.client")
exceptions = pytest.importorskip("websockets.exceptions")


@pytest.fixture(scope="module")
def view() -> Iterator[urllib.parse.SplitResult]:
    with sim("--view", "--view-port", "0") as ready:
        yield urllib.parse.urlsplit(ready["view"])


def get(
    view: urllib.parse.SplitResult, path: str, *, host: str = "", **headers: str
) -> tuple[int, dict[str, str], bytes]:
    """Status, headers and body of a request as a browser or somebody else would send it."""
    connection = http.client.HTTPConnection(view.hostname or "", view.port, timeout=30)
    connection.putrequest("GET", path, skip_host=True)
    connection.putheader("Host", host or view.netloc)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer.status, dict(answer.getheaders()), body


def cookie_of(view: urllib.parse.SplitResult) -> str:
    status, headers, body = get(view, f"/?{view.query}")
    assert status == 200 and b"<html" in body.lower()
    assert "HttpOnly" in headers["Set-Cookie"] and "SameSite=Strict" in headers["Set-Cookie"]
    return headers["Set-Cookie"].partition(";")[0]


def test_the_url_opens_the_view_and_its_cookie_the_rest(view: urllib.parse.SplitResult) -> None:
    cookie = cookie_of(view)
    assert get(view, "/", Cookie=cookie)[0] == 200
    assert get(view, "/", Cookie=cookie, Origin=f"http://{view.netloc}")[0] == 200
    assert get(view, "/", host=f"localhost:{view.port}", Cookie=cookie)[0] == 200


@pytest.mark.parametrize(
    "path", ["/", "/index.html", "/?token=", "/?token=wrong", "/?Token={token}", "/%2e%2e/"]
)
def test_without_the_token_nothing_is_shown(view: urllib.parse.SplitResult, path: str) -> None:
    status, headers, body = get(view, path.format(token=view.query.partition("=")[2]))
    assert status == 403 and b"token" in body and "Set-Cookie" not in headers


@pytest.mark.parametrize(
    "name",
    ["evil.example", "evil.example:{port}", "127.0.0.1", "127.0.0.1:1", "127.0.0.1.evil.example:{port}"],
)
def test_another_host_is_refused_even_with_the_token(view: urllib.parse.SplitResult, name: str) -> None:
    status, _, body = get(view, f"/?{view.query}", host=name.format(port=view.port))
    assert status == 403 and b"Host" in body


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "https://127.0.0.1:{port}", "http://127.0.0.1:1"]
)
def test_another_origin_is_refused_even_with_the_token(view: urllib.parse.SplitResult, origin: str) -> None:
    status, _, body = get(view, f"/?{view.query}", Origin=origin.format(port=view.port))
    assert status == 403 and b"origin" in body


def test_the_websocket_needs_the_token_and_the_origin_as_well(view: urllib.parse.SplitResult) -> None:
    url = f"ws://{view.netloc}/"
    cookie = cookie_of(view)

    def connect(**headers: str) -> Any:
        return client.connect(
            url,
            additional_headers={name: value for name, value in headers.items() if name != "Origin"},
            origin=headers.get("Origin"),
            subprotocols=["viser-vtest"],
            open_timeout=30,
        )

    for wrong in (
        {},
        {"Origin": f"http://{view.netloc}"},
        {"Cookie": cookie, "Origin": "http://evil.example"},
        {"Cookie": cookie[:-1] + "!"},
    ):
        with pytest.raises(exceptions.InvalidStatus) as refused:
            connect(**wrong)
        assert refused.value.response.status_code == 403
    with connect(Cookie=cookie, Origin=f"http://{view.netloc}"):
        pass


def test_the_first_free_port_is_taken() -> None:
    with socket.create_server(("127.0.0.1", 0)) as used:
        port = used.getsockname()[1]
        assert free_port("127.0.0.1", port) > port
    assert free_port("localhost", 0) == 0


@pytest.mark.parametrize(
    ("host", "port", "expected_text"),
    [
        ("127.0.0.1", 99999, r"port must be in \[0, 65535\], got 99999"),
        ("127.0.0.1\0", 8080, "host must have printable characters only"),
        ("\ud800", 8080, "host must have printable characters only"),
        ("127.0.0.1", -1, r"port must be in \[0, 65535\], got -1"),
        (
            "192.0.2.7",
            8080,
            r"host must be an address of this machine, got '192.0.2.7': .*127.0.0.1 for this machine",
        ),
    ],
)
def test_an_address_that_is_none_is_refused_before_anything_starts(
    host: str, port: int, expected_text: str
) -> None:
    """The web server of the page would look for ever for a port on it."""
    with pytest.raises(HeptarmError, match=expected_text):
        free_port(host, port)
    with pytest.raises(HeptarmError, match=expected_text):
        panel(host=host, port=port)
