"""A foreign Sunrise application: compiles its sources against the doubles and finds its project file."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import zipfile
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from heptarm import _resources
from heptarm.errors import CommandRejected, MissingExtra
from heptarm.sim.runtime import station
from heptarm.sim.runtime.addresses import AddressMap
from heptarm.sim.runtime.moved import renamed
from heptarm.values.files import read_bytes, read_xml

#: Every address stays.
UNMAPPED = AddressMap({})

#: Workbench's file name of process data, frames and tools.
PROJECT = "RoboticsAPI.data.xml"

_CLASS = re.compile(r"\bclass\s+(\w+)(?:<[^{]*?>)?\s+extends\s+(?:\w+\.)*(\w+)")
_ROOTS = ("RoboticsAPIApplication",)
_BACKGROUND = ("RoboticsAPIBackgroundTask", "RoboticsAPICyclicBackgroundTask")
#: Folders with Workbench's copies, KUKA's own jars, and programs for the PC.
_LEFT_OUT = ("bin", "KUKAJavaLib", "FastRobotInterface_Client_Source")
_PACKAGE = re.compile(r"^\s*package\s+([\w.]+)\s*;", re.MULTILINE)
#: A comment, or a literal in which the signs of a comment mean nothing.
_COMMENT = re.compile(r"""("(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*')|/\*.*?\*/|//[^\n]*""", re.DOTALL)
#: Packages that Java 6 offers and Java 17 does not: internal ones, CORBA, XML binding, web services and a few more.
_GONE = (
    r"(?:com\.)?sun\.[\w.]+?|org\.omg(?:\.\w+)+?|javax\.(?:xml\.bind|xml\.ws|xml\.soap|jws|activation|annotation|transaction|"
    r"activity|rmi)(?:\.\w+)*?|java\.(?:security\.acl|rmi\.activation)"
)
_INTERNAL = re.compile(
    rf"^[ \t]*import\s+(?:static\s+)?({_GONE}|com\.kuka\.[\w.]+?)\.(\w+|\*)\s*;", re.MULTILINE
)
#: Packages of these names that a JDK of today still offers.
_STILL_THERE = re.compile(
    r"com\.sun\.(net\.httpserver|management|jdi|source|tools|security|nio\.sctp)\b|sun\.(misc|reflect)$"
)
#: For so short a run javac's own code needs no thorough compilation: half the time, and half of it in one thread.
_QUICKLY = ("-J-XX:TieredStopAtLevel=1", "-J-XX:+UseSerialGC")
#: What javac reports only because a class is missing that another error names.
_CONSEQUENCE = ("method does not override or implement", "exception ")
#: Beginnings of packages that the doubles will not have, and what to say of them.
_OTHER_SYSTEMS = (
    (
        r"com\.kuka\.(nav|resource|kmpOmniMove|roboticsAPI\.deviceModel\.kmp|roboticsAPI\.motionModel\.kmp)\b",
        "the project drives a mobile platform (KMR, KMP): the virtual cabinet has the arm only; it would need a "
        "simulated platform and doubles of com.kuka.nav",
    ),
    (
        r"com\.kuka\.(sensitivity|geometry|math|device|servoing|fri|scenegraph|threading|statistics|time|motion|condition|io|"
        r"handguiding|jogging|statuscontroller|med\.devicemodel|med\.cyclicbraketest)\b",
        "the project is for Sunrise.OS 2, whose packages differ: the virtual cabinet has 1.x; it would need doubles of "
        "those packages, whose behaviour is not public",
    ),
)
#: What of Sunrise needs an option of the cabinet, and what that is called.
_NEED_OPTIONS = (
    (r"motionModel\.(smartServo\.|SmartServo\b|ISmartServoRuntime\b)", "Smart Servo Motion Extension"),
    (r"motionModel\.(smartServoLIN\.|SmartServoLIN\b)", "Smart Servo Linear Motion Extension"),
    (r"motionModel\.(directServo\.|DirectServo\b)", "Direct Servo Motion Extension"),
    (r"connectivity\.(fri|fastRobotInterface)\.", "Fast Robot Interface Extension"),
    (r"motionModel\.HandGuidingMotion\b|\bhandGuiding\(", "Hand-Guiding Support"),
)
#: javac reports the first 100 errors only, and none in method bodies after a wrong import.
_EVERY_ERROR = ("-Xmaxerrs", "100000", "--should-stop=ifError=FLOW")
_ERROR = re.compile(r"^(.+?\.java):(\d+): error: (.*)$")
_DETAIL = re.compile(r"^\s+(symbol|location):\s+(.*)$")


@dataclass(frozen=True, slots=True)
class Application:
    """A compiled application.

    Attributes:
        main: its class.
        classes: folder with all classes.
        project: the project's `RoboticsAPI.data.xml`; None: there is none.
        station: the project's `StationSetup.cat`; None: there is none.
        background: classes of its background tasks.
        jars: its own libraries.
        left_out: why a class or a file of the project is missing beside the application.
    """

    main: str
    classes: Path
    project: Path | None
    station: Path | None = None
    background: tuple[str, ...] = ()
    jars: tuple[Path, ...] = ()
    left_out: tuple[str, ...] = ()


def find(folder: Path) -> list[str]:
    """Full names of the applications in a folder of Java sources."""
    return _descendants(_sources(folder, "java"), _ROOTS)


def background(folder: Path) -> list[str]:
    """Full names of the background tasks in a folder of Java sources."""
    return _descendants(_sources(folder, "java"), _BACKGROUND)


def _sources(folder: Path, suffix: str) -> list[Path]:
    """Files of a project without Workbench's copies and libraries; Java only where Workbench compiles it."""
    found = [
        file
        for file in sorted(folder.rglob(f"*.{suffix}"))
        if not set(_LEFT_OUT) & set(file.relative_to(folder).parts[:-1])
    ]
    compiled = _source_folders(folder) if suffix == "java" else {}
    if not compiled:
        return found
    return [
        file
        for file in found
        for root, excluded in compiled.items()
        if file.is_relative_to(root) and not _matches(file.relative_to(root).as_posix(), excluded)
    ]


def _source_folders(folder: Path) -> dict[Path, tuple[str, ...]]:
    """Folders of sources in a project's .classpath, and the patterns that each excludes; none: it is no project."""
    file, usual = folder / ".classpath", folder / "src"
    if not file.is_file():
        return {usual: ()} if (folder / station.FILE).is_file() and usual.is_dir() else {}
    try:
        entries = read_xml(file, "a class path", name="app").iter("classpathentry")
    except CommandRejected:
        return {}  # it is Eclipse's, and the sources are there without it
    return {
        folder / path: tuple(filter(None, entry.get("excluding", "").split("|")))
        for entry in entries
        if entry.get("kind") == "src"
        and not (path := entry.get("path", "")).startswith("/")
        and (folder / path).is_dir()
    }


def _matches(path: str, patterns: tuple[str, ...]) -> bool:
    """Whether one of Eclipse's patterns fits a path: a folder with a slash at its end, a file, or with * and **."""
    return any(
        path.startswith(pattern) if pattern.endswith("/") else fnmatch(path, pattern) for pattern in patterns
    )


def _descendants(sources: list[Path], roots: tuple[str, ...]) -> list[str]:
    """Concrete classes that extend one of the roots, directly or through other classes of the project."""
    found: dict[str, tuple[str, str, bool]] = {}
    for source in sources:
        text = _without_comments(read_source(source))
        package = _PACKAGE.search(text)
        for match in _CLASS.finditer(text):
            full = f"{package[1]}.{match[1]}" if package else match[1]
            abstract = re.search(r"\babstract\s+(?:\w+\s+)*$", text[: match.start()]) is not None
            found[full] = (match[1], match[2], abstract)
    known, before = set(roots), -1
    while len(known) != before:
        before = len(known)
        known |= {simple for simple, parent, _ in found.values() if parent in known}
    return [full for full, (simple, _, abstract) in found.items() if simple in known and not abstract]


def read_source(file: Path) -> str:
    """Text of a Java source: UTF-8 with or without a byte order mark, otherwise windows-1252 as Workbench writes it."""
    data = read_bytes(file)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        # the few bytes that windows-1252 leaves open stand in comments, where they do no harm
        return data.decode("windows-1252", errors="replace")


def _without_comments(text: str) -> str:
    return _COMMENT.sub(lambda match: match[1] or " ", text)


def _in_literals(text: str, addresses: AddressMap) -> str:
    """Replace addresses in string literals; comments stay."""
    return _COMMENT.sub(lambda match: addresses.apply(match[1]) if match[1] else match[0], text)


def unused_addresses(folder: Path, data: Path | None, addresses: AddressMap) -> list[str]:
    """Addresses that neither a literal of the sources nor the project file contains."""
    literals = (
        match[1]
        for source in _sources(folder, "java")
        for match in _COMMENT.finditer(read_source(source))
        if match[1]
    )
    return addresses.unused([*literals, read_source(data) if data is not None else ""])


def missing_options(folder: Path) -> list[str]:
    """What the project's sources use of options that its station setup does not install on the cabinet.

    Raises:
        CommandRejected: the station setup cannot be read.
    """
    file = _configuration(folder)[1]
    installed = None if file is None else station.read_station(file).options
    if installed is None:
        return []
    texts = [_without_comments(read_source(source)) for source in _sources(folder, "java")]
    return [
        f'the project uses the option "{title}", which its station setup does not install ({file}): the virtual '
        "cabinet has it, the project's robot does not"
        for pattern, title in _NEED_OPTIONS
        if title not in installed and any(re.search(pattern, text) for text in texts)
    ]


def _modern(text: str, own: frozenset[str] = frozenset()) -> str:
    """Blank unused imports of packages inside old JREs, and of classes of Sunrise that the doubles lack.

    Every line keeps its number.

    Args:
        text: of a source.
        own: full names of the project's classes.
    """
    if not _INTERNAL.search(text):
        return text
    code = _INTERNAL.sub("", _without_comments(text))

    def kept(match: re.Match[str]) -> str:
        if match[1].startswith("com.kuka."):
            known = own | _sunrise_names()
            if match[2] == "*":
                # of a package, or of a class: `import static ...BasicMotions.*`
                unused = match[1] not in known and not any(name.startswith(f"{match[1]}.") for name in known)
            else:
                named = f"{match[1]}.{match[2]}" in known or match[1] in known  # a member of a class
                unused = not named and re.search(rf"\b{match[2]}\b", code) is None
        elif match[2] == "*":
            # a jar of the project may have a public package; internal ones are in no jar
            unused = re.match(r"(com\.)?sun\.", match[1]) is not None and not _STILL_THERE.match(match[1])
        else:
            unused = re.search(rf"\b{match[2]}\b", code) is None
        return re.sub(r"[^\n]", "", match[0]) if unused else match[0]

    return _INTERNAL.sub(kept, text)


def _libraries(folder: Path) -> tuple[Path, ...]:
    """The project's jars without those with KUKA's classes, which the doubles replace."""
    found = []
    for jar in _sources(folder, "jar"):
        try:
            with zipfile.ZipFile(jar) as file:
                if not any(name.startswith("com/kuka/") for name in file.namelist()):
                    found.append(jar)
        except zipfile.BadZipFile:
            continue  # not a jar in spite of its name
    return tuple(found)


def _checked_jars(jars: tuple[Path, ...]) -> tuple[Path, ...]:
    """Jars that the user names.

    Raises:
        CommandRejected: a file is missing, or is none.
    """
    for jar in jars:
        if not zipfile.is_zipfile(jar):
            raise CommandRejected(
                f"--jar must be a jar file, got {jar}",
                parameter="jar",
                value=str(jar),
                hint="name an existing .jar file",
            )
    return jars


def compile_application(
    folder: Path,
    out: Path,
    *,
    main: str = "",
    addresses: AddressMap = UNMAPPED,
    jars: tuple[Path, ...] = (),
) -> Application:
    """Compile a folder of Java sources against the doubles.

    Args:
        folder: of the project, or of its sources.
        out: an empty folder for the classes.
        main: the application's class, with or without its package; "": the only one.
        addresses: replaced in string literals.
        jars: libraries beside those in the project's folder.

    Raises:
        CommandRejected: no sources, no such application, several of them, no jar, or errors of the compiler.
        MissingExtra: there is no Java compiler.
    """
    sources = _sources(folder, "java")
    if not sources:
        raise CommandRejected(
            f"{folder} contains no Java sources", parameter="app", hint="name the folder of a Sunrise project"
        )
    chosen = _chosen(find(folder), main, folder)
    jars, tasks = (*_libraries(folder), *_checked_jars(jars)), background(folder)
    data, found = _configuration(folder)
    left_out: list[str] = []
    with TemporaryDirectory(prefix="heptarm-sources-") as place:
        copies = _Copies(Path(place), folder, sources, addresses)
        if not main:
            left_out += [
                f"{file} is left out, it does not compile: {text}"
                for file, text in _compile_all(copies, out, jars, chosen=chosen)[0].items()
            ]
            tasks = [task for task in tasks if task in _compiled(out)]
        else:
            _compile(copies, [copies.of(chosen)], out, jars)
            text = read_source(data) if data is not None else ""
            named = {
                name for name in copies.names if "." in name and re.search(rf"\b{re.escape(name)}\b", text)
            }
            for name in sorted({*tasks, *named} - _compiled(out)):
                try:
                    _compile(copies, [copies.of(name)], out, jars)
                except CommandRejected as error:
                    tasks = [task for task in tasks if task != name]
                    left_out.append(f"{name} is left out: {error.text}")
    return Application(chosen, out, data, found, tuple(tasks), jars, tuple(left_out))


def _configuration(folder: Path) -> tuple[Path | None, Path | None]:
    """A project's `RoboticsAPI.data.xml` and `StationSetup.cat`; None for what it lacks."""
    data = next((file for file in _sources(folder, "xml") if file.name == PROJECT), None)
    stations = [file for file in _sources(folder, "cat") if file.name == station.FILE]
    return data, stations[0] if stations else station.find_station(data or folder)


@dataclass(frozen=True, slots=True)
class Survey:
    """What of a project compiles.

    Attributes:
        folder: of the project.
        compiled: full names of the classes whose files compile.
        failed: full name and first error of the others.
        applications: those that compile and can be run.
        hint: what would help the others; "": nothing is left out.
    """

    folder: Path
    compiled: tuple[str, ...]
    failed: tuple[tuple[str, str], ...]
    applications: tuple[Application, ...]
    hint: str


def find_projects(folder: Path) -> list[Path]:
    """Projects of Sunrise in a folder: by their station setup, class path or folder `src`, otherwise its folders.

    Raises:
        CommandRejected: there is no such folder, or no Java in it that names Sunrise.
    """
    if not folder.is_dir():
        raise CommandRejected(
            f"--projects must be a folder, got {folder}", parameter="projects", value=str(folder)
        )
    sources = [file for file in sorted(folder.rglob("*.java")) if b"com.kuka." in read_bytes(file)]
    found = {_project_of(file, folder) for file in sources if not set(_LEFT_OUT) & set(file.parts)}
    if not found:
        raise CommandRejected(
            f"{folder} contains no Java sources of Sunrise",
            parameter="projects",
            value=str(folder),
            hint="name a folder that contains Sunrise projects",
        )
    return sorted(found)


def _project_of(source: Path, folder: Path) -> Path:
    above = [parent for parent in source.parents if parent == folder or folder in parent.parents]
    marked = [
        parent for parent in above if (parent / station.FILE).is_file() or (parent / ".classpath").is_file()
    ]
    named = [parent.parent for parent in above if parent.name == "src" and parent != folder]
    return next(iter([*marked, *named[-1:], *above[-2:]]))


def survey(folder: Path, out: Path, *, jars: tuple[Path, ...] = ()) -> Survey:
    """Compile each class of a project that can be compiled.

    Args:
        folder: of the project.
        out: an empty folder for the classes.
        jars: libraries beside those in the project's folder.

    Raises:
        CommandRejected: a jar that is none.
        MissingExtra: there is no Java compiler.
    """
    libraries = (*_libraries(folder), *_checked_jars(jars))
    data, found = _configuration(folder)
    with TemporaryDirectory(prefix="heptarm-sources-") as place:
        copies = _Copies(Path(place), folder, _sources(folder, "java"), UNMAPPED)
        names = {copies.original(copy.as_posix()): name for name, copy in copies.names.items()}
        left_out, hint = _compile_all(copies, out, libraries)
    failed = tuple((names[file], text) for file, text in sorted(left_out.items()))
    compiled = tuple(sorted(set(names.values()) - {name for name, _ in failed}))
    classes = _compiled(out)
    tasks = tuple(name for name in background(folder) if name in classes)
    applications = tuple(
        Application(name, out, data, found, tasks, libraries) for name in find(folder) if name in classes
    )
    return Survey(folder, compiled, failed, applications, hint)


def _full_name(source: Path, text: str) -> str:
    package = _PACKAGE.search(_without_comments(text))
    return f"{package[1]}.{source.stem}" if package else source.stem


class _Copies:
    """Sources as UTF-8 in folders that fit their packages, as javac's source path needs them."""

    def __init__(self, place: Path, folder: Path, sources: list[Path], addresses: AddressMap) -> None:
        self.roots: list[Path] = []
        self.names: dict[str, Path] = {}
        self._origin: dict[str, str] = {}
        texts = {source: read_source(source) for source in sources}
        own = frozenset(_full_name(source, text) for source, text in texts.items())
        for source, original in texts.items():
            text = _in_literals(_modern(renamed(original, own, _without_comments), own), addresses)
            package = _PACKAGE.search(_without_comments(text))
            path = Path(*(package[1].split(".") if package else ()), source.name)
            # two files of one name keep apart, so that javac reports the duplicate
            root = next(
                one for i in range(len(sources)) if not (one := place / str(i)).joinpath(path).exists()
            )
            copy = root / path
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_text(text, encoding="utf-8", newline="")
            if root not in self.roots:
                self.roots.append(root)
            name = ".".join(path.with_suffix("").parts)
            self.names[name if name not in self.names else f"{name} {root.name}"] = copy
            self._origin[copy.as_posix()] = source.relative_to(folder).as_posix()

    @property
    def simple_names(self) -> frozenset[str]:
        """Names of the classes without their packages."""
        return frozenset(copy.stem for copy in self.names.values())

    def of(self, name: str) -> Path:
        """The file of a class; a second class of a file is found by its text."""
        if name in self.names:
            return self.names[name]
        package, _, simple = name.rpartition(".")
        declared = re.compile(rf"\bclass\s+{simple}\b")
        return next(
            copy
            for full, copy in self.names.items()
            if full.rpartition(".")[0] == package and declared.search(copy.read_text(encoding="utf-8"))
        )

    def original(self, text: str) -> str:
        """A text of the compiler with the names of the original files."""
        for copy in sorted(self._origin, key=len, reverse=True):
            text = text.replace(copy, self._origin[copy])
        return text


def _compiled(out: Path) -> set[str]:
    return {".".join(file.relative_to(out).with_suffix("").parts) for file in out.rglob("*.class")}


def _compile_all(
    copies: _Copies, out: Path, jars: tuple[Path, ...], *, chosen: str = ""
) -> tuple[dict[str, str], str]:
    """Compile all sources, as Workbench does: one that is wrong, and what needs it, is left out.

    Args:
        copies: the sources.
        out: folder for the classes.
        jars: libraries.
        chosen: full name of the class that must not be left out; "": every one may.

    Returns:
        The files that are left out with the first error of each, and what would help.

    Raises:
        CommandRejected: the chosen class itself is wrong, or it needs a file that is.
    """
    files = {copies.original(copy.as_posix()): copy for copy in copies.names.values()}
    needed = copies.original(copies.of(chosen).as_posix()) if chosen else ""
    refused: CommandRejected | None = None
    left_out: dict[str, str] = {}
    while files:
        try:
            _compile(copies, list(files.values()), out, jars, only=refused is not None)
        except CommandRejected as error:
            refused = refused or error
            wrong = {file: text for file, text in reversed(_places(str(error))) if file in files}
            if not wrong or needed in wrong:
                raise refused from None
            for file, text in sorted(wrong.items()):
                del files[file]
                left_out[file] = text
        else:
            break
    return left_out, "" if refused is None else refused.hint


def _compile(
    copies: _Copies, files: list[Path], out: Path, jars: tuple[Path, ...], *, only: bool = False
) -> None:
    """Compile some sources and, unless only these, what they need of the others.

    Raises:
        CommandRejected: errors of the compiler, with a hint that fits them.
    """
    listing = copies.roots[0].parent / "sources.txt"
    listing.write_text("".join(f'"{path.as_posix()}"\n' for path in files), encoding="utf-8")
    path = os.pathsep.join(str(jar) for jar in (*_resources.jars(), *jars))
    command = [
        _compiler(),
        *_QUICKLY,
        "--release",
        "17",
        "-proc:none",
        "-nowarn",
        "-g",
        "-encoding",
        "UTF-8",
        *_EVERY_ERROR,
    ]
    # a project's own source counts before a class of the same name in a jar
    roots = [] if only else copies.roots
    command += ["-cp", path, "-Xprefer:source", "-sourcepath", os.pathsep.join(map(str, roots))]
    # the hint reads javac's messages, so they have to be English
    command += ["-J-Duser.language=en", "-d", str(out), f"@{listing}"]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
    if done.returncode:
        text = copies.original(done.stderr.strip())
        raise CommandRejected(
            f"the application does not compile:\n{text}\n",
            parameter="app",
            hint="\n".join(_hints(text, copies.simple_names)),
        )


def _hints(text: str, own: frozenset[str]) -> list[str]:
    """Remedies for errors of the compiler: libraries and members of Sunrise that are missing, bad characters.

    Args:
        text: of the compiler.
        own: simple names of the project's classes.
    """
    members: dict[str, None] = {}
    packages: dict[str, None] = {}
    internal: dict[str, None] = {}
    other_systems: dict[str, None] = {}
    encoding = other = False
    for message, symbol, location in _errors(text):
        absent = re.match(r"package ([\w.]+) does not exist", message)
        name = absent[1] if absent else ""
        owner = (
            "" if symbol.startswith("class ") and location.startswith("class ") else _sunrise(location, own)
        )
        if system := next((what for pattern, what in _OTHER_SYSTEMS if re.match(pattern, name)), ""):
            other_systems[system] = None
        elif name.startswith("com.kuka."):
            members[f"package {name}"] = None
        elif re.fullmatch(_GONE, name):
            internal[name] = None
        elif "." in name:
            packages[name] = None
        elif "illegal character" in message or "unmappable character" in message:
            encoding = True
        elif message == "cannot find symbol" and re.fullmatch(rf"package ({_GONE})", location):
            internal[f"{location.removeprefix('package ')}.{symbol.removeprefix('class ')}"] = None
        elif message == "cannot find symbol" and owner:
            members[f"{symbol} of {owner}"] = None
        elif (used := re.match(r"(?:method|constructor) (\w+) in \w+ (\w+)", message)) and _sunrise(
            used[2], own
        ):
            members[f"{used[1]} of {_sunrise(used[2], own)} with these parameters"] = None
        elif message != "cannot find symbol":
            other = other or not message.startswith(_CONSEQUENCE)
    found = list(other_systems)
    if packages:
        found.append(
            f"name the jar of {', '.join(packages)} with --jar, or put it into a folder of the project"
        )
    if members:
        found.append(f"missing in the virtual cabinet's Sunrise, please report: {'; '.join(members)}")
    if internal:
        found.append(
            f"Java 17 no longer offers {', '.join(internal)}: use a public class instead, or name a jar with --jar"
        )
    if encoding:
        found.append("a character outside comments is neither UTF-8 nor windows-1252: save the file as UTF-8")
    if other or not found:
        found.append("correct the sources where javac reports an error")
    return found


def _errors(text: str) -> list[tuple[str, str, str]]:
    """Message, symbol and location of each error."""
    found: list[list[str]] = []
    for line in text.splitlines():
        if match := _ERROR.match(line):
            found.append([match[3], "", ""])
        elif found and (detail := _DETAIL.match(line)):
            found[-1][1 if detail[1] == "symbol" else 2] = re.sub(r"\s+", " ", detail[2])
    return [(message, symbol, location) for message, symbol, location in found]


def _places(text: str) -> list[tuple[str, str]]:
    """File and message of each error; a symbol that is not found is named, with where it was looked for."""
    files = [match[1] for line in text.splitlines() if (match := _ERROR.match(line))]
    return [
        (file, ": ".join(filter(None, (message, " in ".join(filter(None, (symbol, location)))))))
        for file, (message, symbol, location) in zip(files, _errors(text), strict=True)
    ]


def _sunrise(location: str, own: frozenset[str]) -> str:
    """The class or package of Sunrise in a location such as "variable robot of type LBR"; "": another's."""
    name = re.sub(r"<.*", "", location.rpartition(" ")[2])
    if name.startswith("com.kuka."):
        return name
    if name in own:
        return ""
    return _sunrise_classes().get(name, "")


@cache
def _sunrise_names() -> frozenset[str]:
    """Full names of the doubles' classes."""
    found = set()
    for jar in _resources.jars():
        with zipfile.ZipFile(jar) as file:
            for entry in file.namelist():
                if entry.startswith("com/kuka/") and entry.endswith(".class"):
                    found.add(entry.removesuffix(".class").replace("/", ".").replace("$", "."))
    return frozenset(found)


@cache
def _sunrise_classes() -> dict[str, str]:
    """Full names of the doubles' classes by simple name."""
    return {full.rpartition(".")[2]: full for full in sorted(_sunrise_names())}


def _chosen(found: list[str], main: str, folder: Path) -> str:
    fitting = [name for name in found if not main or name == main or name.rpartition(".")[2] == main]
    if len(fitting) == 1:
        return fitting[0]
    names = ", ".join(found) or "none"
    if main and not fitting:
        raise CommandRejected(
            f"{folder} has no application {main}", parameter="app-class", allowed=names, value=main
        )
    raise CommandRejected(
        f"{folder} has {len(fitting) or 'no'} applications: {names}",
        parameter="app-class",
        allowed=names,
        hint="choose one with --app-class" if fitting else "an application extends RoboticsAPIApplication",
    )


def _compiler() -> str:
    home = os.environ.get("JAVA_HOME")
    candidates = [str(Path(home) / "bin" / "javac")] if home else []
    for candidate in (*candidates, "javac"):
        if found := shutil.which(candidate):
            return found
    raise MissingExtra(
        "compiling an application needs a Java compiler, but no javac was found",
        hint="install a JDK 17 or newer, or set JAVA_HOME",
    )
