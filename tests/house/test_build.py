"""The build of the cabinet: what it refuses, and whether its output runs on a JRE 6."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "cabinet"))

import classfile  # noqa: E402
import toolchain  # noqa: E402
from heptarm.cli.install_cabinet import install_cabinet  # noqa: E402
from tests.long import few  # noqa: E402

REFUSALS = classfile.Refusals.load(ROOT / "cabinet" / "java7.txt", ("com/kuka/",))
JARS = ROOT / "src" / "heptarm" / "sim" / "jars"


@pytest.fixture(scope="module")
def jdk() -> toolchain.Jdk:
    return toolchain.find_jdk()


#: Bodies of classes that need Java 7, and what of it they use.
NEWER = (
    ("int f(long a) { return Long.compare(a, 1L); }", "java.lang.Long.compare(JJ)I"),
    ("int f(int a) { return Integer.compare(a, 1); }", "java.lang.Integer.compare(II)I"),
    ("Object f(Object a) { return java.util.Objects.toString(a); }", "java.util.Objects"),
    (
        "Object f() { return java.nio.charset.StandardCharsets.UTF_8; }",
        "java.nio.charset.StandardCharsets",
    ),
    ("Object f(java.io.File a) { return a.toPath(); }", "java.nio.file.Path"),
    ("void f(java.io.IOException a) { a.addSuppressed(a); }", "java.io.IOException.addSuppressed"),
    ("void f(Object a) throws Exception { ((AutoCloseable) a).close(); }", "java.lang.AutoCloseable"),
    ("java.nio.file.Path[] field;", "java.nio.file.Path"),
    ("Object f() { return java.net.InetAddress.getLoopbackAddress(); }", "getLoopbackAddress"),
    ("Object f() { return new AssertionError(null, null); }", "java.lang.AssertionError.<init>"),
    ("java.io.Closeable f() { return new java.net.Socket(); }", "java.io.Closeable"),
)


def _compiled(command: list[str], folder: Path, *bodies: str) -> list[list[str]]:
    """Compiles a class for each body with the JDK's own library and lists the findings of the check."""
    sources = [folder / f"Probe{number}.java" for number in range(len(bodies))]
    for source, body in zip(sources, bodies, strict=True):
        source.write_text(f"class {source.stem} {{ {body} }}")
    words = [*command, "-proc:none", "-d", str(folder), *map(str, sources)]
    subprocess.run(words, check=True, capture_output=True)
    classes = (source.with_suffix(".class") for source in sources)
    return [list(REFUSALS.of(classfile.read(one.read_bytes()))) for one in classes]


def _ecj(jdk: toolchain.Jdk) -> list[str]:
    return [*toolchain.find_ecj(jdk), "-source", "1.6", "-target", "1.6", "-nowarn"]


@pytest.fixture(scope="module")
def verdicts(jdk: toolchain.Jdk, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[str]]:
    """The findings for each body of `NEWER`, compiled at once."""
    bodies = [body for body, _ in NEWER]
    return dict(zip(bodies, _compiled(_ecj(jdk), tmp_path_factory.mktemp("newer"), *bodies), strict=True))


@pytest.mark.parametrize(("body", "named"), NEWER)
def test_newer_library_members_are_refused_by_name(
    verdicts: dict[str, list[str]], body: str, named: str
) -> None:
    assert any(named in line for line in verdicts[body]), verdicts[body]


def test_older_members_of_the_same_name_pass(jdk: toolchain.Jdk, tmp_path: Path) -> None:
    body = """
        int f(Long a, Long b) { return a.compareTo(b) + "x".compareTo("y"); }
        Object g() { return new AssertionError("text"); }
        Object h(java.util.regex.Matcher m) { return m.group(1) + m.group(); }
        Object i() { return java.nio.charset.Charset.forName("UTF-8"); }"""
    assert _compiled(_ecj(jdk), tmp_path, body) == [[]]


def test_newer_class_version_is_refused(jdk: toolchain.Jdk, tmp_path: Path) -> None:
    (verdict,) = _compiled([str(jdk.javac)], tmp_path, "int x;")
    assert any("class version" in line for line in verdict)


def test_compiling_against_java_7_keeps_newer_descriptors_out(jdk: toolchain.Jdk, tmp_path: Path) -> None:
    source = tmp_path / "Probe.java"
    source.write_text("class Probe { Object f(java.nio.ByteBuffer b) { return b.flip(); } }")
    library = toolchain.java7_library(jdk, tmp_path)
    command = [*toolchain.find_ecj(jdk), "-bootclasspath", str(library), "-source", "1.6", "-target", "1.6"]
    subprocess.run(
        [*command, "-proc:none", "-d", str(tmp_path), str(source)], check=True, capture_output=True
    )
    members = classfile.read((tmp_path / "Probe.class").read_bytes()).members
    assert ("java/nio/ByteBuffer", "flip", "()Ljava/nio/Buffer;") in members


@pytest.mark.parametrize("jar", ["heptarm-core.jar", "heptarm-app.jar", "heptarm-samples.jar"])
def test_every_class_for_the_robot_is_java_6(jar: str) -> None:
    with zipfile.ZipFile(JARS / jar) as file:
        classes = [classfile.read(file.read(name)) for name in file.namelist() if name.endswith(".class")]
    assert classes
    assert {one.version for one in classes} == {classfile.JAVA_6}
    assert not any(name.startswith("heptarm/doubles/") for one in classes for name in one.classes)
    if jar == "heptarm-core.jar":
        assert not any(name.startswith("com/kuka/") for one in classes for name in one.classes)


def test_doubles_say_that_they_must_not_be_deployed() -> None:
    with zipfile.ZipFile(JARS / "heptarm-doubles-not-for-robots.jar") as file:
        assert "Never deploy" in file.read("META-INF/MANIFEST.MF").decode().replace("\r\n ", "")
        assert b"Never deploy" in file.read("NEVER-DEPLOY-TO-A-ROBOT.txt")
        assert "META-INF/services/heptarm.core.Clock" in file.namelist()


#: Where the packages of an option have their classes.
OPTIONS = {
    "servoing": ("com/kuka/connectivity/motionModel/",),
    "fri": ("com/kuka/connectivity/fastRobotInterface/",),
    "hand-guiding": ("com/kuka/roboticsAPI/motionModel/HandGuidingMotion",),
}


@pytest.mark.parametrize("without", few([[*OPTIONS], []]), ids=few(["no option", "everything"]))
def test_sources_compile_in_a_workbench_without_options(
    jdk: toolchain.Jdk, tmp_path: Path, without: list[str]
) -> None:
    """What `heptarm install-cabinet` writes compiles where the classes of options that are left out do not exist."""
    out, library = tmp_path / "cabinet", tmp_path / "library.jar"
    install_cabinet(out=out, no_key=True, without=",".join(without))
    gone = tuple(prefix for option in OPTIONS for prefix in OPTIONS[option])
    with (
        zipfile.ZipFile(JARS / "heptarm-doubles-not-for-robots.jar") as every,
        zipfile.ZipFile(library, "w") as some,
    ):
        for name in every.namelist():
            if not name.startswith(gone):
                some.writestr(name, every.read(name))
    sources = sorted(str(path) for path in (out / "src").rglob("*.java"))
    java7 = toolchain.java7_library(jdk, tmp_path)
    command = [*toolchain.find_ecj(jdk), "-bootclasspath", str(java7), "-source", "1.6", "-target", "1.6"]
    command += [
        "-nowarn",
        "-proc:none",
        "-classpath",
        str(library),
        "-d",
        str(tmp_path / "classes"),
        *sources,
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if without:
        assert done.returncode == 0, done.stdout + done.stderr
    else:
        assert done.returncode != 0 and "smartServo" in done.stdout + done.stderr
