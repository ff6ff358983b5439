"""Tools, workpieces and frames of an arm."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Iterator

from heptarm.arm.connection import Connection
from heptarm.arm.tooling import Tooling
from heptarm.errors import HeptarmError
from heptarm.values.motion import TOOL
from heptarm.values.pose import Pose
from heptarm.values.state import State, Wrench
from heptarm.values.tool import BASE, KnownTool, Tool, Workpiece

_log = logging.getLogger("heptarm.arm")

#: How long to wait, after an error, for an arm whose tool is to change [s].
_PATIENCE = 5.0


class Equipment:
    """The part of an arm that has to do with what hangs on its flange.

    What was attached stays attached, also when the client goes: it does hang there.
    """

    _connection: Connection
    _tooling: Tooling
    wait_for_rest: Callable[..., State]

    @property
    def tools(self) -> dict[str, KnownTool]:
        """Tools that can be attached by name: of the project as far as it names them, and defined ones."""
        return self._tooling.known

    @property
    def frames(self) -> dict[str, Pose]:
        """Taught frames of the project by name, in the base frame."""
        return self._tooling.taught

    def attach_tool(self, tool: Tool | str, *, frame: str | None = None) -> None:
        """Tell the cabinet what hangs on the flange, in place of another tool; the arm has to be at rest.

        On a robot a person mounts the tool; this is the load that the controller reckons with, and the frame that
        motions, poses and wrenches refer to. In a simulator it hangs there from now on.

        Args:
            tool: what it is, or the name of a template of the project or of a tool defined before.
            frame: the one of its frames that motions move unless they say another; None: its first.

        Raises:
            CommandRejected: no tool or frame of that name; the text lists them.
            ModeConflict: something runs.
        """
        self._tooling.attach(tool, frame)

    def detach_tool(self) -> None:
        """Tell the cabinet that nothing hangs on the flange; a workpiece goes with its tool.

        Raises:
            ModeConflict: something runs.
        """
        self._tooling.detach()

    def attach_workpiece(self, workpiece: Workpiece) -> None:
        """Tell the cabinet what the tool holds, in the frame that motions move; the arm has to be at rest.

        Raises:
            ModeConflict: something runs, or a workpiece is attached already.
        """
        self._tooling.load(workpiece)

    def detach_workpiece(self, workpiece: Workpiece) -> None:
        """Tell the cabinet that the tool does not hold it any more.

        Raises:
            CommandRejected: it does not hold it.
            ModeConflict: something runs.
        """
        self._tooling.unload(workpiece)

    @contextlib.contextmanager
    def tool(self, tool: Tool | str, *, frame: str | None = None) -> Iterator[None]:
        """A block in which a tool is attached; then the one before it is again. See `attach_tool`."""
        before = self._tooling.fitted
        self.attach_tool(tool, frame=frame)
        with self._finally(lambda: self._tooling.restore(before)):
            yield

    @contextlib.contextmanager
    def attached(self, workpiece: Workpiece) -> Iterator[None]:
        """A block in which the tool holds a workpiece. See `attach_workpiece`."""
        self.attach_workpiece(workpiece)
        with self._finally(lambda: self.detach_workpiece(workpiece)):
            yield

    @contextlib.contextmanager
    def _finally(self, undo: Callable[[], None]) -> Iterator[None]:
        """A block after which something is undone; after an error that must not hide the error."""
        try:
            yield
        except BaseException:
            try:
                self.wait_for_rest(timeout=_PATIENCE)
                undo()
            except HeptarmError as error:
                _log.warning("what hangs on the flange did not change: %s", error)
            raise
        undo()

    # ------------------------------------------------------------------------------------ frames

    def pose(self, frame: str = TOOL, *, reference: str = BASE) -> Pose:
        """Pose of a frame as seen from another, from the newest state.

        Args:
            frame: "tool" (what motions move), "flange", "base", a taught frame, or one of the tool's or workpiece's.
            reference: likewise.

        Raises:
            CommandRejected: no such frame is known here; the text lists them.
            StaleState: as `state`.
        """
        state: State = self.state  # type: ignore[attr-defined]
        seen = self._tooling.pose(state, frame)
        return seen if reference == BASE else self._tooling.pose(state, reference).inverse() @ seen

    def wrench(self, frame: str = TOOL, *, axes: str = BASE) -> Wrench:
        """External force and torque at the origin of a frame, from the newest state.

        Args:
            frame: "tool" (what motions move), "flange", or one of the tool's or workpiece's.
            axes: whose axes the numbers are in: the same names, "base", or a taught frame.

        Raises:
            CommandRejected: no such frame is known here; the text lists them.
            StaleState: as `state`.
        """
        state: State = self.state  # type: ignore[attr-defined]
        return self._tooling.wrench(state, frame, axes)
