"""A Sunrise project's StationSetup.cat: which robot the project is for, its media flange, the options of its cabinet.

The safety configuration beside it, `SafetyConfiguration.sconf`, is binary and its format is not public: it is not read.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import parse_qs
from xml.etree import ElementTree

from heptarm.values.files import read_xml
from heptarm.values.robot import FLANGES, Flange, RobotModel, robot
from heptarm.values.simulator_options import SimulatorOptions

#: Workbench's file name of the station setup.
FILE = "StationSetup.cat"
_DEFAULT = "iiwa14"
#: As in com.kuka/LBR5_7kg, com.kuka/LBR5_7kgMed and LBR_iiwa_14_R820_1.
_LBR = re.compile(r"LBR.*?_(7|14)(?:kg|_R8)", re.IGNORECASE)
#: Names of a flange by Workbench's name of its machine data.
_MACHINE_DATA = {"M0": "plain", "MFT": "touch"}
#: Options of a cabinet by Workbench's names of their items, of Sunrise 1.5 and later: what they are called.
_OPTIONS = (
    (re.compile(r"smartServo(ApiExtension)?$", re.IGNORECASE), "Smart Servo Motion Extension"),
    (re.compile(r"smartServoLIN(ApiExtension)?$", re.IGNORECASE), "Smart Servo Linear Motion Extension"),
    (re.compile(r"directServo(ApiExtension)?$", re.IGNORECASE), "Direct Servo Motion Extension"),
    (
        re.compile(r"(connectivity\.fastRobotInterface|FastRobotInterfaceApiExtension)$", re.IGNORECASE),
        "Fast Robot Interface Extension",
    ),
    (re.compile(r"HandGuidingFeature$"), "Hand-Guiding Support"),
)
#: So many folders above that of the project's data may have the station setup.
_ABOVE = 2


@dataclass(frozen=True, slots=True)
class StationSetup:
    """The robot of a project.

    Attributes:
        file: the station setup.
        model: name of the robot without flange; "": one that heptarm does not know, or none.
        flange: its media flange; None: the file names none, or one whose height is not established.
        flange_title: Workbench's name of that flange; "": the file names none.
        options: titles of the options that the cabinet has; None: the file lists no software.
    """

    file: Path
    model: str
    flange: Flange | None
    flange_title: str
    options: frozenset[str] | None = None


def find_station(place: Path) -> Path | None:
    """The station setup in a folder, or in one of those above; None: there is none.

    Args:
        place: a project's folder, its folder of sources, or its file of data.
    """
    folder = place.resolve()
    folder = folder if folder.is_dir() else folder.parent
    for parent in (folder, *folder.parents[:_ABOVE]):
        if (parent / FILE).is_file():
            return parent / FILE
    return None


def read_station(file: Path) -> StationSetup:
    """Read a station setup.

    Raises:
        CommandRejected: the file cannot be read, or is not XML.
    """
    tree = read_xml(file, "a station setup", name="project")
    options = _options(tree)
    for item in tree.iter("TopologyItem"):
        names = (item.get("itemPath", ""), item.get("name", ""))
        match = next((found for name in names if (found := _LBR.search(name))), None)
        if match is not None:
            kind = "med" if "med" in "".join(names).lower() else "iiwa"
            flange, title = _flange(item)
            return StationSetup(file, f"{kind}{match[1]}", flange, title, options)
    return StationSetup(file, "", None, "", options)


def _options(tree: ElementTree.Element) -> frozenset[str] | None:
    """Titles of the options that a station setup selects; None: it lists no software."""
    items = list(tree.iter("SoftwareItem"))
    selected = [
        item.get("itemPath", "") for item in items if item.get("selectedVersion", "NONE") not in ("", "NONE")
    ]
    chosen = (title for pattern, title in _OPTIONS if any(pattern.search(path) for path in selected))
    return frozenset(chosen) if items else None


def _flange(item: ElementTree.Element) -> tuple[Flange | None, str]:
    """The media flange of a robot's entry, and Workbench's name of it."""
    for element in item.iterfind("Property[@key='MAM']"):
        value = element.find("Value")
        if value is not None:
            data = parse_qs(value.text or "").get("MADA", [""])[0]
            name = _MACHINE_DATA.get(data)
            return None if name is None else FLANGES[name], value.get("displayName", "") or data
    return None, ""


def simulated_robot(options: SimulatorOptions) -> tuple[RobotModel, tuple[str, ...]]:
    """The robot that options and the project's station setup name together.

    Returns:
        The robot, and what in it contradicts the station setup or is not known.

    Raises:
        CommandRejected: there is no such robot or flange, or the station setup cannot be read.
    """
    file = options.station
    if file is None and options.project is not None:
        file = find_station(options.project)
    station = StationSetup(Path(), "", None, "") if file is None else read_station(file)
    chosen = robot(options.model or station.model or _DEFAULT, flange=options.flange or None)
    is_stated = bool(options.flange) or chosen.flange.height > 0
    arm = chosen if is_stated or station.flange is None else chosen.with_flange(station.flange)
    if file is None:
        return arm, ()
    notes = []
    if not station.model:
        notes.append(f"{file} names no robot that heptarm knows; simulated is an {arm.name}")
    elif station.model != arm.base_name:
        notes.append(f"the project is for an {station.model} ({file}); simulated is an {arm.name}")
    if station.flange is not None and station.flange != arm.flange:
        notes.append(
            f"the project's robot has the flange {station.flange.name} ({file}); simulated is the flange "
            f"{arm.flange.name}"
        )
    elif station.flange is None and station.flange_title and not is_stated:
        notes.append(
            f'the height of the project\'s flange "{station.flange_title}" ({file}) is not known to heptarm; simulated '
            "is a plain one: measure how far its frame is above a plain flange and give that as flange, in metres"
        )
    return arm, tuple(notes)
