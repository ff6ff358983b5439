"""The wizard that measures tool, load and camera in steps: what is asked, what moves next, how far it is, the result.

A calibration runs in a thread of its own. It asks before each pose and before anything moves, and waits until a person
presses a button; what it has found is saved only by another one.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from heptarm import calibration
from heptarm.arm.devices.camera import opened_camera
from heptarm.calibration.proposal import measuring
from heptarm.errors import CommandRejected, HeptarmError, ModeConflict
from heptarm.io.panel_box import PlanOutline
from heptarm.io.targets import saved_target
from heptarm.values.camera import Camera
from heptarm.values.checks import Value, word

if TYPE_CHECKING:
    from heptarm.arm.arm import Arm

#: What can be measured: by its name, what the panel calls it.
KINDS = {
    "poses": "Tip: poses about a point",
    "touch": "Tip: touch a surface",
    "load": "Load",
    "camera": "Camera",
}
#: The camera of a virtual arm: beside the flange, looking along its axis.
_SIMULATED = Camera((0.06, 0.0, 0.04), (0.05, 0.0, 0.4), frame="flange", rate=10.0, shadows=False)
#: Side of the mark of a corner in a picture [pixels].
_MARK = 3


@dataclass(frozen=True, slots=True)
class WizardSettings:
    """What a person has chosen.

    Attributes:
        count: poses about a point, contacts, or pictures; 0: the usual number.
        surface: that the tip touches: plane:X,Y,Z or sphere:X,Y,Z,RADIUS in the base [m].
        tip_radius: of a round tip [m].
        inertia: measure the inertia of a load, too.
        speed: fraction of each axis' maximum.
        seconds: time of each rest of a load [s].
        camera: number of a camera of this computer, the address of a stream, or "sim".
        frame: where the camera is: "flange" or "base".
        board: that it looks at.
    """

    count: int = 0
    surface: str = "plane:0.6,0,0.2"
    tip_radius: float = 0.0
    inertia: bool = False
    speed: float = 0.1
    seconds: float = 2.0
    camera: str = "0"
    frame: str = "flange"
    board: calibration.Board = field(default_factory=calibration.Board)


@dataclass(frozen=True, slots=True, eq=False)
class WizardStep(Value):
    """Where the wizard is.

    Attributes:
        kind: of the measurement, see `KINDS`; empty: none was begun.
        is_running: it runs.
        asks: what it asks, or is about to move, in words; empty: it waits for nobody.
        done: poses, contacts, rests or pictures so far.
        count: of all; 0: not known yet.
        result: in words; empty: there is none yet.
        is_saved: the result is saved.
        picture: the newest one with the corners that were found, shape (height, width, 3); None: there is none.
    """

    kind: str = ""
    is_running: bool = False
    asks: str = ""
    done: int = 0
    count: int = 0
    result: str = ""
    is_saved: bool = False
    picture: npt.NDArray[np.uint8] | None = None


class Wizard:
    """Measures what is on the flange of one arm, step by step.

    Args:
        arm: connected.
        target: what it is connected to; a saved one gets the results.
        show: shows a plan by a ghost.
        report: shows an error.
    """

    def __init__(
        self,
        arm: Arm,
        target: str,
        *,
        show: Callable[[PlanOutline], object],
        report: Callable[[HeptarmError], object],
    ) -> None:
        self._arm, self._target, self._show, self._report = arm, target, show, report
        self._changed = threading.Condition()
        self._step = WizardStep()
        self._answer: bool | None = None
        self._is_given_up = False
        self._save: Callable[[str, str], object] | None = None

    @property
    def step(self) -> WizardStep:
        """Where it is."""
        return self._step

    def begin(self, kind: str, settings: WizardSettings) -> None:
        """Begin a measurement; returns at once.

        Args:
            kind: see `KINDS`.
            settings: of the measurement.

        Raises:
            ModeConflict: another one runs.
            CommandRejected: a setting that makes no sense.
        """
        word(kind, "kind", tuple(KINDS))
        works = {"poses": self._poses, "touch": self._touch, "load": self._load, "camera": self._camera}
        work = works[kind](settings)
        with self._changed:
            if self._step.is_running:
                raise ModeConflict(
                    "a measurement runs", parameter="kind", hint="finish it, or give it up first"
                )
            self._step, self._answer, self._save = WizardStep(kind, is_running=True), None, None
            self._is_given_up = False
        threading.Thread(target=self._run, args=(work,), name="heptarm-panel-wizard", daemon=True).start()

    def go_on(self) -> None:
        """Answer yes: the arm is there, or may move."""
        self._reply(answer=True)

    def give_up(self) -> None:
        """End the measurement; an arm that moves stops on its path.

        Raises:
            CommandRejected: none runs.
        """
        if not self._step.is_running:
            raise CommandRejected("no measurement runs", parameter="answer", hint="begin one")
        asks = self._step.asks
        self.end()
        if not asks:
            self._arm.stop()

    def end(self) -> None:
        """End the measurement before its next motion; the caller stops what moves now."""
        with self._changed:
            if self._step.is_running:
                self._is_given_up, self._answer = True, False
                self._changed.notify_all()

    def close(self) -> None:
        """Give up what runs."""
        with contextlib.suppress(HeptarmError):
            if self._step.is_running:
                self.give_up()

    def save(self, name: str) -> None:
        """Save the result as a tool or a camera of the saved target.

        Raises:
            CommandRejected: there is no result, or the panel's target is not a saved one.
        """
        if self._save is None:
            raise CommandRejected("nothing is measured yet", parameter="name", hint="begin a measurement")
        if saved_target(self._target) is None:
            raise CommandRejected(
                f"{self._target} is not a saved target, so that nothing can be saved with it",
                parameter="name",
                value=name,
                hint="heptarm targets add NAME ADDRESS, then heptarm panel --target NAME",
            )
        self._save(self._target, name.strip())
        self._put(is_saved=True)

    def _reply(self, *, answer: bool) -> None:
        with self._changed:
            if not self._step.asks:
                raise CommandRejected("the wizard asks nothing now", parameter="answer", hint="wait for it")
            self._answer = answer
            self._changed.notify_all()

    def _put(self, **changes: Any) -> None:
        with self._changed:
            self._step = replace(self._step, **changes)

    def _ask(self, what: object) -> bool:
        """Show what is asked or planned, and wait for the answer."""
        if isinstance(what, (calibration.LoadPlan, calibration.TouchPlan, calibration.HandEyePlan)):
            self._show(self._arm.plan(list(what.motions), speed=what.speed, step=0.05).outline())
        with self._changed:
            self._check()
            self._step, self._answer = replace(self._step, asks=str(what)), None
            self._changed.wait_for(lambda: self._answer is not None)
            self._step = replace(self._step, asks="")
            return bool(self._answer)

    def _check(self) -> None:
        """Called between motions: the arm rests, so that a stop there ends no motion.

        Raises:
            CommandRejected: the measurement was given up.
        """
        if self._is_given_up:
            raise CommandRejected(
                "the measurement was given up, nothing moves any more", hint="begin it again"
            )

    def _advance(self, done: int, count: int) -> None:
        self._check()
        self._put(done=done, count=count)

    def _run(self, work: Callable[[], Any]) -> None:
        try:
            with measuring(self._arm):
                found = work()
        except HeptarmError as error:
            self._report(error)
        else:
            self._save = self._saver(found)
            self._put(result=str(found))
        finally:
            self._put(is_running=False, asks="")

    def _saver(self, found: Any) -> Callable[[str, str], object]:
        if isinstance(found, calibration.HandEyeEstimate):
            return found.save
        return lambda target, name: found.save(target, self._arm.tools.get(name, name))

    # ------------------------------------------------------------------------------- what is measured

    def _poses(self, settings: WizardSettings) -> Callable[[], Any]:
        count = settings.count or 6

        def confirm(text: str) -> bool:
            self._put(count=count)
            is_there = self._ask(text)
            self._put(done=self._step.done + is_there)
            return is_there

        return lambda: calibration.tcp(calibration.record_poses(self._arm, count=count, confirm=confirm))

    def _touch(self, settings: WizardSettings) -> Callable[[], Any]:
        surface = calibration.KnownSurface.parse(settings.surface)
        how: dict[str, Any] = {"touches": settings.count} if settings.count else {}

        def work() -> calibration.TcpEstimate:
            plan = calibration.touch_plan(
                self._arm, surface, tip_radius=settings.tip_radius, speed=settings.speed, **how
            )
            return calibration.touch_tcp(self._arm, plan=plan, confirm=self._ask, progress=self._advance)

        return work

    def _load(self, settings: WizardSettings) -> Callable[[], Any]:
        def work() -> calibration.IdentifiedLoad:
            plan = calibration.load_plan(
                self._arm,
                excitation="full" if settings.inertia else "rests",
                speed=settings.speed,
                seconds=settings.seconds,
            )
            return calibration.load(self._arm, plan=plan, confirm=self._ask, progress=self._advance)

        return work

    def _camera(self, settings: WizardSettings) -> Callable[[], Any]:
        how: dict[str, Any] = {"views": settings.count} if settings.count else {}
        is_simulated = settings.camera.strip() == "sim"
        source: Any = _SIMULATED if is_simulated else opened_camera(settings.camera.strip())
        own: dict[str, Any] = {} if is_simulated else {"frame": settings.frame}

        def work() -> calibration.HandEyeEstimate:
            with closing(self._arm.camera(source, **own)) as camera:
                return calibration.hand_eye(
                    self._arm,
                    camera,
                    settings.board,
                    speed=settings.speed,
                    confirm=self._ask,
                    progress=self._advance,
                    on_picture=self._see,
                    **how,
                )

        return work

    def _see(self, pixels: npt.NDArray[np.uint8], sighting: calibration.Sighting | None) -> None:
        """Show a picture with the corners that were found in it."""
        self._check()
        shown = np.array(pixels if pixels.ndim == 3 else np.repeat(pixels[:, :, None], 3, axis=2))
        for u, v in () if sighting is None else np.rint(sighting.pixels).astype(int):
            shown[max(v - _MARK, 0) : v + _MARK + 1, max(u - _MARK, 0) : u + _MARK + 1] = (255, 107, 10)
        self._put(picture=shown)
