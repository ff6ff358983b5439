"""A public class name stands for one idea in the whole project, in Python and in Java.

What is generated from a schema (the protocol's messages, the seam between the doubles and the plant) represents ideas
that have their class elsewhere: a value in `heptarm.values` may have the name of the messages that carry it. The names
of KUKA's classes in the doubles are not ours.
"""

from __future__ import annotations

import ast
import functools
import re
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: Names that stand for two ideas, or for one that two languages implement, with the reason why.
HOMONYMS: dict[str, str] = {
    "Arm": "the same API for programs in the cabinet (Java) and on the workstation (Python)",
    "MotionHandle": "the same API for programs in the cabinet (Java) and on the workstation (Python)",
    "MotionStatus": "the running program, as the cabinet samples it (Java) and as a state has it (Python)",
    "CommandRejected": "the refusal of a request, as the cabinet throws it (Java) and the client raises it (Python)",
    "Watchdog": "the thread that looks for silence (Java), and the longest silence that it accepts (Python)",
    "FrameTag": "the tag of a frame, which each side of the protocol makes and checks in its language",
    "KeyExchange": "the proofs of the key, which each side of the protocol makes and checks in its language",
    "Clock": "the seam to time in both languages",
    "RealClock": "the implementation of Clock on the machine's time in both languages",
    "Plant": "the interface in Java is implemented by the plant in Python",
    "MotionListener": "the interface in Java is called through the one in Python",
    "SharedState": "the two sides of one memory, written by Python and read by Java",
    "Violation": "a field outside the schema's range, in the codecs of both languages",
    "IoDirection": "FRI's own enumeration beside the protocol's; heptarm.fri.protocol distinguishes them",
    "IoType": "FRI's own enumeration beside the protocol's; heptarm.fri.protocol distinguishes them",
    "OperationMode": "FRI's own enumeration beside heptarm's; heptarm.fri.protocol distinguishes them",
    "Redundancy": "FRI's own message beside the value; heptarm.fri.protocol distinguishes them",
    "RobotInfo": "FRI's own message beside the protocol's; heptarm.fri.protocol distinguishes them",
    "Safety": "FRI's own enumeration beside the group of a state; heptarm.fri.protocol distinguishes them",
    "SessionState": "the states of each of the two protocols: heptarm.wire and heptarm.fri",
    "State": "what a program reads: of an arm (heptarm.State), of an FRI session (heptarm.fri.State)",
    "Path": "of a motion in conditions (heptarm.when.path), found around bodies (heptarm.Path): the field's word",
    "Policy": "heptarm.fri.Policy for missing commands, heptarm.rl's trained policy: the field's word in both",
}
_JAVA = re.compile(
    r"^(?:(?:public|final|abstract|static|sealed|strictfp) +)*(?:class|interface|enum|record) +(\w+)", re.M
)
_PYTHON = ROOT / "src" / "heptarm"
_VALUES = "src/heptarm/values/"
_CABINET = ("core", "app", "doubles")
_GENERATED_PYTHON = ("/wire/messages.py", "/wire/codes.py", "/planning/seam.py")
_GENERATED_JAVA = ("/heptarm/wire/", "/heptarm/doubles/seam/")
_GENERATED = "generated from a schema"


def _python() -> dict[str, set[str]]:
    places: dict[str, set[str]] = defaultdict(set)
    for path in _PYTHON.rglob("*.py"):
        where = path.relative_to(ROOT).as_posix()
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].add(_GENERATED if where.endswith(_GENERATED_PYTHON) else where)
    return places


def _java() -> dict[str, set[str]]:
    places: dict[str, set[str]] = defaultdict(set)
    for part in _CABINET:
        sources = ROOT / "cabinet" / part / "src"
        for path in (sources / "heptarm").rglob("*.java"):
            where = path.relative_to(ROOT).as_posix()
            for name in _JAVA.findall(path.read_text(encoding="utf-8")):
                places[name].add(_GENERATED if any(one in where for one in _GENERATED_JAVA) else where)
    return places


@functools.cache
def duplicates() -> dict[str, list[str]]:
    """Names with more than one place."""
    places = _python()
    assert len(places) > 100, "the walk has found the classes"
    for name, where in _java().items():
        places[name] |= where
    return {
        name: sorted(where)
        for name, where in sorted(places.items())
        if len(where) > 1 and not _carried(where)
    }


def _carried(where: set[str]) -> bool:
    """Whether a name is that of a value and of the messages that carry it, and of nothing else."""
    return len(where) == 2 and _GENERATED in where and any(place.startswith(_VALUES) for place in where)


def test_a_class_name_stands_for_one_idea() -> None:
    twice = {name: where for name, where in duplicates().items() if name not in HOMONYMS}
    listed = "\n".join(f"  {name}: {', '.join(where)}" for name, where in twice.items())
    assert not twice, (
        f"{len(twice)} class names stand for more than one thing:\n{listed}\n"
        "Rename one after what it is in the field's terms; a leading underscore does for what one module needs. "
        "Where a package distinguishes two for a reason, add the name to HOMONYMS with the reason."
    )


def test_what_is_distinguished_is_there_and_has_a_reason() -> None:
    gone = HOMONYMS.keys() - duplicates().keys()
    assert not gone, f"{sorted(gone)} stand for one thing only: take them out of HOMONYMS"
    assert all(len(reason.split()) > 3 for reason in HOMONYMS.values())
