"""Take the pictures of the panel for the documentation in a headless Chromium: docs/_static/panel*.png.

    .venv/bin/python scripts/panel_pictures.py [FOLDER]

It needs Chromium and its driver: apt-get install chromium chromium-driver.
"""

from __future__ import annotations

import io
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
from selenium import webdriver

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "src")]

import heptarm as ha  # noqa: E402

SIZE = (1280, 800)  # of a tablet [pixels]
OPTIONS = (
    "--headless=new",
    "--no-sandbox",
    "--hide-scrollbars",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)


@contextmanager
def cabinet() -> Iterator[dict[str, Any]]:
    """A virtual cabinet in a scene, with its panel."""
    command = [sys.executable, "-m", "heptarm.cli.main", "sim", "--json", "--port", "0", "--panel"]
    with subprocess.Popen(
        [*command, "--view-port", "0", "--scene", "table"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT / "src")},
    ) as process:
        assert process.stdout is not None
        try:
            yield dict(json.loads(process.stdout.readline()))
        finally:
            process.terminate()


@contextmanager
def chromium() -> Iterator[Any]:
    """A browser of the size of a tablet."""
    with tempfile.TemporaryDirectory() as profile:
        options = webdriver.ChromeOptions()
        options.binary_location = shutil.which("chromium") or ""
        for option in (*OPTIONS, f"--user-data-dir={profile}", f"--window-size={SIZE[0]},{SIZE[1]}"):
            options.add_argument(option)
        browser = webdriver.Chrome(
            options=options, service=webdriver.ChromeService(shutil.which("chromedriver"))
        )
        browser.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": SIZE[0], "height": SIZE[1], "deviceScaleFactor": 1, "mobile": False},
        )
        try:
            yield browser
        finally:
            browser.quit()


def press(browser: Any, label: str) -> None:
    """Press a button or a tab."""
    found = browser.find_elements("xpath", f"//*[normalize-space(text())={label!r}]")
    next(one for one in found if one.is_displayed()).click()
    time.sleep(0.5)


def hold(browser: Any, label: str, seconds: float) -> None:
    """Hold a button."""
    (button,) = browser.find_elements("xpath", f"//button[normalize-space()={label!r}]")
    webdriver.ActionChains(browser).click_and_hold(button).pause(seconds).release().perform()


def settled(browser: Any) -> Any:
    """The picture when it no longer changes much, shape (height, width, 3)."""
    before = np.zeros((1, 1, 3))
    for _ in range(60):
        time.sleep(1.0)
        now = matplotlib.image.imread(io.BytesIO(browser.get_screenshot_as_png()), format="png")[..., :3]
        if now.shape == before.shape and np.abs(now - before).mean() < 3e-3:
            return now
        before = now
    return before


def save(picture: Any, path: Path) -> None:
    """Save a picture in few colours."""
    from PIL import Image

    image = Image.fromarray((255 * picture).round().astype(np.uint8)).quantize(256, dither=Image.Dither.NONE)
    image.save(path, optimize=True)
    print(f"wrote {path}: {path.stat().st_size // 1000} kB")


def main(folder: Path) -> int:
    """Take all pictures."""
    with cabinet() as ready, chromium() as browser:
        browser.get(ready["panel"])
        browser.switch_to.frame("view")
        settled(browser)
        with ha.connect(ready["target"], name="cell", watchdog=5.0, timeout=30.0) as arm:
            arm.move(ha.ptp(ha.deg(-20, 25, 0, -80, 0, 75, 0), speed=0.4))
            for x, y, z in ((0.0, 0.25, 0.05), (0.08, 0.0, 0.1), (0.0, -0.25, -0.05), (-0.08, 0.0, -0.1)):
                arm.move(ha.lin_rel(x=x, y=y, z=z, frame="base", speed_mps=0.25))
            arm.move(ha.ptp(ha.deg(15, 25, 0, -80, 0, 75, 0), speed=0.4))
        press(browser, "Take control")
        press(browser, "Program")
        press(browser, "Teach here")
        for joint in ("A1 −", "A2 −"):
            press(browser, "Jog")
            hold(browser, joint, 5.0)
            press(browser, "Program")
            press(browser, "Teach here")
        save(settled(browser), folder / "panel-program.png")
        press(browser, "Preview")
        save(settled(browser), folder / "panel-plan.png")
        press(browser, "Hide plan")
        press(browser, "Operator")
        press(browser, "Push 20 N down, 2 s")
        time.sleep(1.0)
        press(browser, "Emergency stop")
        save(settled(browser), folder / "panel-stop.png")
        press(browser, "Clear")
        press(browser, "Resume")
        press(browser, "Push 20 N down, 2 s")
        press(browser, "Jog")
        save(settled(browser), folder / "panel.png")
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]) if sys.argv[1:] else ROOT / "docs" / "_static"))
