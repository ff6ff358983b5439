"""Hand-eye calibration from views: where a camera is, on the flange or beside the arm, from sightings of a board.

First each view's pose of the board by OpenCV's perspective-n-point; then A X = X B in closed form (Park, Martin, "Robot
sensor calibration: solving AX = XB on the Euclidean group", 1994); then least squares of the distances in the pictures
over camera, board and, if asked for, focal lengths, centre and distortion (Tabb, Ahmad Yousef, "Solving the robot-world
hand-eye(s) calibration problem with iterative methods", 2017), by SciPy. Errors of the arm are the same for all corners
of a picture, so the standard deviations are those of a jackknife over pictures (Efron, Stein, 1981), which needs no
model of the errors; the same computation predicts each view from the others.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from heptarm.calibration.board import FEWEST_CORNERS, Sighting
from heptarm.calibration.tip import student
from heptarm.errors import CommandRejected, ShapeError, require
from heptarm.io.targets import save_camera, saved_targets
from heptarm.values.camera import NO_DISTORTION, MountedCamera, distorted, intrinsic, lens_distortion
from heptarm.values.checks import Array, Value, flag, frozen, instance, shown, word
from heptarm.values.pose import Pose, check_pose
from heptarm.values.text import lines

#: Where a camera is: on the flange ("eye in hand"), or in the base ("eye to hand", with the board on the flange).
FRAMES = ("flange", "base")
#: Fewest views; more parameters need more.
FEWEST, FEWEST_REFINED = 4, 6
#: Least angle by which the arm turns the camera about a second axis between views [rad].
_TURNED = math.radians(4.0)
#: Corners are on one line if they are this much narrower than long.
_LINE = 1e-3
#: Standard deviations above which the views do not determine the camera [m], [rad].
_LOST, _LOST_ANGLE = 0.01, math.radians(1.0)
#: Distances in a picture from which on a corner counts less at first [pixels].
_ROBUST = 1.0
#: The worst view is suspect if its distances are larger by this factor than the median.
_SUSPECT = 4.0
#: Standard deviation of an offset that a detector gives all corners of all views, which turns the camera [pixels].
_DETECTOR = 0.05
#: Parameters: camera and board, then focal lengths, centre, two terms of radial and two of tangential distortion.
_POSES, _LENS = 12, 8


@dataclass(frozen=True, slots=True, eq=False)
class HandEyeView(Value):
    """A board in a picture, and where the flange was.

    Attributes:
        flange: pose of the flange in the base.
        sighting: what `Board.find` has found.

    Raises:
        ShapeError: wrong types.
    """

    flange: Pose
    sighting: Sighting

    def __post_init__(self) -> None:
        check_pose(self.flange, "flange")
        instance(
            self.sighting, Sighting, "sighting", hint="what board.find(picture) returns, unless it is None"
        )


@dataclass(frozen=True, slots=True)
class HandEyeGuess:
    """Parameters about which the least squares are linear.

    Attributes:
        camera: in its frame.
        board: in the other one.
        lens: focal lengths, centre, k1, k2, p1, p2, shape (8,).
        k3: the last term of the distortion, which is not estimated.
    """

    camera: Pose
    board: Pose
    lens: Array
    k3: float = 0.0

    @property
    def distortion(self) -> tuple[float, ...]:
        """Distortion k1 k2 p1 p2 k3."""
        return (*self.lens[4:].tolist(), self.k3)

    def moved(self, step: Array) -> HandEyeGuess:
        """The parameters after a step: translations in the frame's axes, rotations about them, then the lens."""
        lens = self.lens.copy()
        lens[: len(step) - _POSES] += step[_POSES:]
        return HandEyeGuess(_moved(self.camera, step[:6]), _moved(self.board, step[6:12]), lens, self.k3)


def _moved(pose: Pose, step: Array) -> Pose:
    return Pose.of(pose.xyz + step[:3], (Pose.from_rotvec((0, 0, 0), step[3:]) @ pose).quat)


@dataclass(frozen=True, slots=True, eq=False)
class HandEyeEstimate(Value):
    """A camera that was measured. Standard deviations are of a jackknife over the views, and count how few there were.

    Attributes:
        pose: pose of the camera in `frame`: x to the right of its pictures, y down, z ahead.
        frame: "flange" or "base".
        board: pose of the board in the base, or in the flange frame if the camera is in the base.
        matrix: intrinsic matrix, shape (3, 3) [pixels].
        distortion: k1 k2 p1 p2 k3 as in OpenCV, shape (5,).
        sigma: standard deviation of the camera's place along the axes of `frame`, shape (3,) [m].
        sigma_angle: standard deviation of its rotation about the axes of `frame`, shape (3,) [rad].
        residuals: root mean square distance of the corners in each view, shape (n,) [pixels].
        predicted: the same when each view is predicted from the others, shape (n,) [pixels].
        predicted_m: the same on the board [m].
        worst: the view that the others predict least, from 1.
    """

    pose: Pose
    frame: str
    board: Pose
    matrix: Array
    distortion: Array
    sigma: Array
    sigma_angle: Array
    residuals: Array
    predicted: Array
    predicted_m: Array
    worst: int

    @property
    def guess(self) -> HandEyeGuess:
        """Its numbers as parameters of `HandEyeModel`."""
        (fx, _, cx), (_, fy, cy), _ = self.matrix.tolist()
        lens = np.array([fx, fy, cx, cy, *self.distortion[:4]])
        return HandEyeGuess(self.pose, self.board, lens, float(self.distortion[4]))

    @property
    def rms(self) -> float:
        """Root mean square distance of all corners [pixels]."""
        return float(np.sqrt(np.mean(self.residuals**2)))

    @property
    def is_suspect(self) -> bool:
        """Whether the worst view contradicts the others: leave it out, or take it again."""
        return bool(self.predicted[self.worst - 1] > _SUSPECT * np.median(self.predicted))

    def __str__(self) -> str:
        """The camera with its standard deviations, and how well the views agree."""
        place = "  ".join(
            f"{axis} {1e3 * value:.2f} ± {1e3 * sigma:.2f}"
            for axis, value, sigma in zip("xyz", self.pose.xyz, self.sigma, strict=True)
        )
        a, b, c = np.degrees(self.pose.abc)
        worst = f"view {self.worst}: {self.predicted[self.worst - 1]:.2f} pixels"
        fx, fy, cx, cy = self.matrix[0, 0], self.matrix[1, 1], self.matrix[0, 2], self.matrix[1, 2]
        rows = {
            "camera": f"{place} mm in the {self.frame}",
            "orientation": f"a {a:.2f}  b {b:.2f}  c {c:.2f} deg "
            f"± {math.degrees(float(np.linalg.norm(self.sigma_angle))):.3f} deg",
            "lens": f"focal lengths {fx:.1f} {fy:.1f}, centre {cx:.1f} {cy:.1f} pixels",
            "residuals": f"{self.rms:.2f} pixels",
            "held out": f"{_rms(self.predicted):.2f} pixels, {1e3 * _rms(self.predicted_m):.2f} mm: each view "
            "predicted from the others",
            "worst": worst + (", contradicts the others: take it again" if self.is_suspect else ""),
        }
        return lines(f"Camera on the {self.frame} from {len(self.residuals)} views", rows)

    def save(self, target: str, name: str) -> MountedCamera:
        """Save the camera with a saved target, from which `saved_camera` reads it.

        Raises:
            CommandRejected: there is no such target; nothing is changed.
        """
        made = MountedCamera(name, self.frame, self.pose, self.matrix, self.distortion)
        save_camera(target, made)
        return made


def saved_camera(target: str, name: str) -> MountedCamera:
    """A camera that was measured and saved: for the arguments `pose`, `frame` and `matrix` of `Arm.camera`.

    Args:
        target: name of a saved target.
        name: of the camera.

    Raises:
        CommandRejected: there is no such target, or it has no such camera.
    """
    found = saved_targets().get(target)
    known = {} if found is None else {one.name: one for one in found.cameras}
    if name not in known:
        listed = ", ".join(known) or "none"
        raise CommandRejected(
            f"name must be that of a camera of the saved target {shown(target)}, which has {listed}; got {shown(name)}",
            parameter="name",
            value=name,
            allowed=listed,
            hint="heptarm calibrate eye --save NAME --target TARGET",
        )
    return known[name]


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


class HandEyeModel:
    """Where corners of a board are in pictures, for given flanges.

    Args:
        flanges: poses of the flange in the base.
        points: on the board, one array of shape (n, 3) for each [m].
        frame: of the camera.
    """

    def __init__(self, flanges: Sequence[Pose], points: Sequence[Array], frame: str) -> None:
        # board to camera: inverse of the camera @ inverse of the flange @ board, or with the flange itself
        given = [pose.inverse() if frame == "flange" else pose for pose in flanges]
        counts = [len(view) for view in points]
        self.places = np.repeat(np.arange(len(given)), counts)
        self._turns = np.array([pose.rotation for pose in given])
        self._shifts = np.array([pose.xyz for pose in given])
        self._points = np.concatenate([np.asarray(view) for view in points])

    def seen(self, guess: HandEyeGuess) -> tuple[Array, Array]:
        """Pixels of all corners, shape (n, 2), and their distances along the optical axis, shape (n,) [m]."""
        at = self._in_camera(guess)[1]
        return _projected(at, guess)[0], at[:, 2]

    def _in_camera(self, guess: HandEyeGuess) -> tuple[Array, Array]:
        """All corners in the axes of the camera's frame, from the camera's place, and in the camera, shape (n, 3)."""
        at = self._points @ guess.board.rotation.T + guess.board.xyz
        at = (
            np.einsum("nij,nj->ni", self._turns[self.places], at)
            + self._shifts[self.places]
            - guess.camera.xyz
        )
        return at, at @ guess.camera.rotation

    def jacobian(self, guess: HandEyeGuess, count: int) -> Array:
        """Derivatives of the pixels by a step of so many parameters, shape (n, 2, count)."""
        beside, at = self._in_camera(guess)
        into, turn = guess.camera.rotation.T, self._turns[self.places]
        on_board = self._points @ guess.board.rotation.T
        of_points = [
            np.broadcast_to(-into, turn.shape),
            into @ _crossing(beside),
            into @ turn,
            -into @ turn @ _crossing(on_board),
        ]
        by_point, by_lens = _projected(at, guess)[1:]
        of_poses = by_point @ np.concatenate(of_points, axis=2)
        return np.concatenate([of_poses, by_lens], axis=2)[:, :, :count]


def _crossing(vectors: Array) -> Array:
    """Matrices that multiply a vector as the cross product with these from the left does, shape (n, 3, 3)."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)


def _projected(at: Array, guess: HandEyeGuess) -> tuple[Array, Array, Array]:
    """Pixels of points in the camera, shape (n, 2), and their derivatives by the points and by the lens."""
    depth = at[:, 2]
    x, y = at[:, 0] / depth, at[:, 1] / depth
    fx, fy, cx, cy = guess.lens[:4]
    u, v, du_dx, mixed, dv_dy = distorted(x, y, guess.distortion)
    r = x * x + y * y
    rows = [
        [fx * du_dx, fx * mixed, -fx * (du_dx * x + mixed * y)],
        [fy * mixed, fy * dv_dy, -fy * (mixed * x + dv_dy * y)],
    ]
    by_point = np.moveaxis(np.array(rows) / depth, 2, 0)
    none, one = np.zeros_like(x), np.ones_like(x)
    of_lens = [
        [u, none, one, none, fx * x * r, fx * x * r * r, 2.0 * fx * x * y, fx * (r + 2.0 * x * x)],
        [none, v, none, one, fy * y * r, fy * y * r * r, fy * (r + 2.0 * y * y), 2.0 * fy * x * y],
    ]
    return np.column_stack([fx * u + cx, fy * v + cy]), by_point, np.moveaxis(np.array(of_lens), 2, 0)


def estimate_hand_eye(
    views: Sequence[HandEyeView],
    *,
    frame: Literal["flange", "base"] = "flange",
    matrix: npt.ArrayLike | None = None,
    distortion: npt.ArrayLike = NO_DISTORTION,
    refine: bool | None = None,
) -> HandEyeEstimate:
    """Compute where a camera is from views of a board that stands still, or that the flange carries.

    Turn the flange by 20 to 40 degrees about different axes from view to view, and let the board fill the pictures.

    Args:
        views: four or more, six to refine the lens; twelve are good.
        frame: "flange": the camera moves with the arm; "base": it is beside the arm, and the board is on the flange.
        matrix: intrinsic matrix, shape (3, 3) [pixels]; None: from the views.
        distortion: k1 k2 p1 p2 k3 as in OpenCV, shape (5,).
        refine: estimate focal lengths, centre, k1, k2, p1 and p2, too; None: if there is no matrix.

    Raises:
        ShapeError: too few views, or wrong types.
        LimitError: a value outside its range.
        CommandRejected: the arm did not turn, or about one axis only; the views do not determine the camera.
        MissingExtra: OpenCV or SciPy is not installed.
    """
    word(frame, "frame", FRAMES)
    is_refined = matrix is None if refine is None else flag(refine, "refine")
    found = roughly_estimated(views, frame=frame, matrix=matrix, distortion=distortion, refine=is_refined)
    place, angle = float(found.sigma.max()), float(found.sigma_angle.max())
    if not (place <= _LOST and angle <= _LOST_ANGLE):  # NaN, too
        raise CommandRejected(
            f"the views do not determine the camera: its standard deviation would be {1e3 * place:.1f} mm "
            f"and {math.degrees(angle):.2f} deg, and {1e3 * _LOST:g} mm and "
            f"{math.degrees(_LOST_ANGLE):g} deg are allowed",
            parameter="views",
            value=place,
            allowed=f"at most {_LOST:g} m",
            hint="take more views, from more directions, with the board larger in the pictures",
        )
    return found


def roughly_estimated(
    views: Sequence[HandEyeView],
    *,
    frame: Literal["flange", "base"],
    matrix: npt.ArrayLike | None,
    distortion: npt.ArrayLike,
    refine: bool,
) -> HandEyeEstimate:
    """Compute what `estimate_hand_eye` does, however little the views determine it."""
    rest, is_refined = lens_distortion(distortion), refine
    given = _checked(views, FEWEST_REFINED if is_refined else FEWEST)
    _check_turns([view.flange for view in given])
    lens = first_matrix(given) if matrix is None else intrinsic(matrix)
    seen = [board_pose(view.sighting, lens, rest, name=f"views[{index}]") for index, view in enumerate(given)]
    camera = _closed_form(
        [view.flange if frame == "flange" else view.flange.inverse() for view in given], seen
    )
    first = given[0].flange if frame == "flange" else given[0].flange.inverse()
    guess = HandEyeGuess(
        camera,
        first @ camera @ seen[0],
        np.array([lens[0, 0], lens[1, 1], lens[0, 2], lens[1, 2], *rest[:4]]),
        float(rest[4]),
    )
    model = HandEyeModel([view.flange for view in given], [view.sighting.points for view in given], frame)
    pixels = np.concatenate([view.sighting.pixels for view in given])
    count = _POSES + (_LENS if is_refined else 0)
    for loss in ("huber", "linear"):  # a wrong corner spoils the first steps otherwise
        guess = _solved(model, pixels, guess, count, loss)
    return _judged(model, pixels, guess, count, frame)


def _checked(views: Sequence[HandEyeView], fewest: int) -> list[HandEyeView]:
    if isinstance(views, HandEyeView) or not isinstance(views, Sequence):
        raise ShapeError(
            f"views must be a sequence of views, got {shown(views)}", parameter="views", value=views
        )
    for index, view in enumerate(views):
        instance(view, HandEyeView, f"views[{index}]")
    if len(views) < fewest:
        raise ShapeError(
            f"views must be at least {fewest}, got {len(views)}",
            parameter="views",
            value=len(views),
            hint="take pictures in which the board is seen from more directions",
        )
    for index, view in enumerate(views):
        if len(view.sighting) < FEWEST_CORNERS or _are_on_a_line(view.sighting.points):
            raise _undetermined(view.sighting, f"views[{index}]")
    return list(views)


def _are_on_a_line(points: Array) -> bool:
    length, width, *_ = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(width <= _LINE * length)


def _undetermined(sighting: Sighting, name: str) -> CommandRejected:
    """The refusal of a view by its name."""
    return CommandRejected(
        f"the {len(sighting)} corners of {name} do not determine where the board is, as too few or on one line",
        parameter=name,
        value=len(sighting),
        hint="leave this view out, or take it with more rows of the board in the picture",
    )


def _check_turns(flanges: Sequence[Pose]) -> None:
    """Refuse flanges that turn too little to know the camera along some direction.

    Raises:
        CommandRejected: they do.
    """
    turns = np.array([(flanges[0].inverse() @ flange).rotvec for flange in flanges])
    _, strengths, axes = np.linalg.svd(turns - turns.mean(axis=0), full_matrices=True)
    rms = strengths / math.sqrt(len(flanges))
    if rms[0] < _TURNED:
        raise CommandRejected(
            f"the flange turns by {math.degrees(rms[0]):.1f} deg between the views, and "
            f"{math.degrees(_TURNED):.0f} deg are needed: is the arm moving?",
            parameter="views",
            value=float(rms[0]),
            hint="turn it by 20 to 40 degrees about different axes",
        )
    if rms[1] < _TURNED:
        axis = ", ".join(f"{number:.2f}" for number in axes[0])
        raise CommandRejected(
            f"the flange turns about one axis only, ({axis}) of the flange: along it the camera is not known",
            parameter="views",
            value=float(rms[1]),
            hint="turn it about another axis as well, by 20 to 40 degrees",
        )


def first_matrix(views: Sequence[HandEyeView]) -> Array:
    """Intrinsic matrix from the views alone (Zhang, 2000, by OpenCV)."""
    cv: Any = require("cv2", extra="vision")
    points = [view.sighting.points.astype(np.float32) for view in views]
    pixels = [view.sighting.pixels.astype(np.float32).reshape(-1, 1, 2) for view in views]
    size = views[0].sighting.size
    flags = cv.CALIB_FIX_K3 | cv.CALIB_ZERO_TANGENT_DIST
    return np.asarray(cv.calibrateCamera(points, pixels, size, None, None, flags=flags)[1], float)


def board_pose(
    sighting: Sighting, matrix: Array, distortion: npt.ArrayLike = NO_DISTORTION, *, name: str = "views[0]"
) -> Pose:
    """Pose of a board in the camera, from one picture (perspective-n-point, by OpenCV).

    Args:
        sighting: corners in the picture.
        matrix: intrinsic matrix, shape (3, 3) [pixels].
        distortion: shape (5,).
        name: of the view, for the error.

    Raises:
        CommandRejected: the corners do not determine it, as on one line.
        MissingExtra: OpenCV is not installed.
    """
    cv: Any = require("cv2", extra="vision")
    points, pixels, lens = sighting.points.copy(), sighting.pixels.copy(), np.asarray(distortion, float)
    _, turn, shift = cv.solvePnP(points, pixels, matrix, lens, flags=cv.SOLVEPNP_IPPE)
    _, turn, shift = cv.solvePnP(points, pixels, matrix, lens, turn, shift, True, cv.SOLVEPNP_ITERATIVE)
    found = np.concatenate([np.ravel(shift), np.ravel(turn)])
    if not np.isfinite(found).all():
        raise _undetermined(sighting, name)
    return Pose.from_rotvec(found[:3], found[3:])


def _closed_form(flanges: Sequence[Pose], boards: Sequence[Pose]) -> Pose:
    """The camera that solves A X = X B best, rotation first; A and B are moves of flange and board."""
    pairs = [
        (flanges[i].inverse() @ flanges[j], boards[i] @ boards[j].inverse())
        for i in range(len(flanges))
        for j in range(i + 1, len(flanges))
    ]
    mixed = np.add.reduce([np.outer(b.rotvec, a.rotvec) for a, b in pairs])
    u, _, vt = np.linalg.svd(mixed)
    turn = vt.T @ np.diag([1.0, 1.0, np.linalg.det(vt.T @ u.T)]) @ u.T
    left = np.concatenate([a.rotation - np.eye(3) for a, _ in pairs])
    right = np.concatenate([turn @ b.xyz - a.xyz for a, b in pairs])
    shift = np.linalg.lstsq(left, right, rcond=None)[0]
    return Pose.from_matrix(np.column_stack([turn, shift]))


def _solved(model: HandEyeModel, pixels: Array, guess: HandEyeGuess, count: int, loss: str) -> HandEyeGuess:
    """The parameters with the least distances in the pictures."""
    optimize: Any = require("scipy.optimize", extra="vision")

    def off(step: Array) -> Array:
        return np.ravel(model.seen(guess.moved(step))[0] - pixels)

    def slope(step: Array) -> Array:
        return model.jacobian(guess.moved(step), count).reshape(-1, count)

    scale = np.array([*[0.01] * _POSES, *[10.0] * 4, *[0.1] * 2, *[0.01] * 2])[:count]
    found = optimize.least_squares(
        off, np.zeros(count), slope, x_scale=scale, loss=loss, f_scale=_ROBUST, max_nfev=40
    )
    return guess.moved(found.x)


def _judged(
    model: HandEyeModel, pixels: Array, guess: HandEyeGuess, count: int, frame: str
) -> HandEyeEstimate:
    """The estimate with the results of a jackknife over the views."""
    seen, depth = model.seen(guess)
    off, slopes = seen - pixels, model.jacobian(guess, count)
    n, places = int(model.places[-1]) + 1, model.places
    each = [slopes[places == view].reshape(-1, count) for view in range(n)]
    whole = np.add.reduce([block.T @ block for block in each])
    shifts, residuals, predicted, on_board = [], [], [], []
    for view, slope in enumerate(each):
        here = np.ravel(off[places == view])
        rest = whole - slope.T @ slope
        shift = np.linalg.lstsq(rest, slope.T @ here, rcond=1e-14)[0]
        distances = (here + slope @ shift).reshape(-1, 2)
        shifts.append(shift)
        residuals.append(math.sqrt(np.mean(np.square(here)) * 2.0))
        predicted.append(math.sqrt(np.mean(np.square(distances)) * 2.0))
        metres = distances * (depth[places == view] / guess.lens[0])[:, None]
        on_board.append(math.sqrt(np.mean(np.square(metres)) * 2.0))
    apart = np.array(shifts) - np.mean(shifts, axis=0)
    sigma = student(n - 1) * np.sqrt((n - 1) / n * np.square(apart).sum(axis=0))
    fx, fy, cx, cy = guess.lens[:4]
    turned = guess.camera.rotation[:, :2] * _DETECTOR / np.array([fy, fx])
    sigma[3:6] = np.sqrt(np.square(sigma[3:6]) + np.square(turned).sum(axis=1))
    return HandEyeEstimate(
        guess.camera,
        frame,
        guess.board,
        frozen(np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])),
        frozen(guess.distortion),
        frozen(sigma[:3]),
        frozen(sigma[3:6]),
        frozen(residuals),
        frozen(predicted),
        frozen(on_board),
        1 + int(np.argmax(predicted)),
    )
