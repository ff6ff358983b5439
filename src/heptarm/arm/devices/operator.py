"""The operator of a private simulator, played by the program that started it."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

import numpy.typing as npt

from heptarm.arm.link.local_simulator import PrivateCabinet
from heptarm.errors import CommandRejected
from heptarm.values.checks import array, finite, instance, integer, within, word
from heptarm.values.frames import check_name, check_printable
from heptarm.values.pose import Pose, check_pose
from heptarm.values.sealed import Sealed

Fault: TypeAlias = Literal[
    "emergency_stop",
    "external_emergency_stop",
    "operator_safety",
    "protective_stop",
    "drive_error",
    "joint_limit",
    "singularity",
]


class Operator(Sealed):
    """Does to a private simulator what a person beside the robot does; `Arm.operator`.

    The terminal of `heptarm sim` takes the same commands as `do`.
    """

    def __init__(self, cabinet: PrivateCabinet) -> None:
        self._cabinet = cabinet

    def do(self, words: str) -> str:
        """Carry out a command such as "push 0 0 -20 1.5", or at a time of the simulator's clock: "emergency_stop@12.5".

        Returns:
            What it shows; "" if it shows nothing.

        Raises:
            ShapeError: the text cannot be printed.
            CommandRejected: there is no such command; the text lists them.
        """
        check_printable(instance(words, str, "words"), "words", lines=True)
        error, shown = self._cabinet.operate(words)
        if error:
            raise CommandRejected(error, parameter="words", value=words)
        return shown

    def where(self, body: str) -> Pose:
        """Look where a body of the simulator's scene is: its pose in the base.

        Raises:
            CommandRejected: the scene has no such body; the text lists them.
        """
        x, y, z, *quat = (float(part) for part in self.do(f"where {check_name(body, 'body')}").split())
        return Pose.of((x, y, z), quat)

    def place(self, body: str, pose: Pose) -> None:
        """Place a free body of the simulator's scene at rest, at a pose in the base; it falls or collides from there.

        Raises:
            CommandRejected: the scene has no such body, or it is fixed; the text lists those that can be placed.
        """
        check_name(body, "body")
        check_pose(pose)
        self.do(" ".join(["place", body, *(f"{value:.9f}" for value in (*pose.xyz, *pose.quat))]))

    def reset(self) -> None:
        """Put all free bodies of the scene back where they were at the start, at rest. The arm stays."""
        self.do("reset")

    def fault(
        self,
        name: Fault,
    ) -> None:
        """Inject a fault; stops stay active until `clear`."""
        self.do(word(name, "name", get_args(Fault)))

    def clear(self, name: str = "") -> None:
        """End a stop and acknowledge it; all of them without a name. Execution stays paused."""
        self.do(f"clear {instance(name, str, 'name')}")

    def hold(self) -> None:
        """Hold the enabling switch."""
        self.do("enable")

    def release(self) -> None:
        """Release the enabling switch."""
        self.do("release")

    def guide(self) -> None:
        """Hold the enabling switch of the hand guiding device."""
        self.do("guide")

    def let_go(self) -> None:
        """Release the enabling switch of the hand guiding device."""
        self.do("let_go")

    def choose(self, mode: Literal["t1", "t2", "aut"]) -> None:
        """Choose the operation mode."""
        self.do(word(mode, "mode", ("t1", "t2", "aut")))

    def override(self, factor: float) -> None:
        """Set the override at the smartPAD, [0, 1]; it multiplies the application override."""
        self.do(f"override {within(factor, 'factor', 0.0, 1.0)!r}")

    def start(self) -> None:
        """Press Start: execution resumes."""
        self.do("start")

    def set_signal(self, name: str, value: bool | float) -> None:
        """Set a signal of the cabinet, as the wiring does with an input.

        Raises:
            CommandRejected: there is no signal of that name.
        """
        check_name(name, "name")
        text = str(value).lower() if isinstance(value, bool) else repr(finite(value, "value"))
        self.do(f"set {name} {text}")

    def press_key(self, slot: int, *, bar: str = "client") -> None:
        """Press and release a user key.

        Args:
            slot: 0 to 3.
            bar: "client": the keys that programs set; "heptarm": stop (0) and release (1).

        Raises:
            CommandRejected: there is no such key, or it is disabled.
        """
        self.do(f"press {integer(slot, 'slot', 0, 3)} {instance(bar, str, 'bar')}")

    def answer(self, button: int) -> None:
        """Press a button of the dialog that the smartPAD shows, from 0.

        Raises:
            CommandRejected: it shows no dialog, or one without that button.
        """
        self.do(f"answer {integer(button, 'button', 0, 11)}")

    def start_push(self, force: npt.ArrayLike, *, duration: float) -> None:
        """Push the flange from now on; returns at once, and replaces the push before it.

        Args:
            force: in the base axes, shape (3,) [N].
            duration: time for which it acts [s].
        """
        x, y, z = array(force, 3, "force").tolist()
        self.do(f"push {x!r} {y!r} {z!r} {within(duration, 'duration', 0.0, 1e6, unit='s')!r}")
