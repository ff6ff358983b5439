"""The robot's model follows from its device name; an unknown name is an error at start."""

from __future__ import annotations

import subprocess

from tests.cabinet.fake import classes, toolchain

NAMES = {
    "LBR_iiwa_14_R820_1": "iiwa14",
    "LBR_iiwa_7_R800_1": "iiwa7",
    "LBR_Med_7_R800_1": "med7",
    "LBR_Med_14_R820_1": "med14",
}


def test_each_device_name_gives_its_model_and_an_unknown_one_names_the_known_models() -> None:
    command = [toolchain.find_jdk().java, "-cp", classes(), "heptarm.fake.ModelProbe", *NAMES, "KR_AGILUS"]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert lines[:-1] == list(NAMES.values())
    assert "KR_AGILUS" in lines[-1]
    for title in ("LBR iiwa 7 R800", "LBR iiwa 14 R820", "LBR Med 7 R800", "LBR Med 14 R820"):
        assert title in lines[-1]
