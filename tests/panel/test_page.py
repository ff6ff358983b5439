"""The panel in a real browser: each control is pressed, and a second client sees what the arm does."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

import heptarm as ha
from tests.cli.running import sim

pytest.importorskip("viser")
webdriver = pytest.importorskip("selenium.webdriver")

#: A browser that draws by software burdens the whole machine, and a held button has to ask in time.
pytestmark = [pytest.mark.browser, pytest.mark.alone]
PATIENCE = 60.0


def until(condition: Callable[[], object], what: str) -> None:
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            if condition():
                return
        except webdriver.support.wait.NoSuchElementException:
            pass
        assert time.monotonic() < deadline, what
        time.sleep(0.1)


class Page:
    """The panel as somebody in front of it uses it."""

    def __init__(self, browser: Any, url: str) -> None:
        self.browser = browser
        browser.set_window_size(1280, 900)
        browser.get(url)
        until(lambda: "STOP" in self.text and "A7" in self.text, "the panel never appeared")

    @property
    def text(self) -> str:
        return str(self.browser.find_element("tag name", "body").text)

    def shows(self, words: str) -> None:
        until(
            lambda: words.casefold() in self.text.casefold(), f"the page never shows {words!r}: {self.text}"
        )

    def button(self, label: str) -> Any:
        found = self.browser.find_elements("xpath", f"//button[normalize-space()={label!r}]")
        visible = [one for one in found if one.is_displayed()]
        assert visible, f"no button {label!r}: {self.text}"
        self.browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", visible[0])
        return visible[0]

    def press(self, label: str) -> None:
        self.button(label).click()

    def tab(self, label: str) -> None:
        self.browser.find_element("xpath", f"//*[normalize-space(text())={label!r}]").click()

    @contextmanager
    def held(self, label: str) -> Iterator[None]:
        webdriver.ActionChains(self.browser).click_and_hold(self.button(label)).perform()
        yield
        webdriver.ActionChains(self.browser).release().perform()


@pytest.fixture
def observer() -> Iterator[Callable[[str], ha.Arm]]:
    arms: list[ha.Arm] = []

    def connect(target: str) -> ha.Arm:
        arms.append(ha.connect(target, control=False, watchdog=5.0, timeout=PATIENCE))
        return arms[-1]

    yield connect
    for arm in arms:
        arm.close()


def test_every_control_does_what_it_is_labelled(browser: Any, observer: Callable[[str], ha.Arm]) -> None:
    with sim("--panel", "--view-port", "0") as ready:
        arm = observer(ready["target"])
        page = Page(browser, ready["panel"])
        page.press("Take control")
        until(lambda: arm.controller == "panel", "nobody took control")
        page.shows("in control: this panel")

        # jogging: only while the button is held
        before = arm.state
        with page.held("A1 +"):
            arm.wait_until(lambda state: state.q[0] > before.q[0] + 0.01, timeout=PATIENCE)
        rest = arm.wait_for_rest(timeout=PATIENCE)
        assert rest.q[0] > before.q[0] + 0.01 and abs(rest.q[1:] - before.q[1:]).max() < 2e-3

        # the list of points, and the other buttons
        page.tab("Program")
        page.press("Teach here")
        page.shows("Taught P1")
        page.tab("IO, tools")
        page.tab("Operator")
        page.press("Emergency stop")
        arm.wait_until(lambda state: state.safety.emergency_stop, timeout=PATIENCE)
        page.shows("press Clear under Operator")
        page.press("Clear")
        arm.wait_until(lambda state: not state.safety.emergency_stop, timeout=PATIENCE)
        page.press("T1")
        arm.wait_until(lambda state: state.safety.mode.value == "t1", timeout=PATIENCE)
        page.press("AUT")
        arm.wait_until(lambda state: state.safety.mode.value == "aut", timeout=PATIENCE)
        page.press("Resume")
        arm.wait_until(lambda state: not state.safety.paused, timeout=PATIENCE)
        page.press("Recover")
        page.shows("Ready: nothing had to be done")
        page.press("Release control")
        until(lambda: arm.controller == "", "control was not released")

        # STOP, while another program is in control
        with ha.connect(ready["target"], name="program", watchdog=5.0, timeout=PATIENCE) as program:
            page.shows("in control: program")
            handle = program.start(ha.ptp(ha.deg(90, 30, 0, -90, 0, 60, 0), speed=0.02))
            arm.wait_until(lambda state: state.motion is not None and state.motion.active, timeout=PATIENCE)
            page.press("STOP")
            with pytest.raises(ha.MotionAborted):
                handle.wait(timeout=PATIENCE)

        # a page that is closed stops what its button moves
        page.tab("Jog")
        page.press("Take control")
        until(lambda: arm.controller == "panel", "nobody took control")
        page.browser.switch_to.new_window("tab")
        first, second = page.browser.window_handles
        page.browser.switch_to.window(first)
        start = arm.state.q[0]
        webdriver.ActionChains(browser).click_and_hold(page.button("A1 −")).perform()
        arm.wait_until(lambda state: state.q[0] < start - 0.01, timeout=PATIENCE)
        page.browser.close()
        page.browser.switch_to.window(second)
        arm.wait_for_rest(timeout=PATIENCE)


def test_a_panel_that_only_shows_has_a_stop_and_nothing_else(
    browser: Any, observer: Callable[[str], ha.Arm]
) -> None:
    with sim("--view", "--view-port", "0") as ready:
        page = Page(browser, ready["view"])
        page.shows("only shows")
        labels = {one.text for one in browser.find_elements("tag name", "button") if one.is_displayed()}
        assert "STOP" in labels and not labels & {"Take control", "A1 +", "Teach here", "Emergency stop"}
        with ha.connect(ready["target"], watchdog=5.0, timeout=PATIENCE) as arm:
            handle = arm.start(ha.ptp(ha.deg(90, 30, 0, -90, 0, 60, 0), speed=0.02))
            assert handle.wait_started(PATIENCE)
            page.press("STOP")
            with pytest.raises(ha.MotionAborted):
                handle.wait(timeout=PATIENCE)
