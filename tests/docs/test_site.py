"""The documentation's site: it builds, its links have targets, and every page fits a desktop, a tablet and a phone."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from html.parser import HTMLParser
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote, urldefrag, urlsplit

import pytest

from scripts.publish_site import publish
from tests.drawing import until

ROOT = Path(__file__).resolve().parents[2]
#: Width and height of a desktop, of an upright tablet and of a phone [px].
SIZES = ((1280, 900), (768, 1024), (390, 844))
#: What is wider than the window, and images that do not load; wide tables and code scroll in boxes of their own.
LOOK = """
const width = document.documentElement.clientWidth;
const wide = document.documentElement.scrollWidth > width + 1;
const culprits = wide ? [...document.querySelectorAll("main *")]
    .filter(e => e.getBoundingClientRect().right > width + 1)
    .slice(0, 3).map(e => e.tagName + ": " + e.textContent.trim().slice(0, 60)) : [];
const images = [...document.images].filter(i => !i.complete || i.naturalWidth === 0).map(i => i.getAttribute("src"));
return {wide: wide, culprits: culprits, images: images, title: document.title};
"""

RESULTS = "return [...document.querySelectorAll('#search-results li > a')].map(a => a.getAttribute('href'))"
#: The version that the list in the sidebar shows, and all that it has; null while it is hidden.
VERSIONS = """
const list = document.querySelector(".site-versions"), select = list.querySelector("select");
return list.hidden ? null : [select.value, [...select.options].map(option => option.value)];
"""
CHOOSE = """
const select = document.querySelector(".site-versions select");
select.value = arguments[0];
select.dispatchEvent(new Event("change"));
"""

#: CI builds the site beside the tests, see .github/workflows/test.yml; `test_links` is quick.
pytestmark = [pytest.mark.slow, pytest.mark.computing, pytest.mark.long]


@pytest.fixture(scope="session")  # tests with a browser come last
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built site; a warning is an error."""
    out = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-W", "-q", "-b", "html", str(ROOT / "docs"), str(out)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr
    return out


class References(HTMLParser):
    """Anchors of a page, and what it refers to."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.targets: set[str] = set()
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        if identifier := values.get("id"):
            self.anchors.add(identifier)
        for name in ("href", "src"):
            if (target := values.get(name)) and not urlsplit(target).scheme and not target.startswith("//"):
                self.targets.add(target)


def test_every_link_within_the_site_has_its_target(site: Path) -> None:
    pages = {path.resolve(): References(path) for path in site.rglob("*.html")}
    broken = []
    for path, page in pages.items():
        for target in page.targets:
            name, anchor = urldefrag(target)
            other = (path.parent / unquote(urlsplit(name).path)).resolve() if name else path
            if not other.exists():
                broken.append(f"{path.relative_to(site)}: {target}")
            elif anchor and other in pages and unquote(anchor) not in pages[other].anchors:
                broken.append(f"{path.relative_to(site)}: {target} (no such anchor)")
    assert not broken, "\n".join(sorted(broken))


@pytest.mark.browser
@pytest.mark.parametrize(
    ("words", "pages"),
    [
        ("LIN", ("guide/motions", "reference/python/motions")),
        ("hand eye", ("guide/cameras", "reference/python/calibration")),
        ("PartialPose", ("reference/python/motions",)),
    ],
)
def test_the_search_finds_what_people_type(
    site: Path, browser: Any, words: str, pages: tuple[str, ...]
) -> None:
    browser.get(f"{(site / 'search.html').as_uri()}?q={quote(words)}")
    until(lambda: {f"{page}.html" for page in pages} <= set(hrefs(browser)[:10]))


@pytest.mark.browser
def test_another_version_is_one_choice_away(site: Path, browser: Any, tmp_path: Path) -> None:
    for version in ("0.1.0", "main"):
        publish(site, tmp_path, version)
    (tmp_path / "0.1.0/guide/tools.html").unlink()
    with serving(tmp_path) as address:
        for page, lands in (
            ("guide/motions.html", "/0.1.0/guide/motions.html"),
            ("guide/tools.html", "/0.1.0/"),
        ):
            browser.get(f"{address}/main/{page}")
            until(lambda: browser.execute_script(VERSIONS) == ["main", ["main", "0.1.0"]])
            browser.execute_script(CHOOSE, "0.1.0")
            until(lambda: urlsplit(browser.current_url).path == lands)  # noqa: B023
    browser.get((site / "index.html").as_uri())
    assert browser.execute_script("return document.querySelector('.site-versions').hidden")


def hrefs(browser: Any) -> list[str]:
    """The pages of the results, in their order."""
    return [str(target).partition("#")[0] for target in browser.execute_script(RESULTS)]


@contextmanager
def serving(folder: Path) -> Iterator[str]:
    """Serve a folder over HTTP on this machine."""
    handler = partial(QuietHandler, directory=str(folder))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


class QuietHandler(SimpleHTTPRequestHandler):
    """Serves files, and prints nothing."""

    def log_message(self, *_: object) -> None:
        """Nothing."""


@pytest.mark.browser
def test_every_page_fits_a_desktop_a_tablet_and_a_phone(site: Path, browser: Any) -> None:
    wrong = []
    for page in sorted(site.rglob("*.html")):
        name = page.relative_to(site).as_posix()
        if name.startswith(("_modules/", "_static/")):
            continue
        browser.get(page.as_uri())
        for width, height in SIZES:
            browser.execute_cdp_cmd(
                "Emulation.setDeviceMetricsOverride",
                {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600},
            )
            seen = browser.execute_script(LOOK)
            if seen["wide"]:
                wrong.append(f"{name} at {width} px is too wide: {seen['culprits']}")
            wrong += [f"{name}: image {source} does not load" for source in seen["images"]]
    assert not wrong, "\n".join(wrong)
