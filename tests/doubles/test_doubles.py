"""A typical Sunrise application runs on the doubles, on a real JVM, with the plant."""

from __future__ import annotations

import atexit
import functools
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from heptarm import _resources
from heptarm.values.robot import robot

HERE = Path(__file__).parent
#: Cabinet seconds per second: applications mostly wait for motions.
SPEED = 4.0
#: The compiler, started for a short run.
JAVAC = (
    *("javac", "-J-XX:TieredStopAtLevel=1", "-J-XX:+UseSerialGC"),
    *("-proc:none", "--release", "17"),
)

SAID = (
    "initialize = LBR_iiwa_14_R820_1",
    "ptp = true",
    "linRel down 100 mm = true",
    "lin back = true",
    "linRel moves along the flange's own axes = true",
    "moveAsync returns before the motion has ended = true",
    "queued motions run in order = true",
    "await with a time-out = true",
    "cancel brakes on the path = true",
    "positionHold = true",
    "a joint limit throws = true",
    "a bad parameter throws = true",
    "unknown process data throws = true",
    "an asynchronous error reaches the handler = true",
    "the application goes on = true",
    "and moves = true",
    "dispose = true",
)


QUEUEING = (
    "process data have their types = true",
    "nothing is active after a move = true",
    "listener = [Executing, motionStarted, motionFinished, Finished, containerFinished]",
    "two are active = true",
    "a cancelled one in the queue is no error = true",
    "a pause stops time = true",
    "and resuming ends the motion = true",
    "a frame in a frame = true",
    "an exception stops the motion = true",
    "no asynchronous error = true",
)

PROJECT = """
<persistence><processDataContainer>
<processData dataType="java.lang.Integer" id="sample.count" defaultValue="1" value="3"/>
<processData dataType="java.lang.Double" id="sample.gain" defaultValue="0.25"/>
<processData dataType="java.lang.Boolean" id="sample.open" value="true"/>
</processDataContainer></persistence>
"""


def _javac(out: Path, *sources: Path) -> None:
    classpath = ":".join(str(jar) for jar in _resources.jars())
    subprocess.run([*JAVAC, "-cp", classpath, "-d", str(out), *map(str, sources)], check=True)


@functools.cache
def _samples() -> Path:
    """Classes of all samples: to compile all of them takes as long as to compile two."""
    out = tempfile.mkdtemp(prefix="heptarm-samples-")
    atexit.register(shutil.rmtree, out, ignore_errors=True)
    _javac(Path(out), *(HERE / "java").glob("*.java"))
    return Path(out)


def _compile(source: Path, out: Path) -> None:
    """Put the classes of a source into a folder; of a sample, with those of all samples."""
    if shutil.which("javac") is None:
        pytest.skip("no javac here")
    if source.parent == HERE / "java":
        shutil.copytree(_samples(), out, dirs_exist_ok=True)
    else:
        _javac(out, source)


def _command(application: str, classes: Path, *data: str, speed: float = SPEED) -> list[str]:
    command = [sys.executable, "-m", "heptarm.sim.runtime.cabinet", "--application", application]
    command += ["--classpath", str(classes), "--speed", str(speed)]
    for one in data:
        command += ["--data", one]
    return command


def _run(
    application: str,
    classes: Path,
    *data: str,
    project: Path | None = None,
    speed: float = SPEED,
    more: tuple[str, ...] = (),
) -> subprocess.CompletedProcess[str]:
    command = [*_command(application, classes, *data, speed=speed), *more]
    if project is not None:
        command += ["--project", str(project)]
    return subprocess.run(command, capture_output=True, text=True, timeout=200, check=False)


def test_a_sunrise_application_behaves_as_on_a_cabinet(tmp_path: Path) -> None:
    _compile(HERE / "java" / "Sample.java", tmp_path)
    said = tmp_path / "said.txt"
    done = _run("sample.Sample", tmp_path, f"sample.file={said}")
    assert done.returncode == 0, done.stdout + done.stderr
    assert tuple(said.read_text().splitlines()) == SAID


def test_who_wakes_late_is_not_shown_the_present_for_the_past(tmp_path: Path) -> None:
    _compile(HERE / "java" / "Oversleeping.java", tmp_path)
    said = tmp_path / "said.txt"
    done = _run("sample.Oversleeping", tmp_path, f"sample.file={said}", speed=1.0)  # it sleeps in real time
    assert done.returncode == 0, done.stdout + done.stderr
    top = 0.1 * robot("iiwa14").dq_max[0]
    fastest, held, released = map(float, said.read_text().split())
    assert 0.5 * top < fastest < 1.5 * top
    assert held == 0.0 < released  # longer than states are kept in the shared memory


@pytest.mark.alone  # beside others a machine may compute no tick in time
def test_a_state_that_is_computed_ahead_is_read_when_it_is_due(tmp_path: Path) -> None:
    _compile(HERE / "java" / "Foreseeing.java", tmp_path)
    said = tmp_path / "said.txt"
    done = _run("sample.Foreseeing", tmp_path, f"sample.file={said}", speed=1.0)
    assert done.returncode == 0, done.stdout + done.stderr
    ahead, early, woken_early = map(int, said.read_text().split())
    assert ahead > 0 and early == woken_early == 0


def test_queue_listeners_pause_and_an_error_of_the_application(tmp_path: Path) -> None:
    _compile(HERE / "java" / "Queueing.java", tmp_path)
    said, project = tmp_path / "said.txt", tmp_path / "data.xml"
    project.write_text(PROJECT)
    done = _run("sample.Queueing", tmp_path, f"sample.file={said}", "sample.count=7", project=project)
    assert tuple(said.read_text().splitlines()) == QUEUEING, done.stderr
    assert done.returncode == 1
    assert "an error of the application" in done.stdout


SERVING = (
    "home is the stretched arm",
    "or what was set",
    "no runtime before the motion is commanded",
    "SmartServo arrives",
    "the goal is reported",
    "the destination can be read back",
    "a velocity moves it a little further, then the arm rests",
    "a Cartesian destination",
    "out of reach",
    "behind a limit",
    "stopMotion",
    "after its end it takes no destinations",
    "DirectServo reports its joints",
    "DirectServo arrives",
    "limits that are none are refused",
    "SmartServoLIN arrives",
    "on a straight line",
    "its goal is reported, too",
    "and can be read back",
    "out of its reach",
    "it stops",
    "a servo motion without destinations times out",
    "impedance control may begin",
    "it follows with compliance",
    "the kind of the mode cannot change",
)


@pytest.mark.long  # the same doubles as in tests/arm, through a program of its own
def test_servo_motions_of_a_sunrise_application(tmp_path: Path) -> None:
    _compile(HERE / "java" / "Serving.java", tmp_path)
    said = tmp_path / "said.txt"
    done = _run("sample.Serving", tmp_path, f"sample.file={said}")
    assert done.returncode == 0, done.stdout + done.stderr
    assert said.read_text().splitlines() == [f"{one} = true" for one in SERVING]


COMPLIANT = (
    "it has Sunrise's defaults",
    "directions are set by name and by group",
    "a copy is one of its own",
    "a pattern is a Cartesian impedance too",
    "values out of range are refused",
    "and change nothing",
    "a force moves the flange by force over stiffness, along its own axes",
    "a torque in A turns it about z",
    "with a reference system along that one's axes",
    "a LIN under Cartesian impedance arrives",
    "a desired force",
    "a sine swings by its amplitude",
    "about its bias, up to the force limit",
    "a spiral holds its motion open",
    "it goes round",
    "and returns",
    "a Lissajous figure in its plane",
    "a path deviation ends the motion",
    "a velocity ends the motion",
    "a control force ends the motion",
    "without the stop condition it is only limited",
    "a pattern without an end cannot be waited for",
    "a servo motion takes other settings",
    "again and again",
    "but no other kind",
)


@pytest.mark.long  # the same doubles as in tests/arm, through a program of its own
def test_cartesian_impedance_of_a_sunrise_application(tmp_path: Path) -> None:
    _compile(HERE / "java" / "Compliant.java", tmp_path)
    said = tmp_path / "said.txt"
    done = _run("sample.Compliant", tmp_path, f"sample.file={said}")
    assert done.returncode == 0, done.stdout + done.stderr
    assert said.read_text().splitlines() == [f"{one} = true" for one in COMPLIANT]


def test_deselecting_an_application_is_no_failure(tmp_path: Path) -> None:
    source = tmp_path / "Endless.java"
    source.write_text(
        """
        package sample;
        import static com.kuka.roboticsAPI.motionModel.BasicMotions.positionHold;
        import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
        import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplicationState;
        import com.kuka.roboticsAPI.deviceModel.LBR;
        import javax.inject.Inject;
        public class Endless extends RoboticsAPIApplication {
            @Inject private LBR lbr;
            public void run() throws Exception {
                System.out.println("running");
                lbr.move(positionHold(null, -1, null));
            }
            @Override
            public void onApplicationStateChanged(RoboticsAPIApplicationState state) {
                System.out.println(state);
            }
            @Override
            public void dispose() {
                System.out.println("disposed");
                super.dispose();
            }
        }
        """
    )
    _compile(source, tmp_path)
    command = _command("sample.Endless", tmp_path)
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None  # the application's own output, beside the log
        while (line := process.stderr.readline()) != "running\n":
            assert line, "the application ended before it ran"
        process.terminate()
        rest = process.stderr.read().splitlines()
        assert [line for line in rest if line in ("STOPPING", "disposed")] == ["STOPPING", "disposed"]
        assert process.wait(timeout=10) == 0


def test_bad_process_data_end_the_start_with_a_reason(tmp_path: Path) -> None:
    done = _run("sample.Missing", tmp_path, "heptarm.port=abc")
    assert done.returncode == 2
    assert "abc" in done.stdout


def test_without_a_handler_an_asynchronous_error_ends_the_application(tmp_path: Path) -> None:
    source = tmp_path / "Careless.java"
    source.write_text(
        """
        package sample;
        import static com.kuka.roboticsAPI.motionModel.BasicMotions.linRel;
        import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
        import com.kuka.roboticsAPI.deviceModel.LBR;
        import javax.inject.Inject;
        public class Careless extends RoboticsAPIApplication {
            @Inject private LBR lbr;
            public void run() throws Exception {
                lbr.moveAsync(linRel(5000, 0, 0));
                Thread.sleep(20000);
            }
        }
        """
    )
    _compile(source, tmp_path)
    done = _run("sample.Careless", tmp_path)
    assert done.returncode == 1
    assert "no error handler is registered" in done.stdout and "InterruptedException" not in done.stdout


def test_an_application_that_does_not_exist_is_named(tmp_path: Path) -> None:
    done = _run("sample.Missing", tmp_path)
    assert done.returncode != 0
    assert "sample.Missing" in done.stdout + done.stderr


def test_the_jar_of_doubles_reports_what_it_is() -> None:
    import zipfile

    (jar,) = (jar for jar in _resources.jars() if "doubles" in jar.name)
    assert "not-for-robots" in jar.name
    manifest = zipfile.ZipFile(jar).read("META-INF/MANIFEST.MF").decode().replace("\r\n ", "")
    assert "Never deploy" in manifest
