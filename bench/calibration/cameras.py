"""Where a camera is, from rendered pictures with noise and blur; and the rate of live pictures beside a moving arm."""

from __future__ import annotations

import math
import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import numpy as np

import heptarm as ha
from bench.measure.figure import Figure, benchmark
from heptarm import calibration, model
from heptarm.values.robot import robot

HOME = ha.deg(0, 25, 0, -90, 0, 65, 0)
#: Limits of the error [mm], [deg], and of the rate [1/s].
PLACE, TURN, RATE = 0.5, 0.05, 30.0
#: A lens that bends the pictures.
BENT = (0.12, -0.08, 0.001, -0.002, 0.0)
#: Where the camera is, and what it looks at, by its frame [m].
PLACES = {"flange": ((0.06, -0.03, 0.04), (0.05, 0.0, 0.4)), "base": ((0.9, -0.2, 0.4), (0.5, 0.0, 0.4))}


@benchmark("hand_eye")
def hand_eye() -> Iterator[Figure]:
    """Error of a camera on the flange and beside the arm, found from pictures with noise and blur."""
    yield from _camera("flange")
    yield from _camera("base")
    yield from _camera("flange", bent=BENT)


def _camera(
    frame: Literal["flange", "base"], *, bent: tuple[float, float, float, float, float] | None = None
) -> Iterator[Figure]:
    """Error of a camera; of one whose lens bends the pictures, which is estimated, too."""
    place, target = PLACES[frame]
    lens = ha.Camera(
        place,
        target,
        fov=0.8,
        frame=frame,
        rate=15,
        distortion=bent or (0.0, 0.0, 0.0, 0.0, 0.0),
        noise=3.0,
        blur=0.8,
        shadows=False,
    )
    unknown: dict[str, Any] = {"distortion": np.zeros(5), "refine": True} if bent else {}
    board = calibration.Board()
    flange = ha.Pose.from_matrix(model.forward(robot("iiwa14"), HOME))
    seen = ha.Pose.at(0, 0, 0.33) @ ha.Pose.at(*-board.centre)
    at = flange @ lens.pose @ seen if frame == "flange" else flange.inverse() @ lens.pose @ seen
    with tempfile.TemporaryDirectory() as folder:
        file = board.save_scene(Path(folder) / "board.xml", at=at, on_flange=frame == "base")
        target_text = f"sim://iiwa14?speed=5&scene={file}"
        with ha.connect(target_text, watchdog=5.0, timeout=60.0) as arm, arm.camera(lens) as pictures:
            arm.move(ha.ptp(HOME))
            found = calibration.hand_eye(arm, pictures, board, views=16, speed=1.0, **unknown)
    detail: dict[str, Any] = {"views": len(found.residuals), "rms_pixels": found.rms}
    off = found.pose @ lens.pose.inverse()
    error = float(np.linalg.norm(found.pose.xyz - lens.pose.xyz))
    name = f"hand_eye_{frame}" if bent is None else "hand_eye_bent"
    detail |= {} if bent is None else {"distortion": found.distortion.tolist()}
    sigma = {"sigma_mm": (1e3 * found.sigma).tolist()}
    yield Figure(f"{name}_place", 1e3 * error, "mm", limit=PLACE, detail=detail | sigma)
    yield Figure(
        f"{name}_turn", math.degrees(float(np.linalg.norm(off.rotvec))), "deg", limit=TURN, detail=detail
    )


@benchmark("live_pictures")
def live_pictures() -> Iterator[Figure]:
    """Live pictures of 320 by 240 in a second, of a camera on the flange of an arm that moves."""
    lens = ha.Camera(
        (0.14, 0, 0.03), (0.14, 0, 0.5), fov=1.0, size=(320, 240), rate=30, frame="flange", shadows=False
    )
    with ha.connect("sim://iiwa14?scene=table", watchdog=5.0) as arm, arm.camera(lens) as pictures:
        arm.move(ha.ptp(HOME))
        pictures.read()
        handle = arm.start([ha.ptp(HOME + turn) for turn in (0.3, -0.2, 0.0)], speed=0.2)
        began, count, dropped = time.monotonic(), 0, pictures.dropped
        while time.monotonic() < began + 5.0:
            pictures.read()
            count += 1
        handle.cancel()
        rate = count / (time.monotonic() - began)
        yield Figure(
            "live_pictures",
            rate,
            "1/s",
            limit=0.95 * RATE,
            at_least=True,
            disturbed=os.getloadavg()[0] > (os.cpu_count() or 1),
            detail={"dropped": pictures.dropped - dropped},
        )
