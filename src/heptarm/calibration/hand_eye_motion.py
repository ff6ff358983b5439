"""Hand-eye calibration with the arm: from where it sees the board, which postures it chooses, its motions, its views.

Small turns of the flange come first, from which camera and board are known roughly. Then postures are chosen in which
the camera sees the whole board, and which together determine most (a D-optimal choice, Fedorov, 1972).
"""

from __future__ import annotations

import itertools
import logging
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from heptarm.arm.devices.camera import CameraStream
from heptarm.arm.verbs import ArmVerbs
from heptarm.calibration.board import Board, Sighting
from heptarm.calibration.hand_eye_estimate import (
    FEWEST_REFINED,
    HandEyeEstimate,
    HandEyeModel,
    HandEyeView,
    board_pose,
    estimate_hand_eye,
    first_matrix,
    roughly_estimated,
)
from heptarm.calibration.proposal import agree, box_text, flange_box, swings, unhindered
from heptarm.errors import CommandRejected, MissingExtra, NoPath, OutsideWorkspace, Unreachable
from heptarm.model.inverse_kinematics import solve
from heptarm.model.kinematics import forward
from heptarm.values.camera import intrinsic
from heptarm.values.checks import Array, Value, frozen, instance, integer, within
from heptarm.values.clearance import CollisionWorld
from heptarm.values.mode.mode import Position
from heptarm.values.motion.motion import Motion
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel
from heptarm.values.text import lines

_log = logging.getLogger("heptarm.calibration")

#: Default number of views, and of the speed as a fraction of each axis' maximum.
VIEWS, SPEED = 14, 0.2
#: First turns of the flange, about its axes [rad].
_FIRST = math.radians(12.0) * np.concatenate([np.eye(3), -np.eye(3)])
#: Tilts of the board in the picture [rad], their directions, rolls [rad], and distances as a part of the present one.
_TILTS, _DIRECTIONS, _ROLLS, _DISTANCES = np.radians((0, 18, 33)), 6, np.radians((-50, 0, 50)), (0.85, 1.1)
#: Margin of the pictures in which the board must not be, as a part of their size.
_MARGIN = 0.03
#: Room that is left to the limits of the joints, and the farthest that a joint moves from the start [rad].
_ROOM, _FARTHEST = math.radians(3.0), math.radians(110.0)
#: Prior knowledge that makes the first choices possible, in the inverse squares of the parameters' units.
_PRIOR = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class HandEyePlan(Value):
    """What moves when a camera is measured; it has not moved yet.

    Attributes:
        robot: the robot.
        purpose: of these motions.
        postures: joint positions in which pictures are taken, then the first posture again, shape (n, 7) [rad].
        speed: fraction of each axis' maximum.
        low: lowest coordinates of the flange in the postures, base frame, shape (3,) [m].
        high: highest ones, shape (3,) [m].
    """

    robot: RobotModel
    purpose: str
    postures: Array
    speed: float
    low: Array
    high: Array

    @staticmethod
    def of(robot: RobotModel, purpose: str, postures: Sequence[Array], speed: float) -> HandEyePlan:
        """A plan of postures."""
        return HandEyePlan(robot, purpose, frozen(np.array(postures)), speed, *flange_box(robot, postures))

    @property
    def motions(self) -> tuple[Motion, ...]:
        """The motions, if they are PTP."""
        return tuple(ptp(q) for q in self.postures)

    def __str__(self) -> str:
        """What moves, how far and how fast."""
        rows = {
            "moves": f"{swings(self.postures, self.postures[-1])} deg",
            "flange": f"in the postures {box_text(self.low, self.high)}",
            "speed": f"at most {self.speed:.0%} of each axis' maximum",
            "postures": f"{len(self.postures) - 1}, and back",
        }
        return lines(f"{self.purpose}, with the {self.robot.title}", rows)


def hand_eye(
    arm: ArmVerbs,
    camera: CameraStream,
    board: Board,
    *,
    views: int = VIEWS,
    speed: float = SPEED,
    avoid: CollisionWorld | None = None,
    matrix: npt.ArrayLike | None = None,
    distortion: npt.ArrayLike | None = None,
    refine: bool | None = None,
    confirm: Callable[[HandEyePlan], bool] | None = None,
    progress: Callable[[int, int], object] | None = None,
    on_picture: Callable[[npt.NDArray[np.uint8], Sighting | None], object] | None = None,
) -> HandEyeEstimate:
    """Measure where a camera is, on the flange or beside the arm. The arm moves, and returns.

    Begin where the camera sees the whole board, from the front, as large as it may become. What moves is logged, and
    shown to `confirm`, before it moves: first small turns of the flange, then the postures that were chosen. Each
    motion is planned before, as `arm.plan` does, within `arm.workspace`; a posture on whose path `arm.collision_check`
    finds bodies that would touch is left out.

    Args:
        arm: in control, at rest, in position control.
        camera: from `arm.camera(...)`, which knows whether it is on the flange or in the base.
        board: stands still; if the camera is in the base, it is on the flange.
        views: number of postures in which pictures are taken, with the first ones.
        speed: ceiling, (0, 1]; the lower one of this and `arm.speed`.
        avoid: model of the bodies, around which paths are found; None: the motions are PTP.
        matrix: see `estimate_hand_eye`; None: that of the camera.
        distortion: see `estimate_hand_eye`; None: that of the camera.
        refine: see `estimate_hand_eye`.
        confirm: called with each plan; nothing moves unless it returns true. None: it moves.
        progress: called after each picture with the board in it with their number and that of all.
        on_picture: called with each picture and what was found in it; None: the board is not seen.

    Raises:
        CommandRejected: the camera does not see the board; it was not confirmed; too few postures can be reached; the
            views do not determine the camera.
        MotionAborted: a stop or an error ended it. Others as `arm.move` and `CameraStream.read`.
        MissingExtra: OpenCV or SciPy is not installed.
    """
    wanted = integer(views, "views", FEWEST_REFINED + 1, 200)
    limit = min(within(speed, "speed", 0.0, 1.0, above=True), arm.speed)
    instance(board, Board, "board")
    known = (
        instance(camera, CameraStream, "camera", hint="arm.camera(...)").matrix if matrix is None else matrix
    )

    def note(pixels: npt.NDArray[np.uint8], sighting: Sighting | None) -> None:
        if on_picture is not None:
            on_picture(pixels, sighting)
        if progress is not None and sighting is not None:
            progress(len(seen.views), wanted)

    seen = _Viewer(arm, camera, board, note)
    start = arm.wait_for_rest().q_cmd
    seen.look()
    if not seen.views:
        raise CommandRejected(
            f"the camera does not see the board from here: too few corners of the {board} are found in its picture",
            parameter="board",
            hint="move the arm until the whole board is in the picture, in focus and bright, with the right side up; "
            "check columns, rows and kind",
        )
    mover = _Mover(arm, limit, avoid, confirm)
    flange = Pose.from_matrix(forward(arm.robot, start))
    turned = (flange @ Pose.from_rotvec((0, 0, 0), turn) for turn in _FIRST)
    mover.visit(
        "Look at the board from about here", list(_reached(arm.robot, turned, start)), start, seen.look
    )
    lens = camera.distortion if distortion is None else distortion
    options = {"frame": camera.frame, "distortion": lens}
    if len(seen.views) < wanted:
        rough_lens = first_matrix(seen.views) if known is None else intrinsic(known)
        # a lens that is not known bends the few pictures so far; they show where to look from all the same
        rough = roughly_estimated(seen.views, matrix=rough_lens, refine=False, **options)  # type: ignore[arg-type]
        chosen = _chosen(arm.robot, seen.views, rough, board, start, wanted - len(seen.views))
        mover.visit("Look at the board from all sides", chosen, start, seen.look)
    return estimate_hand_eye(seen.views, matrix=known, refine=refine, **options)  # type: ignore[arg-type]


class _Viewer:
    """Takes pictures of a resting arm, and keeps those in which the board is seen."""

    def __init__(
        self,
        arm: ArmVerbs,
        camera: CameraStream,
        board: Board,
        note: Callable[[npt.NDArray[np.uint8], Sighting | None], object],
    ) -> None:
        self._arm, self._camera, self._board = arm, camera, board
        self._note = note
        self.views: list[HandEyeView] = []

    def look(self) -> None:
        """Take a picture."""
        picture = self._camera.read(after=self._arm.wait_for_rest().stamp, timeout=30.0)
        sighting = self._board.find(picture.pixels)
        if sighting is not None:
            self.views.append(HandEyeView(picture.flange, sighting))
        self._note(picture.pixels, sighting)
        _log.info("view %d: %d corners", len(self.views), 0 if sighting is None else len(sighting))


class _Mover:
    """Moves to postures that were checked and confirmed.

    Args:
        arm: the arm.
        speed: ceiling.
        avoid: model of the bodies, around which paths are found; None: the motions are PTP.
        confirm: see `hand_eye`.
    """

    def __init__(
        self,
        arm: ArmVerbs,
        speed: float,
        avoid: CollisionWorld | None,
        confirm: Callable[[HandEyePlan], bool] | None,
    ) -> None:
        self._arm, self._speed, self._avoid = arm, speed, avoid
        self._confirm = confirm

    def visit(self, purpose: str, postures: Sequence[Array], start: Array, look: Callable[[], None]) -> None:
        """Move through postures that can be reached, look from each, and return to the start.

        Raises:
            CommandRejected: none can be reached, or it was not confirmed.
        """
        postures = list(self._passable(postures, start))
        if not postures:
            raise CommandRejected(
                "no posture from which the camera sees the board can be reached",
                parameter="arm",
                hint="begin with more room around the arm, farther from the limits of its joints",
            )
        plan = HandEyePlan.of(self._arm.robot, purpose, [*postures, start], self._speed)
        agree(plan, self._confirm, "measuring the camera")
        for q in postures:
            try:
                motion = self._motion(q)
            except NoPath as error:
                _log.info("a posture is left out: %s", error)
                continue
            with unhindered("the camera"):
                self._arm.move(motion, speed=self._speed, mode=Position())
            look()
        self._arm.move(self._motion(start), speed=self._speed, mode=Position())

    def _motion(self, q: Array) -> Motion:
        if self._avoid is None:
            return ptp(q)
        return self._arm.find_path(q, avoid=self._avoid, speed=self._speed)

    def _passable(self, postures: Sequence[Array], start: Array) -> Iterator[Array]:
        """The postures in an order of short motions, without those to or from which the arm cannot move."""
        left, here = list(postures), start
        while left:
            nearest = min(range(len(left)), key=lambda index: float(np.abs(left[index] - here).max()))
            q = left.pop(nearest)
            if self._is_free(here, q) and self._is_free(q, start):
                yield q
                here = q

    def _is_free(self, begin: Array, end: Array) -> bool:
        if self._avoid is not None:
            return bool(self._avoid.is_free(end, end))
        try:
            preview = self._arm.plan(ptp(end), start=begin, speed=self._speed, mode=Position(), step=0.05)
        except OutsideWorkspace:
            return False
        except MissingExtra:
            if self._arm.workspace is not None or self._arm.collision_check is not None:
                raise
            return True
        return not preview.collisions


def _reached(robot: RobotModel, flanges: Iterator[Pose], start: Array) -> Iterator[Array]:
    """Joint positions of flanges that can be reached from the start without great swings."""
    for flange in flanges:
        try:
            q = solve(robot, flange, near=start)
        except Unreachable:
            continue
        has_room = bool((q > robot.q_min + _ROOM).all() and (q < robot.q_max - _ROOM).all())
        if has_room and np.abs(q - start).max() < _FARTHEST:
            yield q


def _chosen(
    robot: RobotModel,
    views: Sequence[HandEyeView],
    rough: HandEyeEstimate,
    board: Board,
    start: Array,
    count: int,
) -> list[Array]:
    """The postures from which the whole board is seen that determine camera, board and lens best.

    Raises:
        CommandRejected: there are none.
    """
    flanges = (_flange(rough, seen) for seen in _sights(views, rough, board))
    postures = list(_reached(robot, flanges, start))
    guess, parameters = rough.guess, 12 + 6

    def information(flange: Pose) -> Array:
        slopes = HandEyeModel([flange], [board.points], rough.frame).jacobian(guess, parameters)
        flat = slopes.reshape(-1, parameters)
        return np.asarray(flat.T @ flat)

    known = np.add.reduce([information(view.flange) for view in views]) + _PRIOR * np.eye(parameters)
    each = [information(Pose.from_matrix(forward(robot, q))) for q in postures]
    chosen: list[Array] = []
    while postures and len(chosen) < count:
        best = int(np.argmax([np.linalg.slogdet(known + added)[1] for added in each]))
        known = known + each.pop(best)
        chosen.append(postures.pop(best))
    return chosen


def _sights(views: Sequence[HandEyeView], rough: HandEyeEstimate, board: Board) -> Iterator[Pose]:
    """Poses of the board in the camera in which the whole board is in the picture."""
    sighting = views[0].sighting
    present = board_pose(sighting, rough.matrix, rough.distortion)
    distance = float((present @ Pose.at(*board.centre)).xyz[2])
    upright = math.atan2(present.rotation[1, 0], present.rotation[0, 0])
    for tilt, direction, roll, part in itertools.product(_TILTS, range(_DIRECTIONS), _ROLLS, _DISTANCES):
        if not tilt and direction:
            continue
        about = 2.0 * math.pi * direction / _DIRECTIONS
        tilted = Pose.from_rotvec((0, 0, 0), tilt * np.array([math.cos(about), math.sin(about), 0.0]))
        rolled = Pose.from_rotvec((0, 0, 0), (0.0, 0.0, _wrapped(upright + roll)))
        seen = Pose.at(0, 0, part * distance) @ tilted @ rolled @ Pose.at(*-board.centre)
        if _is_inside(board, seen, rough, sighting):
            yield seen


def _wrapped(angle: float) -> float:
    return math.remainder(angle, 2.0 * math.pi)


def _is_inside(board: Board, seen: Pose, rough: HandEyeEstimate, sighting: Sighting) -> bool:
    corners = (board.outline @ seen.rotation.T + seen.xyz) @ rough.matrix.T
    pixels, size = corners[:, :2] / corners[:, 2:], np.array(sighting.size)
    return bool((pixels > _MARGIN * size).all() and (pixels < (1.0 - _MARGIN) * size).all())


def _flange(rough: HandEyeEstimate, seen: Pose) -> Pose:
    """Where the flange is when the camera sees the board like this."""
    if rough.frame == "flange":
        return rough.board @ seen.inverse() @ rough.pose.inverse()
    return rough.pose @ seen @ rough.board.inverse()
