"""Hand-eye calibration: from exact and noisy corners, from rendered boards, and on a virtual cabinet that moves."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
import pytest

import heptarm as ha
from heptarm import calibration, model
from heptarm.arm.devices.camera import CameraStream
from heptarm.calibration import Board, HandEyeView, Sighting, estimate_hand_eye
from heptarm.calibration.hand_eye_estimate import HandEyeGuess, HandEyeModel
from heptarm.cli.calibrate_eye import board, eye
from heptarm.cli.options import Access, CommandTarget
from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.io.targets import SavedTarget, add_target, save_tool, saved_targets, targets_file
from heptarm.values.checks import Array
from heptarm.values.robot import robot
from tests.drawing import cannot_draw
from tests.long import longer
from tests.simulators import FASTER

Frame = Literal["flange", "base"]
BOARD = Board()
CAMERA = ha.Pose.xyz_abc(0.03, -0.05, 0.06, *ha.deg(90, 5, -3))
PLACE = ha.Pose.xyz_abc(0.6, 0.1, 0.0, *ha.deg(20, 0, 180))
MATRIX = np.array([[580.0, 0, 315.0], [0, 570.0, 242.0], [0, 0, 1]])
FLAT = (0.0, 0.0, 0.0, 0.0, 0.0)
BENT = (0.12, -0.08, 0.001, -0.002, 0.0)
HOME = ha.deg(0, 25, 0, -90, 0, 65, 0)


def turned(*rotvec: float) -> ha.Pose:
    return ha.Pose.from_rotvec((0, 0, 0), rotvec)


def views(
    frame: Frame = "flange",
    *,
    count: int = 12,
    pixels: float = 0.0,
    arm: float = 0.0,
    seed: int = 1,
    bent: tuple[float, ...] = FLAT,
    turn: Callable[[np.random.Generator], ha.Pose] | None = None,
) -> list[HandEyeView]:
    """Views of a camera whose lens and place are known; noise of the corners [pixels], of the arm [m, rad]."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        tilt = turned(*rng.uniform(-0.45, 0.45, 2), rng.uniform(-1, 1)) if turn is None else turn(rng)
        seen = ha.Pose.of((0, 0, rng.uniform(0.28, 0.4)), tilt.quat) @ ha.Pose.at(*-BOARD.centre)
        flange = (
            PLACE @ seen.inverse() @ CAMERA.inverse()
            if frame == "flange"
            else CAMERA @ seen @ PLACE.inverse()
        )
        lens = np.array([*MATRIX[[0, 1, 0, 1], [0, 1, 2, 2]], *bent[:4]])
        guess = HandEyeGuess(CAMERA, PLACE, lens, bent[4])
        at = HandEyeModel([flange], [BOARD.points], frame).seen(guess)[0]
        at = at + rng.normal(scale=pixels, size=at.shape) if pixels else at
        off = turned(*rng.normal(scale=arm, size=3)) if arm else turned(0, 0, 0)
        place = flange.xyz + (rng.normal(scale=arm, size=3) if arm else 0.0)
        found.append(
            HandEyeView(ha.Pose.of(place, (flange @ off).quat), Sighting(BOARD.points, at, (640, 480)))
        )
    return found


def errors(found: calibration.HandEyeEstimate, true: ha.Pose) -> np.ndarray:
    """Of the place [m] and the rotation [rad], in the axes of the frame, shape (6,)."""
    return np.concatenate([found.pose.xyz - true.xyz, (found.pose @ true.inverse()).rotvec])


# ----------------------------------------------------------------------------------------- from corners alone


@pytest.mark.parametrize("frame", ["flange", "base"])
@pytest.mark.parametrize("refine", [False, True])
def test_exact_corners_give_the_exact_camera(frame: Frame, refine: bool) -> None:
    given: dict[str, Any] = {} if refine else {"matrix": MATRIX, "distortion": BENT}
    found = estimate_hand_eye(views(frame, bent=BENT), frame=frame, **given)
    assert np.abs(errors(found, CAMERA)).max() < 1e-7 and found.rms < 1e-5
    np.testing.assert_allclose(found.board.matrix, PLACE.matrix, atol=1e-7)
    np.testing.assert_allclose(found.matrix, MATRIX, atol=1e-3)
    np.testing.assert_allclose(found.distortion, BENT, atol=1e-5)


@pytest.mark.parametrize("frame", ["flange", "base"])
@pytest.mark.parametrize("arm", [0.0, 1e-4], ids=["corners", "corners and arm"])
def test_the_standard_deviations_are_honest(frame: Frame, arm: float) -> None:
    runs, inside, sizes = longer(14, 100), 0, []
    for seed in range(runs):
        given = views(frame, pixels=0.1, arm=arm, seed=seed)
        found = estimate_hand_eye(given, frame=frame, matrix=MATRIX)
        sigma = np.concatenate([found.sigma, found.sigma_angle])
        off = errors(found, CAMERA) / sigma
        inside += int((np.abs(off) < 2.0).sum())
        sizes.append(np.square(off).mean())
    assert inside >= 0.9 * 6 * runs, "the truth is within two of them in nine of ten"
    assert np.mean(sizes) > 0.2, "and they are not far too large"


def test_a_camera_goes_into_the_entry_of_a_saved_target(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    found = estimate_hand_eye(views(), matrix=MATRIX)
    with pytest.raises(CommandRejected, match="there is no target lab1"):
        found.save("lab1", "wrist")
    add_target(SavedTarget("lab1", "172.31.1.147"))
    save_tool("lab1", ha.Tool("gripper", mass=1.2))
    for _ in range(2):  # the second one takes the place of the first
        made = found.save("lab1", "wrist")
    assert saved_targets()["lab1"].cameras == (made,) and saved_targets()["lab1"].tools[0].mass == 1.2
    assert calibration.saved_camera("lab1", "wrist") == made and made.pose == found.pose
    with pytest.raises(CommandRejected, match="saved target 'lab1', which has wrist; got 'head'"):
        calibration.saved_camera("lab1", "head")
    add_target(SavedTarget("lab1", "172.31.1.148"), replace=True)
    assert calibration.saved_camera("lab1", "wrist") == made, "a new address keeps what was measured"
    file = targets_file()
    file.write_text(file.read_text().replace('frame = "flange"', 'frame = "tool"'))
    with pytest.raises(CommandRejected, match=r"camera wrist of \[lab1\] in .*: frame must be"):
        saved_targets()


def test_a_wrong_view_is_named_and_the_others_predict_it() -> None:
    given = views(pixels=0.05)
    wrong = given[4]
    given[4] = HandEyeView(wrong.flange.shifted(0.004), wrong.sighting)
    found = estimate_hand_eye(given, matrix=MATRIX)
    assert found.worst == 5 and found.is_suspect
    assert 3e-3 < found.predicted_m[4] < 8e-3 and found.predicted[4] > found.residuals[4]
    assert "view 5" in str(found) and "contradicts the others" in str(found)
    good = estimate_hand_eye(views(pixels=0.05), matrix=MATRIX)
    assert not good.is_suspect and good.predicted_m.max() < 1e-3


@pytest.mark.parametrize(
    ("turn", "words"),
    [
        (lambda rng: turned(0.3, 0.2, 0.1), r"turns by 0\.0 deg .* is the arm moving\?"),
        (lambda rng: turned(0.0, rng.uniform(-0.5, 0.5), 0.0), "about one axis only"),
    ],
)
def test_an_arm_that_does_not_turn_is_refused(turn: Callable[[Any], ha.Pose], words: str) -> None:
    with pytest.raises(CommandRejected, match=words):
        estimate_hand_eye(views(turn=turn), matrix=MATRIX)


def test_what_makes_no_sense_is_refused() -> None:
    given = views()
    rng = np.random.default_rng(0)
    for bad, more, error, words in (
        (given[:3], {}, ShapeError, "views must be at least 4, got 3"),
        (given[:5], {"matrix": None}, ShapeError, "views must be at least 6, got 5"),
        (given[0], {}, ShapeError, "views must be a sequence"),
        ([*given, None], {}, ShapeError, r"views\[12\] must be a HandEyeView"),
        (given, {"frame": "tool"}, ShapeError, "frame must be"),
        (given, {"matrix": np.zeros((3, 3))}, LimitError, "focal lengths above 0"),
        (given, {"distortion": (0, 0)}, ShapeError, "distortion must have five numbers"),
        (
            [HandEyeView(one.flange @ turned(*rng.normal(scale=0.3, size=3)), one.sighting) for one in given],
            {},
            CommandRejected,
            "the views do not determine the camera",
        ),
    ):
        with pytest.raises(error, match=words):
            estimate_hand_eye(bad, **({"matrix": MATRIX} | more))  # type: ignore[arg-type]
    with pytest.raises(ShapeError, match=r"sighting must be a Sighting.*board\.find"):
        HandEyeView(PLACE, None)  # type: ignore[arg-type]


# ------------------------------------------------------------------------------------------------- boards


@pytest.mark.parametrize(
    "board", [Board(), Board(4, 3, 0.05, kind="apriltag"), Board(1, 1, 0.1, kind="apriltag")]
)
def test_a_board_is_found_in_its_own_picture(board: Board) -> None:
    side = 64 if board.kind == "apriltag" else 60
    printed = np.pad(board.picture(pixels=side), side, constant_values=255)
    found = board.find(printed)
    assert found is not None and len(found) == len(board.points)
    scale = side / board.square
    np.testing.assert_allclose(found.pixels, found.points[:, :2] * scale + side - 0.5, atol=0.15)
    np.testing.assert_allclose(
        np.diff(found.pixels, axis=0).mean(), np.diff(found.points[:, :2] * scale, axis=0).mean(), atol=0.1
    )
    if board.kind == "apriltag":
        with pytest.raises(LimitError, match="a multiple of 8 for AprilTags, got 60"):
            board.picture(pixels=60)
    assert board.find(np.full((200, 300, 3), 200, np.uint8)) is None
    assert board.find(np.ascontiguousarray(printed[:, ::-1])) is None, "a mirrored board is none"


def test_one_row_of_corners_is_no_sighting() -> None:
    side = 60
    printed = np.pad(BOARD.picture(pixels=side), side, constant_values=255)
    for rows, corners in ((1, 0), (2, 12)):  # rows of corners that the picture has
        seen = np.full_like(printed, 255)
        seen[: (rows + 2) * side] = printed[: (rows + 2) * side]
        numbers, _ = BOARD._corners(seen)
        assert len(numbers) == 6 * rows
        found = BOARD.find(seen)
        assert (0 if found is None else len(found)) == corners


@pytest.mark.parametrize("matrix", [MATRIX, None], ids=["known", "unknown"])
@pytest.mark.parametrize("chosen", [[0, 1, 2, 3], [0, 7, 14, 21], [0, 1, 6]])
def test_a_view_whose_corners_do_not_determine_the_board_is_named(
    chosen: list[int], matrix: Array | None
) -> None:
    given = views()
    seen = given[2].sighting
    few = Sighting(seen.points[chosen], seen.pixels[chosen], seen.size)
    given[2] = HandEyeView(given[2].flange, few)
    with pytest.raises(CommandRejected, match=rf"the {len(few)} corners of views\[2\] do not determine"):
        estimate_hand_eye(given, matrix=matrix)


def test_a_board_is_printed_in_its_true_size(tmp_path: Path) -> None:
    from PIL import Image

    file = BOARD.save(tmp_path / "board.png")
    with Image.open(file) as image:
        dots = image.info["dpi"][0]
        np.testing.assert_allclose(
            np.array(image.size) / dots * 0.0254, np.array(BOARD.size) + 0.03, rtol=1e-3
        )
    assert BOARD.save(tmp_path / "board.pdf").read_bytes().startswith(b"%PDF")
    for name, error, words in (
        ("board.png", CommandRejected, "exists"),
        ("board.gif", ShapeError, r"must end in \.pdf or \.png"),
        ("no/board.png", CommandRejected, "cannot be written"),
    ):
        with pytest.raises(error, match=words):
            BOARD.save(tmp_path / name)
    with pytest.raises(LimitError, match="at most 250 markers"):
        Board(30, 30)
    assert str(BOARD) == "charuco board, 7 by 5 squares of 30 mm, markers of 22.2 mm"


def photographed(board: Board, seen: ha.Pose, rng: np.random.Generator) -> np.ndarray:
    """A picture of 640 by 480 of a board at a pose in the camera, with blur and noise, shape (480, 640)."""
    cv: Any = pytest.importorskip("cv2")
    side, finer = 64, 3
    printed = np.pad(board.picture(pixels=side), side, constant_values=255)
    step = board.square / side
    on_board = np.array([[step, 0, (0.5 - side) * step], [0, step, (0.5 - side) * step], [0, 0, 1]])
    to_fine = np.array([[finer, 0, (finer - 1) / 2], [0, finer, (finer - 1) / 2], [0, 0, 1]])
    plane = MATRIX @ np.column_stack([seen.rotation[:, :2], seen.xyz]) @ on_board
    fine = cv.warpPerspective(printed, to_fine @ plane, (640 * finer, 480 * finer), borderValue=160)
    drawn = cv.GaussianBlur(
        cv.resize(fine, (640, 480), interpolation=cv.INTER_AREA).astype(float), (0, 0), 0.8
    )
    noisy = 30 + 0.75 * drawn + rng.normal(0, 3, drawn.shape)
    return np.asarray(np.clip(np.rint(noisy), 0, 255), np.uint8)


def seen_tags(seed: int) -> list[HandEyeView]:
    """Views of a grid of AprilTags, found in pictures with blur and noise."""
    board, rng, found = Board(4, 3, 0.05, kind="apriltag"), np.random.default_rng(seed), []
    for _ in range(12):
        tilt = turned(*rng.uniform(-0.45, 0.45, 2), rng.uniform(-1, 1))
        seen = ha.Pose.of((0, 0, rng.uniform(0.28, 0.4)), tilt.quat) @ ha.Pose.at(*-board.centre)
        sighting = board.find(photographed(board, seen, rng))
        if sighting is not None:
            found.append(HandEyeView(PLACE @ seen.inverse() @ CAMERA.inverse(), sighting))
    return found


def test_tags_in_pictures_with_blur_and_noise_give_the_camera_and_an_honest_sigma() -> None:
    runs, inside = longer(1, 20), 0
    for seed in range(runs):
        found = estimate_hand_eye(seen_tags(seed), matrix=MATRIX)
        off, sigma = errors(found, CAMERA), np.concatenate([found.sigma, found.sigma_angle])
        assert np.linalg.norm(off[:3]) < 0.1e-3 and np.linalg.norm(off[3:]) < math.radians(0.02)
        inside += int((np.abs(off) < 2.0 * sigma).sum())
    assert inside >= 0.9 * 6 * runs - 1


def test_corners_of_tags_are_where_their_edges_meet() -> None:
    board, rng, off = Board(4, 3, 0.05, kind="apriltag"), np.random.default_rng(3), []
    for distance in (0.28, 0.6):
        seen = ha.Pose.of((0, 0, distance), turned(0.3, -0.2, 0.4).quat) @ ha.Pose.at(*-board.centre)
        sighting = board.find(photographed(board, seen, rng))
        assert sighting is not None and len(sighting) == len(board.points)
        at = (sighting.points @ seen.rotation.T + seen.xyz) @ MATRIX.T
        off.append(sighting.pixels - at[:, :2] / at[:, 2:])
    assert np.abs(np.mean(off[0], axis=0)).max() < 0.01 and np.std(off[0]) < 0.03
    assert np.abs(np.mean(off[1], axis=0)).max() < 0.02 and np.std(off[1]) < 0.08


# -------------------------------------------------------------------------------------- with pictures, and an arm


def scene(folder: Path, camera: ha.Camera, board: Board, frame: Frame) -> str:
    """A board that a camera sees from the front where the arm begins; its scene as an argument of a target."""
    flange = ha.Pose.from_matrix(model.forward(robot("iiwa14"), HOME))
    seen = ha.Pose.at(0, 0, 0.33) @ turned(0.0, 0.0, 0.3) @ ha.Pose.at(*-board.centre)
    at = flange @ camera.pose @ seen if frame == "flange" else flange.inverse() @ camera.pose @ seen
    return str(board.save_scene(folder / "board.xml", at=at, on_flange=frame == "base"))


class Ideal(Board):
    """A board whose corners are found without pictures: what is given as a picture is the pose of the flange."""

    place = (
        ha.Pose.from_matrix(model.forward(robot("iiwa14"), HOME))
        @ CAMERA
        @ ha.Pose.at(0, 0, 0.33)
        @ turned(0.0, 0.0, 0.3)
        @ ha.Pose.at(*-BOARD.centre)
    )

    def find(self, picture: Any) -> Sighting | None:
        guess = HandEyeGuess(
            CAMERA, self.place, np.array([*MATRIX[[0, 1, 0, 1], [0, 1, 2, 2]], *FLAT[:4]]), 0.0
        )
        return Sighting(
            self.points, HandEyeModel([picture], [self.points], "flange").seen(guess)[0], (640, 480)
        )


class Stream(CameraStream):
    """The flange of an arm that moves at once, as pictures."""

    matrix = MATRIX
    distortion = FLAT
    frame = "flange"

    def __init__(self) -> None:
        self._q: Array = HOME

    @property
    def here(self) -> Array:
        return self._q

    def read(self, **_: Any) -> Any:
        flange = ha.Pose.from_matrix(model.forward(robot("iiwa14"), self._q))
        return SimpleNamespace(pixels=flange, flange=flange)

    def move(self, motion: Any, **_: Any) -> None:
        self._q = motion.q


@pytest.mark.parametrize("count", [7, 9])
def test_as_many_views_are_taken_as_were_asked_for(count: int) -> None:
    stream, plans = Stream(), []
    arm: Any = SimpleNamespace(
        robot=robot("iiwa14"),
        speed=1.0,
        wait_for_rest=lambda: SimpleNamespace(q_cmd=stream.here, stamp=0),
        plan=lambda *_, **__: SimpleNamespace(collisions=()),
        move=stream.move,
    )
    found = calibration.hand_eye(
        arm, stream, Ideal(), views=count, confirm=lambda plan: bool(plans.append(plan.purpose)) or True
    )
    assert len(found.residuals) == count and np.abs(errors(found, CAMERA)).max() < 1e-5
    assert len(plans) == (1 if count == 7 else 2)


@pytest.mark.long
@pytest.mark.parametrize("frame", ["flange", "base"])
def test_the_arm_measures_its_camera(frame: Frame, tmp_path: Path) -> None:
    if why := cannot_draw():
        pytest.skip(why)
    if frame == "flange":
        place, target = (0.06, -0.03, 0.04), (0.05, 0.0, 0.4)
    else:
        place, target = (0.9, -0.2, 0.4), (0.5, 0.0, 0.4)
    camera = ha.Camera(
        place,
        target,
        fov=0.8,
        size=(400, 300),
        frame=frame,
        rate=10,
        distortion=BENT,
        noise=2.0,
        blur=0.6,
        shadows=False,
    )
    options = f"speed={FASTER:g}&scene={scene(tmp_path, camera, BOARD, frame)}"
    with (
        ha.connect(f"sim://iiwa14?{options}", watchdog=5.0, timeout=30.0) as arm,
        arm.camera(camera) as stream,
    ):
        arm.move(ha.ptp(HOME))
        shown: list[str] = []
        with pytest.raises(CommandRejected, match="not confirmed: nothing moves"):
            calibration.hand_eye(arm, stream, BOARD, confirm=lambda plan: bool(shown.append(str(plan))))
        assert "Look at the board from about here" in shown[0] and "A7" in shown[0]
        with pytest.raises(CommandRejected, match="does not see the board from here: .* the apriltag board"):
            calibration.hand_eye(arm, stream, Board(kind="apriltag"))
        found = calibration.hand_eye(arm, stream, BOARD, views=10, speed=1.0)
        np.testing.assert_allclose(arm.state.q_cmd, HOME, atol=1e-6)
        if frame == "base":  # the command on the same cabinet
            _command_measures_the_same(arm, camera, tmp_path)
    off = errors(found, camera.pose)
    assert np.linalg.norm(off[:3]) < 0.5e-3 and np.linalg.norm(off[3:]) < math.radians(0.08)
    assert len(found.residuals) >= 9 and found.rms < 0.3 and not found.is_suspect


def _command_measures_the_same(arm: ha.Arm, camera: ha.Camera, folder: Path) -> None:
    arm.release_control()
    cabinet = arm.connection.cabinet
    assert cabinet is not None
    target = CommandTarget(text=f"sim://{cabinet.host}:{cabinet.port}")
    given: dict[str, Any] = {
        f"camera_{name}": ",".join(map(str, getattr(camera, name))) for name in ("place", "target")
    }
    given |= {"camera_frame": "base", "camera_scene": str(folder / "board.xml"), "camera_size": "640x480"}
    eye(camera="sim", speed=1.0, views=9, out=folder / "eye.json", access=Access(target=target), **given)
    result = json.loads((folder / "eye.json").read_text())
    assert result["frame"] == "base" and not result["suspect"]
    np.testing.assert_allclose(result["camera"][:3], camera.pose.xyz, atol=1e-3)


def test_the_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert board(tmp_path / "tags.pdf", kind="apriltag", columns=4, rows=3, square=0.05) == 0
    assert "4 by 3 AprilTags of 50 mm, markers of 37.5 mm, 200 by 150 mm" in capsys.readouterr().out
    for given, words in (
        ({"camera": "/dev/nowhere.avi"}, "cannot be opened"),
        ({"camera": "0", "camera_place": "1,0,1"}, "are of a simulated camera"),
        ({"camera": "sim", "camera_place": "1,0"}, "camera-place must be X,Y,Z in metres"),
        ({"camera": "sim", "lens": "600"}, "lens must be FX,FY,CX,CY in pixels"),
        ({"camera": "sim", "out": tmp_path / "tags.pdf"}, "exists"),
    ):
        with pytest.raises(CommandRejected, match=words):
            eye(**given)
