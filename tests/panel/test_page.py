"""The panel in a real browser: each control is pressed, and a second client sees what the arm does."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm.panel.model import PanelArm
from heptarm.panel.process import Panel, PanelOptions, model_of
from tests.cli.running import sim
from tests.long import LONG, few

pytest.importorskip("viser")
webdriver = pytest.importorskip("selenium.webdriver")
selenium = pytest.importorskip("selenium.common.exceptions")

#: A browser that draws by software burdens the whole machine, and a held button has to ask in time.
pytestmark = [pytest.mark.browser, pytest.mark.alone]
PATIENCE = 60.0
#: What a browser reports of a control that the page is just drawing again.
REDRAWN = (
    selenium.NoSuchElementException,
    selenium.StaleElementReferenceException,
    selenium.ElementNotInteractableException,
)


def until(condition: Callable[[], object], what: str) -> None:
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            if condition():
                return
        except REDRAWN:
            pass
        assert time.monotonic() < deadline, what
        time.sleep(0.1)


class Page:
    """The panel as somebody in front of it uses it."""

    def __init__(self, browser: Any, url: str) -> None:
        self.browser = browser
        browser.set_window_size(1280, 900)
        browser.get(url)
        assert browser.title == "heptarm"
        browser.switch_to.frame("view")
        until(lambda: "A7" in self.text, "the panel never appeared")

    def resize(self, width: int = 0, height: int = 0) -> None:
        """Have another window, to the pixel, which a real one cannot be as narrow as a phone; 0: the window's own."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)

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
        button = self.button(label)
        places: list[Any] = [None, button.rect]
        while places[-1] != places[-2]:  # a browser that draws slowly still scrolls
            time.sleep(0.1)
            places.append(button.rect)
        button.click()

    @contextmanager
    def around(self) -> Iterator[Any]:
        """In the page around viser's, where the bar is; the button STOP."""
        self.browser.switch_to.default_content()
        yield self.browser.find_element("id", "stop")
        self.browser.switch_to.frame("view")

    def press_in_control(self, label: str, arm: ha.Arm, reached: Callable[[ha.State], bool]) -> None:
        """Press a button; after "Take control" if this machine held up the panel for longer than its watchdog time."""
        self.press(label)
        until(lambda: reached(arm.state) or arm.controller != "panel", f"{label} has no effect")
        if not reached(arm.state):
            self.press("Take control")
            until(lambda: arm.controller == "panel", "nobody took control")
            self.press(label)
            arm.wait_until(reached, timeout=PATIENCE)

    def stop(self) -> None:
        """Press STOP with the mouse."""
        with self.around() as button:
            button.click()

    def check(self, label: str) -> None:
        self.browser.find_element("xpath", f"//label[normalize-space()={label!r}]").click()

    def tab(self, label: str) -> None:
        def chosen() -> list[Any]:
            found = self.browser.find_elements("xpath", f"//*[normalize-space(text())={label!r}]")
            visible = [one for one in found if one.is_displayed()]
            for one in visible[:1]:
                one.click()
            return visible

        until(chosen, f"there is no tab {label}")

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
        at = page.button("Clear").rect
        page.press("Emergency stop")
        arm.wait_until(lambda state: state.safety.emergency_stop, timeout=PATIENCE)
        page.shows("press Clear under Operator")
        assert page.button("Clear").rect == at, "a message moves the buttons"
        page.press("Clear")
        arm.wait_until(lambda state: not state.safety.emergency_stop, timeout=PATIENCE)
        page.press("T1")
        arm.wait_until(lambda state: state.safety.mode.value == "t1", timeout=PATIENCE)
        page.press("AUT")
        arm.wait_until(lambda state: state.safety.mode.value == "aut", timeout=PATIENCE)
        page.press_in_control("Resume", arm, lambda state: not state.safety.paused)
        page.press("Recover")
        page.shows("Ready: nothing had to be done")
        page.press("Release control")
        until(lambda: arm.controller == "", "control was not released")

        # STOP, while another program is in control
        with ha.connect(ready["target"], name="program", watchdog=5.0, timeout=PATIENCE) as program:
            page.shows("in control: program")
            handle = program.start(ha.ptp(ha.deg(90, 30, 0, -90, 0, 60, 0), speed=0.02))
            arm.wait_until(lambda state: state.motion is not None and state.motion.active, timeout=PATIENCE)
            page.stop()
            with pytest.raises(ha.MotionAborted):
                handle.wait(timeout=PATIENCE)

        # a page that is closed stops what its button moves
        page.tab("Jog")
        page.press("Take control")
        until(lambda: arm.controller == "panel", "nobody took control")
        page.browser.switch_to.new_window("tab")
        first, second = page.browser.window_handles
        page.browser.switch_to.window(first)
        page.browser.switch_to.frame("view")
        start = arm.state.q[0]
        webdriver.ActionChains(browser).click_and_hold(page.button("A1 −")).perform()
        arm.wait_until(lambda state: state.q[0] < start - 0.01, timeout=PATIENCE)
        page.browser.close()
        page.browser.switch_to.window(second)
        arm.wait_for_rest(timeout=PATIENCE)


@pytest.mark.long
def test_a_panel_that_only_shows_has_a_stop_and_nothing_else(
    browser: Any, observer: Callable[[str], ha.Arm]
) -> None:
    with sim("--view", "--view-port", "0") as ready:
        page = Page(browser, ready["view"])
        page.shows("only shows")
        labels = {one.text for one in browser.find_elements("tag name", "button") if one.is_displayed()}
        assert labels and not labels & {"Take control", "A1 +", "Teach here", "Emergency stop"}
        with ha.connect(ready["target"], watchdog=5.0, timeout=PATIENCE) as arm:
            handle = arm.start(ha.ptp(ha.deg(90, 30, 0, -90, 0, 60, 0), speed=0.02))
            assert handle.wait_started(PATIENCE)
            page.stop()
            with pytest.raises(ha.MotionAborted):
                handle.wait(timeout=PATIENCE)


#: A phone, the smallest window in which STOP once scrolled away, an upright tablet, and a large window [pixels].
SIZES = ((390, 844), (1024, 700), (768, 1024), (2560, 1440))
TABS = ("Jog", "Program", "IO, tools", "Calibrate", "Operator")
#: Scrolls whatever can be scrolled, to its end.
SCROLL = (
    """for (const one of document.querySelectorAll("*")) { one.scrollTop = 1e6; one.scrollLeft = 1e6; }"""
)
#: Whether the button is what is seen at its middle and near its corners, and within the window.
SEEN = """const box = arguments[0].getBoundingClientRect();
return box.top >= 0 && box.left >= 0 && box.bottom <= innerHeight && box.right <= innerWidth && box.height >= 44 &&
  [[.5, .5], [.05, .1], [.95, .1], [.05, .9], [.95, .9]].every(([x, y]) =>
    document.elementFromPoint(box.left + x * box.width, box.top + y * box.height) === arguments[0]);"""
#: What is wrong without any scrolling: buttons that jog out of sight, the picture too small or covered in its middle.
LAYOUT = """const wrong = [], picture = document.querySelector("canvas[data-engine]").getBoundingClientRect();
for (const joint of [1, 2, 3, 4, 5, 6, 7]) for (const sign of "−+") {
  const button = [...document.querySelectorAll("button")].find((one) => one.textContent.trim() === `A${joint} ${sign}`);
  const box = button?.getBoundingClientRect();
  const at = box && document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2);
  if (!at || !button.contains(at)) wrong.push(`A${joint} ${sign}`);
}
const middle = document.elementFromPoint(picture.left + picture.width / 2, picture.top + picture.height / 2);
if (picture.width < 300 || picture.height < 220 || middle?.dataset.engine === undefined) wrong.push("picture");
if (document.getElementById("webgl-software-rendering")?.checkVisibility()) wrong.push("banner");
return wrong;"""


@pytest.mark.timeout(600)
def test_stop_is_in_reach_whatever_the_page_shows(browser: Any, own: tuple[Panel, PanelArm]) -> None:
    panel, model = own
    page = Page(browser, panel.url)
    cabinet = model.arm.connection.cabinet
    assert cabinet is not None
    target = f"sim://{cabinet.host}:{cabinet.port}"

    def check(where: str) -> None:
        """STOP is there, and pressed at its place it stops the arm."""
        browser.execute_script(SCROLL)
        with page.around() as button:
            browser.execute_script(SCROLL)
            assert browser.execute_script(SEEN, button), where

    def check_when_small(where: str) -> None:
        for width, height in few(SIZES):
            page.resize(width, height)
            check(f"{where} at {width} x {height}")
        page.resize()

    def stops(press: Callable[[], object]) -> None:
        with ha.connect(target, name="program", watchdog=5.0, timeout=PATIENCE) as program:
            handle = program.start(ha.ptp(ha.deg(90, 30, 0, -90, 0, 60, 0), speed=0.02))
            assert handle.wait_started(PATIENCE)
            press()
            with pytest.raises(ha.MotionAborted):
                handle.wait(timeout=PATIENCE)

    def touch() -> None:
        with page.around() as button:
            browser.execute_script(
                "arguments[0].dispatchEvent(new PointerEvent('pointerdown', {pointerType: 'touch', bubbles: true}))",
                button,
            )

    def key(key: str, *, into: str) -> Callable[[], None]:
        def press() -> None:
            with page.around() as button:
                (button if into == "button" else browser.find_element("tag name", "body")).send_keys(key)

        return press

    for width, height in few(SIZES, 2):
        page.resize(width, height)
        until(lambda: browser.execute_script(LAYOUT) == [], f"not all in sight at {width} x {height}")
        for tab in TABS:
            page.tab(tab)
            check(f"{tab} at {width} x {height}")
        page.tab(TABS[0])
        if (width, height) in few(SIZES):
            stops(page.stop)
    page.resize()
    if LONG:  # the page is loaded twice more
        page = Page(browser, panel.url)
        model.take_control()
        model.teach("P1")
        model.preview(speed=0.5)
        page.shows("nothing moves")
        check_when_small("with a preview")
        model.hide_plan()
        model.release_control()
        model.operate("emergency_stop")
        page.shows("press Clear under Operator")
        check_when_small("after an emergency stop")
        page = Page(browser, panel.url)
        page.tab("Operator")
        page.press("Clear")
        page.press("Recover")
        until(
            lambda: not model.arm.state.safety.emergency_stop and model.arm.state.safety.ready_to_move,
            "it is not ready again",
        )
        model.release_control()
    page = Page(browser, panel.url)  # one that was resized draws its controls again
    for press in (page.stop, touch, key("s", into="body"), key("\ue007", into="button")):
        stops(press)
    with page.around():
        until(
            lambda: "stopped" in browser.find_element("id", "said").text,
            "it does not say that the arm is stopped",
        )

    # the cabinet is gone: the bar shows it
    cabinet.close()
    page.stop()
    with page.around():
        said = browser.find_element("id", "said")
        until(
            lambda: "NOT stopped" in said.text and "emergency stop" in said.text,
            "it hides that nothing stopped",
        )


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Panel, PanelArm]]:
    """A panel in this process, of a private simulator."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr("webbrowser.open", lambda _: True)
    with ha.connect("sim://iiwa14?scene=bins", control=False, watchdog=5.0, timeout=PATIENCE) as arm:
        options = PanelOptions(port=0, scene="bins")
        model = model_of(arm, "sim://iiwa14?scene=bins", options)
        panel = Panel([model], options)
        thread = threading.Thread(target=panel.run, daemon=True)
        thread.start()
        yield panel, model
        panel.close()
        thread.join(PATIENCE)


class Scene:
    """Where things of the scene are on the page, by the camera that viser reports."""

    def __init__(self, page: Page, panel: Panel) -> None:
        self._canvas = page.browser.find_element("tag name", "canvas")
        self._page, self._panel = page, panel

    def pixel(self, point: np.ndarray) -> tuple[int, int]:
        """Place of a point of the world relative to the middle of the canvas [pixels]."""
        (client,) = self._panel.server.get_clients().values()
        camera = client.camera
        w, x, y, z = camera.wxyz
        right, down, forward = ha.Pose.of((0, 0, 0), (x, y, z, w)).rotation.T
        to = np.asarray(point) - camera.position
        scale = 0.5 * self._canvas.size["height"] / np.tan(camera.fov / 2) / (to @ forward)
        return round(to @ right * scale), round(to @ down * scale)

    def drag(self, begin: np.ndarray, end: np.ndarray) -> None:
        """Drag with the mouse from a point of the world to another one."""
        (x, y), (u, v) = self.pixel(begin), self.pixel(end)
        chain = webdriver.ActionChains(self._page.browser)
        chain.move_to_element_with_offset(self._canvas, x, y).pause(0.5).click_and_hold().pause(0.3)
        for _ in range(5):
            chain.move_by_offset(round((u - x) / 5), round((v - y) / 5)).pause(0.1)
        chain.release().perform()


@pytest.mark.long  # tests/panel/test_model.py has what the controls call
def test_handle_points_plans_and_gripper(browser: Any, own: tuple[Panel, PanelArm], tmp_path: Path) -> None:
    panel, model = own
    page = Page(browser, panel.url)
    arm = model.arm
    page.press("Take control")
    until(lambda: arm.in_control, "nobody took control")
    arm.move(ha.ptp(ha.deg(0, 25, 0, -90, 0, 65, 0)))

    # the handle: it appears at the TCP, is dragged by an arrow, and the arm goes there while the button is held
    page.check("Handle to drag the TCP")
    start = arm.wait_for_rest(timeout=PATIENCE).pose
    scene = Scene(page, panel)
    arrow = start.rotation[:, 0] * 0.15

    def is_dragged() -> bool:
        """Along the arrow only; a mouse that has caught another part on a busy machine tries again."""
        scene.drag(start.xyz + arrow, start.xyz + 1.6 * arrow)
        if model.goal is None:
            return False
        moved = start.rotation.T @ (model.goal.xyz - start.xyz)
        if moved[0] > 0.01 and abs(moved[1:]).max() < 1e-6:
            return True
        page.check("Handle to drag the TCP")  # hidden, and shown again at the TCP
        until(lambda: model.goal is None, "the handle is still shown")
        page.check("Handle to drag the TCP")
        return False

    until(is_dragged, "the handle was not dragged along its arrow")
    goal = model.goal
    assert goal is not None

    # a path to it is shown first, and driven by a press of its own
    page.check("Keep the tool upright")
    page.press("Plan around bodies")
    page.shows("nothing moves")
    assert model.has_path and arm.state.pose.distance_to(start) < 2e-3
    page.press("Drive the path")
    page.shows("Arrived at the handle")
    assert arm.wait_for_rest(timeout=PATIENCE).pose.distance_to(goal) < 2e-3
    arm.move(ha.ptp(ha.deg(0, 25, 0, -90, 0, 65, 0)))

    with page.held("Hold: go to the handle"):
        arm.wait_until(lambda state: state.pose.distance_to(goal) < 2e-3, timeout=PATIENCE)
    assert arm.wait_for_rest(timeout=PATIENCE).pose.distance_to(goal) < 5e-3

    # points: taught, planned, shown by a ghost, saved to a file and loaded from it
    page.tab("Program")
    page.press("Teach here")
    until(lambda: model.points.names == ("P1",), "no point was taught")
    page.press("Preview")
    page.shows("nothing moves")
    page.press("Hide plan")
    until(lambda: model.plan is None, "the plan is still shown")
    browser.execute_cdp_cmd(
        "Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(tmp_path)}
    )
    page.press("Save")
    file = tmp_path / "points.json"
    until(lambda: file.exists() and file.read_text(), "nothing was saved")
    model.points.rename("P1", "other")
    page.shows("other")  # drawn again, with its new name
    browser.find_element("css selector", "input[type=file]").send_keys(str(file))
    until(lambda: model.points.names == ("P1",), "nothing was loaded")

    # a step that is refused chooses no other point
    page.shows("● 1 P1")
    model.teach("P2")
    page.shows("2 P2")
    model.release_control()
    page.press("Step")
    until(lambda: (said := model.poll().message) is not None and said.level == "error", "it was not refused")
    page.shows("● 1 P1")
    model.take_control()

    # a program's plan, through the user's folder of open panels
    plan = arm.plan(ha.lin_rel(z=-0.05, frame="base"))
    until(lambda: plan.show() is None, "the panel takes no plans")
    until(lambda: model.plan is not None and len(model.plan.t) == len(plan.t), "the plan never came")

    # the gripper of the scene
    page.press("Close gripper")
    page.shows("The gripper is closed on nothing")
    page.press("Open gripper")
    page.shows("The gripper is open")
