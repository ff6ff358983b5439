"""The client's loop (law, guard, policy, session) and the controller on the simulated arm, on one clock."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

from heptarm.fri.guard.fallback import Missing, Policy
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.cycle import Cycle
from heptarm.fri.loop.settings import Law, LoopSettings
from heptarm.fri.protocol.messages import CommandMode
from heptarm.fri.protocol.version import Version
from heptarm.io.shared import MemoryBlock
from heptarm.planning.seam import TICK_NS
from heptarm.sim.fri.controller_side import Controller
from heptarm.sim.fri.overlay import MotionOverlay, control_mode
from heptarm.sim.fri.sessions import PlantArm
from heptarm.sim.fri.settings import OverlayEnded, SessionConfiguration
from heptarm.sim.plant.plant import Plant, Snapshot
from heptarm.values.checks import Array
from heptarm.values.mode.mode import Mode, Position
from tests.sim_fri.rig import READY, State

#: The client's clock begins here [ns].
EPOCH = 10**12
#: How many ticks late the next datagram arrives; None: never.
Line = Callable[[], int | None]


class Lockstep:
    """A session; each answer arrives half a tick after its message.

    Args:
        law: of the client; None: it takes `command`.
        params: of the law.
        command: what is commanded.
        control: control mode of the hold underneath.
        q: where the arm stands at first, shape (7,) [rad].
        period_ms: of the session.

    Attributes:
        track: the plant after each tick since commands became effective.
        ends: of overlays.
        there: the line of messages.
        back: that of answers.
    """

    def __init__(
        self,
        law: Law | None = None,
        params: Mapping[str, npt.ArrayLike] | None = None,
        *,
        command: CommandMode = CommandMode.POSITION,
        control: Mode | None = None,
        q: tuple[float, ...] = READY,
        period_ms: int = 1,
    ) -> None:
        settings = LoopSettings(law=law, params=params, policy=Policy(Missing.HOLD, patience=1e6), history=64)
        block = MemoryBlock(at.Layout.words(**settings.sizes))
        block.unlink()
        self.layout = at.Layout(block, **settings.sizes)
        self.layout.params.write(settings.law_params[0])
        self.plant = Plant("iiwa14", q=q)
        self.cycle = Cycle(self.layout, settings)
        self.track: list[Snapshot] = []
        self.ends: list[OverlayEnded] = []
        self._arm = PlantArm(self.plant)
        self._controller = Controller(SessionConfiguration(Version.V1_15, period_ms), self.plant.robot)
        self.there: Line = lambda: 0
        self.back: Line = lambda: 0
        self._messages: list[tuple[int, bytes]] = []  # with the tick at which each arrives
        self._answers: list[tuple[int, bytes]] = []
        self._ticks = 0
        self._held: list[bytes] | None = None
        self._controller.open()
        self._until(State.MONITORING_READY)
        control = control or Position()
        self._arm.hold(control)
        self._controller.start(MotionOverlay(command, control_mode(control)))
        self._until(State.COMMANDING_ACTIVE)
        self.start: Array = self.plant.snapshot.q_cmd
        self.track.clear()

    def run(self, seconds: float) -> None:
        """Let time pass."""
        for _ in range(round(seconds * 1e3)):
            self._tick()

    def end(self, manner: str) -> None:
        """End the session: the program leaves its block, the overlay stops, it closes, the client falls silent."""
        if manner == "leave":
            self._arm.release()
        elif manner == "stop":
            self._controller.stop()
        elif manner == "close":
            self._controller.close()
        else:
            self._held = []

    def lose(self, ticks: int) -> None:
        """Let messages get lost."""
        self._held = []
        self.run(ticks * 1e-3)
        self._held = None

    def burst(self, ticks: int) -> None:
        """Hold messages back, then let them arrive together."""
        held: list[bytes] = []
        self._held = held
        self.run(ticks * 1e-3)
        self._held, now = None, self.plant.time_ns
        for datagram in held:
            answer = self.cycle.turn(datagram, EPOCH + now)
            self.cycle.finish(EPOCH + now)
            if answer is not None:
                self._controller.receive(answer, now)

    def command(self, q: npt.ArrayLike) -> None:
        """The command of the user's process, shape (7,) [rad]."""
        words = np.zeros(at.COMMAND_WORDS)
        words[at.C_Q : at.C_Q + 7] = q
        ints = words.view(np.int64)
        ints[at.C_AT : at.C_GIVEN + 1] = EPOCH + self.plant.time_ns, at.GIVEN_Q
        ints[at.C_EPOCH] = self.layout.header[at.EPOCH]
        self.layout.commands.write(words[1:])

    @property
    def limited(self) -> list[str]:
        """What the guard has limited, as text."""
        return at.report_lines(self.layout)

    def _until(self, state: State) -> None:
        for _ in range(3000):
            if self._controller.state is state:
                return
            self._tick()
        raise AssertionError(f"{self._controller.state.name} instead of {state.name}")

    def _tick(self) -> None:
        plant, controller, now = self.plant, self._controller, self.plant.time_ns
        self._ticks += 1
        for answer in _arrived(self._answers, self._ticks):
            controller.receive(answer, now - TICK_NS // 2)
        datagram = controller.tick(self._arm.reading(), now)
        self._arm.overlay(controller.superposition)
        for event in controller.events():
            if isinstance(event, OverlayEnded):
                self.ends.append(event)
                self._arm.release()
        plant.tick()
        self.track.append(plant.snapshot)
        if datagram is not None and self._held is not None:
            self._held.append(datagram)
        elif datagram is not None:
            _send(self._messages, datagram, self._ticks, self.there())
        for message in _arrived(self._messages, self._ticks):
            answer_now = self.cycle.turn(message, EPOCH + now)
            self.cycle.finish(EPOCH + now + TICK_NS // 20)
            if answer_now is not None:
                _send(self._answers, answer_now, self._ticks + 1, self.back())


def _send(line: list[tuple[int, bytes]], datagram: bytes, tick: int, late: int | None) -> None:
    if late is not None:
        line.append((tick + late, datagram))


def _arrived(line: list[tuple[int, bytes]], tick: int) -> list[bytes]:
    """Take what has arrived, in the order of its arrival."""
    here = sorted((one for one in line if one[0] <= tick), key=lambda one: one[0])
    line[:] = [one for one in line if one[0] > tick]
    return [datagram for _, datagram in here]
