"""A headless Chromium for tests."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

_OPTIONS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--window-size=1000,750",
)


@pytest.fixture
def browser(tmp_path: Path) -> Iterator[Any]:
    """A selenium driver; the test is skipped where there is no Chromium."""
    webdriver = pytest.importorskip("selenium.webdriver")
    binary = shutil.which("chromium") or shutil.which("google-chrome")
    driver = shutil.which("chromedriver")
    if binary is None or driver is None:
        pytest.skip("no Chromium here: apt-get install chromium chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = binary
    for option in (*_OPTIONS, f"--user-data-dir={tmp_path / 'profile'}"):
        options.add_argument(option)
    # Linux divides the processors among sessions first, and a session's time among its processes then. In the
    # session of the tests and beside other load, a browser that draws answers no command for minutes.
    service = webdriver.ChromeService(driver, popen_kw={"start_new_session": True})
    running = webdriver.Chrome(options=options, service=service)
    yield running
    running.quit()
