"""One word for one idea, the field's word: words that heptarm does not use, and their replacements.

Identifiers are read word by word, so `max_octets` and `OctetReader` are found as well as prose. A word that also has a
common plain meaning is allowed in that meaning; `but` describes it.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PLACES = (
    "src",
    "cabinet",
    "docs",
    "examples",
    "ros1",
    "ros2",
    "bench",
    "schema",
    "scripts",
    "tests",
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "Makefile",
)
KINDS = {
    ".py",
    ".java",
    ".md",
    ".c",
    ".h",
    ".toml",
    ".xml",
    ".xacro",
    ".urdf",
    ".srv",
    ".msg",
    ".action",
    ".yaml",
}
KINDS |= {".sh", ".launch", ".cfg", ".json", ".txt", ".rst"}
#: Not in our words: KUKA's names in the doubles, upstream's interfaces, builds, and the list of the words itself.
FOREIGN: tuple[str, ...] = (
    "cabinet/doubles/src/com/",
    "cabinet/doubles/src/javax/",
    "/interfaces/",
    "docs/_build/",
    "/jars/",
)
FOREIGN += ("tests/house/test_words.py",)
SHOWN = 60


@dataclass(frozen=True)
class Rule:
    """A word that is not used.

    Attributes:
        word: regular expression of whole words, in lower case.
        instead: what is said instead.
        but: regular expression of text with the word that is fine.
        exact: matched in the text as it stands, not word by word: `class Rack`, not `rack`.
    """

    word: str
    instead: str
    but: str = ""
    exact: bool = False


RULES = (
    Rule(
        r"ways?",
        "path (geometry) or trajectory (path with time); else say it without",
        but=r"(?:this|that|same|other|either|any|one|two|no|which|every|best|only|right|wrong|safe|long|half|all the|"
        r"by the|in the|on the|under|out of the|in a|a|the) ways?\b(?! (?:through|of joints|in joint))|one-way|"
        r"ways? (?:to|of doing)\b",
    ),
    Rule(r"courses?", "path (geometry) or trajectory (path with time)", but=r"of course"),
    Rule(r"routes?", "path (geometry) or trajectory (path with time)"),
    Rule(r"leads?|led", "follow, move along, guide", but=r"leads? to|leading|LED"),
    Rule(r"gone along|goes along|goes over into", "follow, move along, transition to"),
    Rule(r"told|tells|hears? of|heard of", "reported, sends, receives, no event received"),
    Rule(r"says", "reports, states, sends"),
    Rule(r"wish|wishes|wished|wants|demands?|demanded", "request, command, target", but=r"on-demand"),
    Rule(r"moved frames?", "tool frame or TCP (say which), or motion frame"),
    Rule(r"(?:link|connection|it) (?:stands|is up)", "is connected", but=r"it is up to"),
    Rule(r"octets?", "bytes"),
    Rule(r"anew", "again"),
    Rule(r"who(?:m)?ever", "any client that"),
    Rule(r"whatever becomes of|what becomes of", "outcome"),
    Rule(r"bears? (?:a|the|its|his) names?|bearing (?:a|the|its) names?", "is named"),
    Rule(
        r"yields|yielded|yielding|gives? way|giving way|softly|soft",
        "is compliant",
        but=r"soft(?:ware| ?max| wrap)|soft limits?|soft reset|[\"`]soft[\"`]|=soft\b|modes\.yielding",
    ),
    Rule(r"furnish\w*", "provide"),
    Rule(r"heed\w*", "obey"),
    Rule(r"hung on|hangs on|hanging on", "attached"),
    Rule(r"pacers?|paced by", "realtime loop (a thread), speed override (a factor)"),
    Rule(r"rehears\w*", "warm up (caches)"),
    Rule(
        r"shares?",
        "fraction",
        but=r"shared|sharing|shares? (?:the|a|an|its|their|this|memory|one|it|them)\b|to share|share/|\"share\"|"
        r"pkg[- ]share|package share|PACKAGE SHARE|share directory|/share\b|show.share.button|(?:row|column).shares\b",
    ),
    Rule(r"\b(?:class|interface|enum|record) Warden\b", "SafetyMonitor", exact=True),
    Rule(r"\b(?:class|interface|enum|record) Rack\b", "ToolTable", exact=True),
    Rule(r"\b(?:class|interface|enum|record) Fitting\b", "ToolChange", exact=True),
    Rule(r"\b(?:class|interface|enum|record) Spring\b", "CartesianImpedance", exact=True),
    Rule(r"\b(?:class|interface|enum|record) Steering\b", "ServoHandle", exact=True),
    Rule(r"\b(?:class|interface|enum|record) Until\b", "StopCondition", exact=True),
    Rule(r"\b(?:class|interface|enum|record) \w*Burden\b", "Payload", exact=True),
    Rule(r"\b(?:class|interface|enum|record) Desk\b", "ApplicationServices", exact=True),
    Rule(r"\b(?:class|interface|enum|record) \w*Insight\b", "SimulatorProbe", exact=True),
)
#: Any of the words, in lower case and in a text as it stands: a quick check, since most texts and lines have none.
_ANY = re.compile(rf"\b(?:{'|'.join(rule.word for rule in RULES if not rule.exact)})\b")
_ANY_EXACT = re.compile("|".join(rule.word for rule in RULES if rule.exact))
_INSIDE = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|_")


def files() -> Iterator[Path]:
    """Every text of ours."""
    for place in PLACES:
        top = ROOT / place
        for path in [top] if top.is_file() else sorted(top.rglob("*")):
            name = path.relative_to(ROOT).as_posix()
            if path.is_file() and path.suffix in KINDS and not any(part in f"/{name}" for part in FOREIGN):
                yield path


def has_any(text: str) -> bool:
    """Whether a text has a word that may be one of those that are not used."""
    return bool(_ANY.search(_INSIDE.sub(" ", text).lower()) or _ANY_EXACT.search(text))


def found_in(line: str) -> Iterator[tuple[str, Rule]]:
    """The words of a line that are not used."""
    if not has_any(line):
        return
    words = _INSIDE.sub(" ", line)
    for rule in RULES:
        text = line if rule.exact else words
        pattern = rule.word if rule.exact else rf"(?i:(?<!\w)(?:{rule.word})(?!\w))"
        for match in re.finditer(pattern, text):
            fine = re.finditer(rule.but, text, re.I) if rule.but else ()
            if not any(one.start() < match.end() and match.start() < one.end() for one in fine):
                yield match[0], rule


def test_the_words_are_the_fields() -> None:
    lines: list[str] = []
    count: Counter[str] = Counter()
    for path in files():
        text = path.read_text(encoding="utf-8", errors="replace")
        for number, line in enumerate(text.splitlines() if has_any(text) else (), 1):
            for word, rule in found_in(line):
                count[f"{word.lower()} -> {rule.instead}"] += 1
                lines.append(f"{path.relative_to(ROOT)}:{number}: {word!r}; use: {rule.instead}")
    shown = "\n".join([*lines[:SHOWN], f"... {len(lines) - SHOWN} more" if len(lines) > SHOWN else ""])
    sums = "\n".join(f"{many:5} {what}" for what, many in count.most_common())
    assert not lines, f"{len(lines)} words that heptarm does not use:\n{sums}\n{shown}"


@pytest.mark.parametrize(
    "line",
    [
        "max_octets = 3",
        "class OctetReader:",
        "# what the cabinet tells unasked",
        "a way through the points",
        "the share of the time",
        "class Rack:",
        "bears a name",
    ],
)
def test_such_a_line_is_found(line: str) -> None:
    assert list(found_in(line))


@pytest.mark.parametrize(
    "line",
    [
        "there is no way to stop it",
        "either way it stops",
        "of course",
        "shared memory",
        "both share the clock",
        "    yield arm",
        "always, halfway, space, pacemaker",
        "until it is at rest",
        "software",
        "the LED is on",
    ],
)
def test_plain_english_is_fine(line: str) -> None:
    assert not [word for word, _ in found_in(line)]
