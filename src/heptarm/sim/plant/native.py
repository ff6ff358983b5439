"""The arithmetic of a tick, in C: position control, sensors, supervision of the drives, and the published state."""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Iterable
from dataclasses import fields
from typing import Any

import mujoco
import numpy as np

from heptarm._library import Unavailable, library
from heptarm.model.native import constants
from heptarm.planning.seam import SLOTS, TICK_NS, HeaderWords, StateWords
from heptarm.planning.table import Cursor, MotionTable
from heptarm.sim.controller.setpoints import SetPoints
from heptarm.sim.plant.arm_vectors import ArmVectors
from heptarm.sim.plant.shared_state import SharedState
from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel

AXES = 7
#: What the functions return.
DONE, LOADED, STRAINED, ELSEWHERE = range(4)

#: MuJoCo's functions that a tick calls, and the members of `struct tick` that point to them.
_CALLED = {"mj_step1": "step1", "mj_step2": "step2", "mj_mulM": "multiply"}
_WORD, _REAL, _POINTER = ctypes.c_int64, ctypes.c_double, ctypes.c_void_p
#: `struct tick` of tick.c, whose header schema/generate.py writes from this table: kind, size (0: a scalar), names.
STRUCT: tuple[tuple[str, int, str], ...] = (
    ("words", 0, "memory"),
    # MuJoCo's vectors of the arm; those of the controller's model; what the sensors show
    (
        "reals",
        0,
        "q dq acceleration bias passive applied constraint pulled actuators mass armature ranges shown gains",
    ),
    # what a tick computes
    ("reals", 0, "torque tau_cmd tau load wrench"),
    ("word", 0, "stride pulls is_misjudged flags mode order left is_awaited"),
    # the running motion: its table, where it is in that, how far its time and an axis come in a tick; where the part
    # begins and ends whose progress is shown, and where the next one begins
    ("table", 0, "table"),
    ("cursor", 0, "cursor"),
    ("reals", 0, "leap"),
    ("real", 0, "step part_begin part_end mark"),
    ("real", AXES, "most"),
    ("real", 3 * AXES, "points"),
    # `struct arm` of the robot; MuJoCo's model and state, its functions, and vectors of all its degrees of freedom
    ("address", 0, "arm model data"),
    ("step", 0, "step1 step2"),
    ("product", 0, "multiply"),
    ("reals", 0, "vector product"),
)
_TYPES: dict[str, Any] = {"word": _WORD, "real": _REAL, "cursor": Cursor}
_WORDS = "SEQ TIME FLAGS MODE ORDER PROGRESS REMAINING E1 STATUS TURN"
_SLICES = "Q Q_CMD DQ TAU TAU_EXT TAU_CMD POSE WRENCH"


class _Memory(ctypes.Structure):
    """`struct tick` of tick.c."""

    _fields_ = tuple(
        (name, _TYPES[kind] * size if size else _TYPES.get(kind, _POINTER))
        for kind, size, names in STRUCT
        for name in names.split()
    )


#: Constants of tick.c.
CONSTANTS: dict[str, int] = {
    "DONE": DONE,
    "LOADED": LOADED,
    "STRAINED": STRAINED,
    "ELSEWHERE": ELSEWHERE,
    "SLOTS": SLOTS,
    "TICK_NS": TICK_NS,
    "HEADER": HeaderWords.SECTION.start,
    "NEWEST": HeaderWords.NEWEST,
    "WAKE_AT": HeaderWords.WAKE,
    "STATES": StateWords.SECTION.start,
    "SIZE": StateWords.SIZE,
    **{name: getattr(StateWords, name) for name in _WORDS.split()},
    **{name: getattr(StateWords, name).start for name in _SLICES.split()},
}


def mujoco_library(names: Iterable[str]) -> ctypes.CDLL:
    """MuJoCo's library, in which its module for Python has its functions.

    Args:
        names: of what it has to show.

    Raises:
        Unavailable: it does not show all of them.
    """
    library = ctypes.CDLL(mujoco._functions.__file__)
    missing = [name for name in names if not hasattr(library, name)]
    if missing:
        raise Unavailable(f"MuJoCo {mujoco.__version__} shows no {', '.join(missing)}")
    return library


@functools.cache
def tick_library() -> ctypes.CDLL:
    """Load the functions; MuJoCo's profiler is off from then on, unless the program has given it a clock.

    Raises:
        Unavailable: the compiled part of heptarm is missing, or this MuJoCo does not show its functions.
    """
    made = library(holds_gil=True)
    made.ht_size.restype = made.ht_sense.restype = made.ht_strained.restype = _WORD
    made.ht_write.restype, made.ht_publish.restype = None, _WORD
    made.ht_command.argtypes = made.ht_drive.argtypes = made.ht_sense.argtypes = (_POINTER,)
    made.ht_command.restype = made.ht_drive.restype = None
    made.ht_strained.argtypes = (_POINTER, _WORD)
    made.ht_write.argtypes = (_POINTER, _WORD, _REAL, _REAL)
    made.ht_tick.restype, made.ht_tick.argtypes = _WORD, made.ht_write.argtypes
    made.ht_publish.argtypes = (_POINTER, _WORD)
    made.ht_put.argtypes, made.ht_put.restype = (_POINTER, _REAL), None
    made.ht_follow.restype, made.ht_follow.argtypes = _WORD, (_POINTER, _WORD, _WORD)
    if made.ht_size() != ctypes.sizeof(_Memory):
        raise Unavailable(f"`struct tick` must have {ctypes.sizeof(_Memory)} bytes, got {made.ht_size()}")
    if mujoco.get_mjcb_time() is None:
        clock = _POINTER.in_dll(mujoco_library(["mjcb_time"]), "mjcb_time")
        clock.value = ctypes.cast(made.ht_no_clock, _POINTER).value
    return made


class NativeTick:
    """The arithmetic of the ticks of one plant.

    Args:
        robot: the robot.
        model: MuJoCo's model.
        data: its state.
        shared: where the states are published.
        arm: its vectors; they stay where they are.
        gains: of position control, see `position_gains`.
        ranges: of the drives' supervision, see `DriveMonitor`; None: it is off.

    Raises:
        Unavailable: the compiled part of heptarm is missing, or this MuJoCo does not show its functions.
    """

    def __init__(
        self,
        robot: RobotModel,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        shared: SharedState,
        arm: ArmVectors,
        *,
        gains: Array,
        ranges: Array | None,
    ) -> None:
        library = tick_library()
        self._command, self._drive, self._sense = library.ht_command, library.ht_drive, library.ht_sense
        self._strained, self._write, self._publish = library.ht_strained, library.ht_write, library.ht_publish
        self._tick, self._put, self._follow = library.ht_tick, library.ht_put, library.ht_follow
        self._memory = memory = _Memory()
        self._table: MotionTable | None = None
        self._words = (0, 0, 0)
        self._at = ctypes.addressof(memory)
        numbers, vector, product = constants(robot), np.zeros(model.nv), np.zeros(model.nv)
        self._kept = (model, data, shared, ranges, arm, gains, numbers, vector, product)
        memory.model, memory.data = model._address, data._address
        functions = mujoco_library(_CALLED)
        for name, member in _CALLED.items():
            setattr(memory, member, ctypes.cast(getattr(functions, name), _POINTER).value)
        memory.memory = shared.header.ctypes.data - 8 * HeaderWords.SECTION.start
        for field in fields(arm):
            setattr(memory, field.name, getattr(arm, field.name).ctypes.data)
        memory.vector, memory.product = vector.ctypes.data, product.ctypes.data
        memory.pulls = arm.pulled.size
        if ranges is not None:
            memory.ranges = ranges.ctypes.data
        memory.arm = ctypes.cast(numbers, _POINTER).value
        memory.gains = gains.ctypes.data
        memory.most[:] = robot.tau_max.tolist()
        self._points = np.frombuffer(memory.points).reshape(3, AXES)

    def believe(self, mass: Array, bias: Array, *, is_misjudged: bool) -> None:
        """Set where the controller's model is: inertia matrix of shape (7, 7), and its torques of shape (7,)."""
        memory, self._model = self._memory, (mass, bias)
        memory.mass, memory.stride, memory.bias = mass.ctypes.data, mass.strides[0] // 8, bias.ctypes.data
        memory.is_misjudged = is_misjudged

    def tick(
        self,
        tick: int,
        points: SetPoints,
        *,
        words: tuple[int, int, int],
        times: tuple[float, float],
    ) -> int:
        """Compute a tick of an arm in position control: dynamics, sensors, supervision of the drives, written state.

        Args:
            tick: see `write`, as the next two.
            points: set-points.
            words: flags, mode and order.
            times: progress and remaining time.

        Returns:
            `DONE`, or what is left to do: `ELSEWHERE`: all of it; `LOADED`: from the wrench on; `STRAINED`: from the
            supervision of the drives on.
        """
        rows = self._points
        rows[0], rows[1], rows[2] = points.before, points.now, points.after
        if words != self._words:
            self._show(words)
        left: int = self._tick(self._at, tick, times[0], times[1])
        return left

    def prepare(
        self,
        points: SetPoints,
        table: MotionTable,
        *,
        time: float,
        step: float,
        part: tuple[float, float, float],
    ) -> None:
        """Prepare `follow`; any other tick in between undoes that.

        Args:
            points: set-points so far.
            table: of the motion.
            time: of the motion [s].
            step: by which it grows in each tick [s].
            part: path parameters where the part begins and ends whose progress is shown, and where the next one begins.
        """
        memory, rows = self._memory, self._points
        rows[0], rows[1], rows[2] = points.before, points.now, points.after
        memory.part_begin, memory.part_end, memory.mark = part
        memory.table, memory.step, memory.leap = table.address, step, points.largest_step.ctypes.data
        self._table = table  # stays where it is meanwhile
        self._put(self._at, time)

    def follow(self, tick: int, count: int) -> int:
        """Compute and publish ticks of a motion until somebody waits for the state of one, or another part begins.

        Args:
            tick: number of the first one.
            count: of ticks at most.

        Returns:
            How many are done. Then `left` is what is left to do of the next one, as `tick` returns it; `DONE`: it
            has not begun, and may have no such set-point.
        """
        done: int = self._follow(self._at, tick, count)
        return done

    @property
    def left(self) -> int:
        """What is left to do of the tick after those that `follow` has done."""
        return int(self._memory.left)

    @property
    def is_awaited(self) -> bool:
        """Whether somebody waits for the last state that `follow` has published."""
        return bool(self._memory.is_awaited)

    @property
    def where(self) -> tuple[float, float]:
        """Time [s] and path parameter of the motion after `follow`."""
        cursor = self._memory.cursor
        return cursor.time, cursor.place

    @property
    def points(self) -> Array:
        """Set-points of the last, this and the next tick, shape (3, 7) [rad]; a copy."""
        return self._points.copy()

    def _show(self, words: tuple[int, int, int]) -> None:
        """Set flags, mode and order of the states to come."""
        memory, self._words = self._memory, words
        memory.flags, memory.mode, memory.order = words

    def command(self, points: SetPoints) -> None:
        """Position control without a preload: compute the torques of the motors, and `drive` them."""
        rows = self._points
        rows[0], rows[1], rows[2] = points.before, points.now, points.after
        self._command(self._at)

    def drive(self) -> None:
        """Let the motors exert `torque`, as far as they can."""
        self._drive(self._at)

    def sense(self) -> bool:
        """Torques at the sensors and external load, after the dynamics; returns whether there is a load."""
        return bool(self._sense(self._at))

    def strained(self, after: Array, *, is_stiff: bool) -> bool:
        """Whether a drive has to be looked at; `after`: set-point of the next tick, shape (7,) [rad]."""
        self._points[2] = after
        return bool(self._strained(self._at, is_stiff))

    def write(
        self,
        tick: int,
        after: Array,
        *,
        words: tuple[int, int, int],
        times: tuple[float, float],
    ) -> None:
        """Write the state of a tick into the shared memory; readers see it after `publish`.

        Args:
            tick: its number.
            after: the set-point of the next tick, shape (7,) [rad].
            words: flags, mode and order.
            times: progress and remaining time.
        """
        self._points[2] = after
        if words != self._words:
            self._show(words)
        self._write(self._at, tick, *times)

    def publish(self, tick: int) -> bool:
        """Let readers see the state of a tick that was written; returns whether one waits for it."""
        return bool(self._publish(self._at, tick))
