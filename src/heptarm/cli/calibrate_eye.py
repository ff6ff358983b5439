"""`heptarm calibrate eye` and `heptarm calibrate board`: measure where a camera is, and print the board for it."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from heptarm import calibration
from heptarm.arm.devices.camera import opened_camera
from heptarm.calibration.hand_eye_motion import SPEED, VIEWS
from heptarm.cli.calibrate import outcome, saved_as
from heptarm.cli.options import Access, Json, Overwrite
from heptarm.cli.output import emit
from heptarm.cli.record import (
    CameraFrame,
    CameraPlace,
    CameraScene,
    CameraSize,
    CameraTarget,
    camera_settings,
    numbers_of,
)
from heptarm.errors import CommandRejected
from heptarm.values.camera import Camera
from heptarm.values.files import unwritable, writable_file

_ACCESS = Access()
#: The value of `--camera` for a simulated camera.
_SIMULATED = "sim"

Kind = Annotated[
    Literal["charuco", "apriltag"],
    Parameter(help="charuco: a chessboard with markers; apriltag: a grid of AprilTags 36h11."),
]
Columns = Annotated[int, Parameter(help="Squares, or tags, from left to right.")]
Rows = Annotated[int, Parameter(help="From top to bottom.")]
Square = Annotated[float, Parameter(help="Side of a square, or distance from tag to tag, measured [m].")]


def board(
    out: Annotated[Path, Parameter(help="File to write, .pdf or .png.")] = Path("board.pdf"),
    /,
    *,
    kind: Kind = "charuco",
    columns: Columns = 7,
    rows: Rows = 5,
    square: Square = 0.03,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> int:
    """Write a calibration board to print in its true size.

    Print it without scaling, glue it onto something flat, and measure the squares.

    For example:

        heptarm calibrate board board.pdf

        heptarm calibrate board tags.pdf --kind apriltag --columns 4 --rows 3 --square 0.05
    """
    made = calibration.Board(columns, rows, square, kind)
    file = made.save(out, overwrite=overwrite)
    if as_json:
        emit({"file": str(file), "size_m": list(made.size), "marker_m": made.marker})
    else:
        width, height = made.size
        print(f"{made}, {1e3 * width:g} by {1e3 * height:g} mm: {file}")
        print("print it without scaling, and measure the squares")
    return 0


def eye(
    *,
    camera: Annotated[
        str,
        Parameter(
            help="Number of a camera of this computer, or the address of a stream, as OpenCV opens it; sim: a "
            "simulated one, with the options --camera-place and so on."
        ),
    ],
    frame: Annotated[
        Literal["flange", "base"],
        Parameter(
            help="flange: the camera is on the flange; base: beside the arm, and the board on the flange."
        ),
    ] = "flange",
    kind: Kind = "charuco",
    columns: Columns = 7,
    rows: Rows = 5,
    square: Square = 0.03,
    lens: Annotated[
        str, Parameter(help="FX,FY,CX,CY of the camera [pixels]. Default: measured with its place.")
    ] = "",
    views: Annotated[int, Parameter(help="Number of postures from which pictures are taken.")] = VIEWS,
    speed: Annotated[float, Parameter(help="Fraction of the full speed, (0, 1].")] = SPEED,
    camera_place: CameraPlace = None,
    camera_target: CameraTarget = None,
    camera_frame: CameraFrame = None,
    camera_size: CameraSize = None,
    camera_scene: CameraScene = None,
    out: Annotated[
        Path | None, Parameter(name=("--out", "-o"), help="Also write the result to this file, JSON.")
    ] = None,
    overwrite: Overwrite = False,
    save: Annotated[
        str,
        Parameter(
            name="--save",
            help="Save the result as this camera of the saved target. Default: it is only printed.",
        ),
    ] = "",
    access: Access = _ACCESS,
) -> int:
    """Measure where a camera is, on the flange or beside the arm, with a board that it sees.

    Begin where the camera sees the whole board from the front. The arm turns a little, chooses postures that see the
    board, and returns; what moves is shown first.

    For example:

        heptarm calibrate eye --camera 0 --target lab1

        heptarm calibrate eye --camera 0 --frame base --kind apriltag --columns 4 --rows 3 --square 0.05 -o eye.json
    """
    made = calibration.Board(columns, rows, square, kind)
    settings = camera_settings(
        size=camera_size, place=camera_place, target=camera_target, frame=camera_frame, scene=camera_scene
    )
    if settings and camera != _SIMULATED:
        raise CommandRejected(
            "the options --camera-... are of a simulated camera",
            parameter="camera",
            value=camera,
            hint="give --camera sim, or leave them out",
        )
    if out is not None:
        writable_file(out, overwrite=overwrite, name="out")
    place = saved_as(save, access.target)
    matrix = _matrix(lens)
    own: dict[str, Any] = {} if camera == _SIMULATED else {"frame": frame}
    source: Any = Camera(**settings) if camera == _SIMULATED else opened_camera(camera)
    with (
        access.target.connect(control=True, state_rate=200.0) as arm,
        closing(arm.camera(source, **own)) as pictures,
    ):
        found = calibration.hand_eye(
            arm, pictures, made, views=views, speed=speed, matrix=matrix, confirm=access.consent(arm)
        )
    result = {
        "frame": found.frame,
        "camera": found.pose.array.tolist(),
        "sigma_m": found.sigma.tolist(),
        "sigma_rad": found.sigma_angle.tolist(),
        "board": found.board.array.tolist(),
        "matrix": found.matrix.tolist(),
        "distortion": found.distortion.tolist(),
        "rms_pixels": found.rms,
        "views": len(found.residuals),
        "suspect": found.is_suspect,
        "saved": bool(place),
    }
    if place:
        found.save(place, save)
    emit(result) if access.as_json else print(found)
    if out is not None:
        _write(out, result)
    if not access.as_json:
        print(outcome("camera", save, place) if out is None or place else f"written to {out}")
    return 0


def _write(out: Path, result: dict[str, Any]) -> None:
    import json

    try:
        out.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise unwritable(out, error, name="out") from None


def _matrix(text: str) -> list[list[float]] | None:
    """Intrinsic matrix of an option's text; None: it is to be measured."""
    if not text:
        return None
    fx, fy, cx, cy = numbers_of(
        text, "lens", ",", float, form="FX,FY,CX,CY in pixels, such as 600,600,320,240"
    )
    return [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]
