"""The real RViz of ROS 1 on a virtual display shows the arm: with LONG=1, after scripts/setup_rviz.sh.

The picture is kept as build/rviz.png.
"""

from __future__ import annotations

import shutil
import struct
import subprocess
import zlib
from pathlib import Path

import numpy as np
import pytest
import rospy
from sensor_msgs.msg import JointState

from tests.conformance.stage import ROOT
from tests.long import LONG
from tests.ros1.peer import until

PICTURE = ROOT / "build" / "rviz.png"

pytestmark = [
    pytest.mark.skipif(not LONG, reason="LONG=1 runs it"),
    pytest.mark.skipif(
        not (shutil.which("rviz") and shutil.which("Xvfb")), reason="run scripts/setup_rviz.sh first"
    ),
]


def screen(file: Path) -> np.ndarray:
    """Red, green, blue of a screen that Xvfb maps to a file in XWD's format, shape (height, width, 3)."""
    data = file.read_bytes()
    header = struct.unpack(">25I", data[:100])
    width, height, line, colours = header[4], header[5], header[12], header[19]
    begin = header[0] + 12 * colours
    pixels = np.frombuffer(data, np.uint8, height * line, begin).reshape(height, line)[:, : 4 * width]
    return pixels.reshape(height, width, 4)[:, :, 2::-1]


def save(picture: np.ndarray) -> None:
    height, width = picture.shape[:2]
    rows = b"".join(b"\0" + row.tobytes() for row in picture)
    chunks = (
        (b"IHDR", struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)),
        (b"IDAT", zlib.compress(rows)),
        (b"IEND", b""),
    )
    parts = [
        struct.pack(">I", len(text)) + name + text + struct.pack(">I", zlib.crc32(name + text))
        for name, text in chunks
    ]
    PICTURE.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts))


def orange(picture: np.ndarray) -> np.ndarray:
    """Which pixels have the colour of the arm's rings, shape (height, width)."""
    red, green, blue = (picture[..., index].astype(int) for index in range(3))
    return np.asarray((red > 120) & (red - green > 50) & (green - blue > 10))


def test_rviz_shows_the_arm_and_its_motion(
    ros: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LIBGL_ALWAYS_SOFTWARE", "1")
    monkeypatch.setenv("QT_X11_NO_MITSHM", "1")
    states = rospy.Publisher("joint_states", JointState, queue_size=1)
    posture = [0.3, 0.6, 0.0, -1.3, 0.0, 1.0, 0.0]

    def publish() -> None:
        message = JointState(name=[f"A{i}" for i in range(1, 8)], position=posture)
        message.header.stamp = rospy.Time.now()
        states.publish(message)

    command = [
        "Xvfb",
        "-displayfd",
        "1",
        "-screen",
        "0",
        "1024x768x24",
        "-fbdir",
        str(tmp_path),
        "-nolisten",
        "tcp",
    ]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as display:
        assert display.stdout is not None
        monkeypatch.setenv("DISPLAY", f":{display.stdout.readline().strip()}")
        log = (tmp_path / "log").open("w+")
        launched = subprocess.Popen(
            [
                "roslaunch",
                "--wait",
                "heptarm_description",
                "display.launch",
                "model:=iiwa14",
                "sliders:=false",
            ],
            stdout=log,
            stderr=subprocess.STDOUT,
        )

        def shown() -> list[np.ndarray]:
            assert launched.poll() is None, (tmp_path / "log").read_text()
            publish()
            picture = screen(tmp_path / "Xvfb_screen0")
            return [picture] if orange(picture).sum() > 150 else []

        try:
            (first,) = until(shown, "RViz does not show the arm")
            posture[0], posture[3] = 0.9, -0.9

            def moved() -> list[np.ndarray]:
                return [one for one in shown() if (orange(one) ^ orange(first)).sum() > 150]

            save(until(moved, "the arm in RViz does not move")[0])
            said = (tmp_path / "log").read_text()
            assert "Could not load" not in said and "[ERROR]" not in said, said
        finally:
            launched.terminate()
            launched.wait(60)
            display.terminate()
            states.unregister()
            log.close()
