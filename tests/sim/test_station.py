"""The station setup of a project: its robot and media flange are simulated, or contradicted aloud."""

from __future__ import annotations

from pathlib import Path

import pytest

from heptarm.errors import CommandRejected
from heptarm.sim.runtime.application import missing_options
from heptarm.sim.runtime.station import find_station, read_station, simulated_robot
from heptarm.values.simulator_options import SimulatorOptions
from tests.sim.station_setup import setup


def chosen(folder: Path, text: str, **options: str) -> tuple[str, tuple[str, ...]]:
    data = folder / "src" / "RoboticsAPI.data.xml"
    data.parent.mkdir(exist_ok=True)
    data.write_text("<persistence/>")
    (folder / "StationSetup.cat").write_text(text)
    arm, notes = simulated_robot(SimulatorOptions(project=data, **options))  # type: ignore[arg-type]
    return arm.name, notes


@pytest.mark.parametrize(
    ("item", "name", "model"),
    [
        ("com.kuka/LBR5_7kg", "LBR_iiwa_7_R800_1", "iiwa7"),
        ("com.kuka/LBR5_14kg", "left arm", "iiwa14"),
        ("com.kuka/LBR5_7kgMed", "LBR_Med_7_R800_1", "med7"),
        ("com.kuka/Robot", "LBR_Med_14_R820_1", "med14"),
    ],
)
def test_the_robot_of_a_project(tmp_path: Path, item: str, name: str, model: str) -> None:
    assert chosen(tmp_path, setup(item, name, None)) == (model, ())


def test_the_media_flange_of_a_project(tmp_path: Path) -> None:
    assert chosen(tmp_path, setup()) == ("iiwa7+touch", ())
    assert chosen(tmp_path, setup(flange=("None (M0)", "MADA=M0&amp;IOConfig=Default"))) == ("iiwa7", ())
    name, (note,) = chosen(tmp_path, setup(flange=("Medien-Flansch", "MADA=MF&amp;IOConfig=Default")))
    assert name == "iiwa7" and 'flange "Medien-Flansch"' in note and "is not known to heptarm" in note
    unknown = setup(flange=("Medien-Flansch", "MADA=MF&amp;IOConfig=Default"))
    assert chosen(tmp_path, unknown, flange="0.035") == ("iiwa7+0.035", ())


def test_what_contradicts_the_project_is_said(tmp_path: Path) -> None:
    name, notes = chosen(tmp_path, setup(), model="iiwa14", flange="plain")
    assert name == "iiwa14"
    assert "the project is for an iiwa7" in notes[0] and "simulated is an iiwa14" in notes[0]
    assert "has the flange touch" in notes[1] and "simulated is the flange plain" in notes[1]
    name, (note,) = chosen(tmp_path, setup("com.kuka/KR_Agilus", "KR6", None))
    assert name == "iiwa14" and "names no robot that heptarm knows" in note


def test_options_of_a_project_that_its_cabinet_lacks_are_said(tmp_path: Path) -> None:
    source = tmp_path / "src" / "Own.java"
    source.parent.mkdir()
    used = ("fastRobotInterface.FRISession", "motionModel.smartServoLIN.SmartServoLIN")
    source.write_text(
        "".join(f"import com.kuka.connectivity.{name};\n" for name in used)
        + "// import com.kuka.connectivity.motionModel.directServo.DirectServo;\n"
    )
    items = {
        "com.kuka.connectivity.smartServo": "1.17.0",
        "com.kuka.connectivity.smartServoLIN": "1.15.0",
        "com.kuka.connectivity.smartServoLIN.exampleApplications": "NONE",
        "com.kuka.connectivity.fastRobotInterface": "NONE",
        "com.kuka.connectivity.fastRobotInterface.clientSDK": "1.0",
    }
    (tmp_path / "StationSetup.cat").write_text(setup(software=items))
    options = read_station(tmp_path / "StationSetup.cat").options
    assert options == {"Smart Servo Motion Extension", "Smart Servo Linear Motion Extension"}
    (note,) = missing_options(tmp_path)
    assert '"Fast Robot Interface Extension"' in note and "StationSetup.cat" in note
    (tmp_path / "StationSetup.cat").write_text(setup())
    assert missing_options(tmp_path) == [], "a file that lists no software leaves options open"


def test_no_station_setup_is_an_iiwa_14(tmp_path: Path) -> None:
    assert find_station(tmp_path) is None
    arm, notes = simulated_robot(SimulatorOptions())
    assert (arm.name, notes) == ("iiwa14", ())


@pytest.mark.parametrize("text", ["", "no xml", "<a>", '<?xml version="1.0" encoding="klingon"?><a/>'])
def test_a_broken_station_setup_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "StationSetup.cat"
    file.write_text(text)
    with pytest.raises(CommandRejected, match=r"StationSetup\.cat is not a station setup"):
        read_station(file)
