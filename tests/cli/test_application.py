"""`heptarm sim app`: applications of other people."""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from heptarm.errors import CommandRejected
from heptarm.sim.runtime.application import background, compile_application, find
from tests.cli.running import refused, run
from tests.long import few
from tests.sim.station_setup import setup

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "cabinet" / "samples"

pytestmark = pytest.mark.computing  # compilers, and programs whose clock is the simulator's
needs_javac = pytest.mark.skipif(shutil.which("javac") is None, reason="no javac here")

FOREIGN = """
package lab;

import javax.inject.Inject;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

public class Nod extends RoboticsAPIApplication {
    @Inject
    private LBR robot;

    @Override
    public void run() {
        int times = getApplicationData().getProcessData("lab.times").getValue();
        for (int i = 0; i < times; i++) {
            robot.move(ptp(0, 0.2, 0, -0.2, 0, 0, 0).setJointVelocityRel(0.5));
            robot.move(ptp(0, 0, 0, 0, 0, 0, 0).setJointVelocityRel(0.5));
        }
        getLogger().info("nodded " + times + " times");
        // class Ghost extends RoboticsAPIApplication is only a comment
        if (times > 5) {
            throw new IllegalStateException("a stiff neck");
        }
    }
}
"""
PROJECT = """
<persistence><processDataContainer>
<processData dataType="java.lang.Integer" id="lab.times" defaultValue="1" value="2"/>
</processDataContainer></persistence>
"""


def sim(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    return run("sim", "--app", str(folder), "--speed", "5", *options)


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    (tmp_path / "src" / "lab").mkdir(parents=True)
    (tmp_path / "src" / "lab" / "Nod.java").write_text(FOREIGN)
    (tmp_path / "RoboticsAPI.data.xml").write_text(PROJECT)
    return tmp_path


@needs_javac
def test_a_foreign_application_runs_with_its_own_process_data(lab: Path) -> None:
    done = sim(lab)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "lab.Nod runs" in done.stdout
    assert "nodded 2 times" in done.stderr


@pytest.mark.long
@needs_javac
def test_the_robot_of_its_station_setup_is_simulated_or_contradicted_aloud(lab: Path) -> None:
    (lab / "StationSetup.cat").write_text(setup())
    done = sim(lab / "src", "--project", str(lab / "RoboticsAPI.data.xml"))
    assert done.returncode == 0, done.stdout + done.stderr
    assert "lab.Nod runs on a virtual iiwa7+touch" in done.stdout
    other = sim(lab, "--model", "iiwa14")
    assert "lab.Nod runs on a virtual iiwa14+touch" in other.stdout
    assert "the project is for an iiwa7" in other.stderr and "simulated is an iiwa14+touch" in other.stderr


@needs_javac
def test_its_error_is_reported_and_process_data_can_be_given(lab: Path) -> None:
    done = sim(lab, "--app-data", "lab.times=6")
    assert done.returncode == 1
    assert "a stiff neck" in done.stderr


@needs_javac
def test_what_does_not_compile_is_reported_with_the_compilers_words(lab: Path) -> None:
    (lab / "src" / "lab" / "Bad.java").write_text("package lab; class Bad { int x = nothing; }")
    (lab / "src" / "lab" / "Nod.java").write_text(
        FOREIGN.replace("private LBR", "private Bad bad; private LBR")
    )
    with pytest.raises(CommandRejected, match=r"(?s)does not compile.*nothing"):
        compile_application(lab, lab)


@needs_javac
def test_what_the_application_does_not_need_may_be_wrong(lab: Path) -> None:
    folder = lab / "src" / "lab"
    (folder / "Old.java").write_text("package lab; class Old extends RoboticsAPIApplicatoin { int x = ; }")
    (folder / "UsesOld.java").write_text("package lab; class UsesOld { Old old = new Old(); }")
    out = lab.parent / "what is right"
    out.mkdir()
    found = compile_application(lab, out)
    assert (out / "lab" / "Nod.class").exists()
    assert [line.partition(" ")[0] for line in found.left_out] == ["src/lab/Old.java", "src/lab/UsesOld.java"]
    assert "illegal start of expression" in found.left_out[0]


@needs_javac
def test_static_imports_of_all_members_count_as_used(lab: Path, tmp_path: Path) -> None:
    source = FOREIGN.replace("BasicMotions.ptp;", "BasicMotions.*;")
    (lab / "src" / "lab" / "Nod.java").write_text(source)
    compile_application(lab, tmp_path / "out")


def test_applications_are_found_and_one_has_to_be_chosen(lab: Path) -> None:
    assert find(lab) == ["lab.Nod"]
    assert find(SAMPLES) == ["heptarm.samples.Stir", "heptarm.samples.Visit"]
    with pytest.raises(CommandRejected, match="2 applications.*Stir, heptarm.samples.Visit"):
        compile_application(SAMPLES, lab)
    with pytest.raises(CommandRejected, match="no application Nothing"):
        compile_application(SAMPLES, lab, main="Nothing")
    with pytest.raises(CommandRejected, match="no Java sources"):
        compile_application(ROOT / "docs", lab)


@needs_javac
def test_a_whole_project_runs_with_its_tools_frames_signals_and_background_task() -> None:
    done = sim(ROOT / "examples" / "sunrise" / "cell", "--app-data", "cell.parts=1")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 parts are placed, the gripper closed 1 times" in done.stderr


def test_what_a_project_holds_besides_its_applications(tmp_path: Path) -> None:
    source = tmp_path / "src" / "tasks"
    source.mkdir(parents=True)
    (source / "Base.java").write_text(
        "package tasks; abstract class Base extends RoboticsAPIBackgroundTask {}"
    )
    (source / "One.java").write_text("package tasks; public class One extends Base {}")
    (source / "App.java").write_text("package tasks; class App extends Own {}")
    (source / "Own.java").write_text("package tasks; class Own extends RoboticsAPIApplication {}")
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "Old.java").write_text("class Old extends RoboticsAPIApplication {}")
    assert background(tmp_path) == ["tasks.One"]
    assert find(tmp_path) == ["tasks.App", "tasks.Own"]


@needs_javac
def test_jars_of_a_project_count_unless_they_are_kukas(lab: Path) -> None:
    for name, entry in (("own.jar", "lab/Thing.class"), ("api.jar", "com/kuka/roboticsAPI/Thing.class")):
        with zipfile.ZipFile(lab / name, "w") as jar:
            jar.writestr(entry, b"")
    (lab / "bin").mkdir()
    (lab / "bin" / "RoboticsAPI.data.xml").write_text("<old/>")
    out = lab.parent / "out"
    out.mkdir()
    found = compile_application(lab, out)
    assert found.jars == (lab / "own.jar",)
    assert found.project == lab / "RoboticsAPI.data.xml"


WILD = """\ufeffpackage lab;

import java.io.ByteArrayOutputStream;
import java.nio.charset.Charset;
import javax.annotation.PostConstruct;
import javax.annotation.PreDestroy;
import javax.xml.bind.DatatypeConverter;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.sun.org.apache.bcel.internal.generic.NEW;
import sun.awt.geom.*;
import com.kuka.roboticsAPI.geometricModel.physics.*;
import com.kuka.roboticsAPI.conditionModel.IConditionListener;

// Überwachung in °C
public class Wild extends RoboticsAPIApplication {
    private String ready = "";

    @PostConstruct
    private void construct() {
        ready = "constructed";
    }

    @PreDestroy
    private void destroy() {
    }

    @Override
    public void run() {
        String greeting = "grüß";
        getLogger().info(ready + " " + greeting + " " + greeting.length() + " " + Charset.defaultCharset());
        getLogger().info(DatatypeConverter.printHexBinary(greeting.getBytes())
                + " " + new String(DatatypeConverter.parseBase64Binary("aWl3YQ=="))
                + " " + DatatypeConverter.printHexBinary(System.getProperty("line.separator").getBytes())
                + " " + String.format("%.2f", 0.5));
        System.out.println("printed ü");
    }
}
"""


@needs_javac
@pytest.mark.parametrize("encoding", few(["windows-1252", "utf-8"]))
def test_sources_run_in_the_encodings_that_they_are_written_in(tmp_path: Path, encoding: str) -> None:
    text = WILD if encoding == "utf-8" else WILD.removeprefix("\ufeff")
    # 0x81 means nothing in windows-1252
    bad = b"" if encoding == "utf-8" else b" \x81"
    (tmp_path / "Wild.java").write_bytes(text.encode(encoding).replace(b"berwachung", b"berwachung" + bad))
    done = sim(tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "constructed grüß 4 windows-1252" in done.stderr
    assert "6772FCDF iiwa 0D0A 0.50" in done.stderr
    assert "printed ü" in done.stderr


def wrong(folder: Path, body: str, imports: str = "") -> str:
    """Messages about an application that does not compile."""
    (folder / "Wrong.java").write_text(
        f"{imports} import com.kuka.roboticsAPI.deviceModel.LBR;"
        "import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;\n"
        f"class Wrong extends RoboticsAPIApplication {{ LBR robot; public void run() {{ {body} }} }}",
        encoding="utf-8",
    )
    out = folder.parent / f"{folder.name}-out"
    out.mkdir(exist_ok=True)
    with pytest.raises(CommandRejected) as refused:
        compile_application(folder, out)
    assert "Wrong.java:2: error" in str(refused.value) or imports
    return refused.value.hint


@pytest.mark.long
@needs_javac
def test_the_hint_of_a_compile_error_fits_the_error(tmp_path: Path) -> None:
    missing = wrong(tmp_path, "".join(f"robot.dance{i}();\n" for i in range(150)))
    for i in (0, 99, 149):
        assert f"method dance{i}() of com.kuka.roboticsAPI.deviceModel.LBR" in missing
    assert "report" in missing
    assert "jar of org.apache.commons.math3" in wrong(tmp_path, "", "import org.apache.commons.math3.Thing;")
    both = wrong(
        tmp_path, "robot.dance(); Thing t;", "import org.acme.Thing; import com.kuka.nowhere.Thing2;"
    )
    assert "jar of org.acme" in both
    assert "package com.kuka.nowhere" in both
    assert "method dance() of com.kuka" in both
    assert "correct the sources" not in both
    assert "UTF-8" in wrong(tmp_path, "int \u2603 = 1;")
    assert "public class" in wrong(tmp_path, "BASE64Encoder coder;", "import sun.nowhere.BASE64Encoder;")
    own = wrong(tmp_path, "int x = nothing;")
    assert "please report" not in own
    assert "correct the sources" in own
    gone = wrong(tmp_path, "JAXBContext context;", "import javax.xml.bind.JAXBContext;")
    assert "no longer offers javax.xml.bind.JAXBContext" in gone


@pytest.mark.long
@needs_javac
def test_one_bad_file_does_not_block_an_application_that_is_chosen(lab: Path) -> None:
    tasks = lab / "src" / "tasks"
    tasks.mkdir()
    (tasks / "Bad.java").write_text("package tasks; class Bad { int x = nothing; }")
    base = "com.kuka.roboticsAPI.applicationModel.tasks.RoboticsAPIBackgroundTask"
    for name, body in (("Watch", ""), ("Blind", "Bad bad;")):
        (tasks / f"{name}.java").write_text(
            f"package tasks; import {base}; public class {name} extends RoboticsAPIBackgroundTask "
            f"{{ {body} public void run() {{}} }}"
        )
    out = lab.parent / "chosen"
    out.mkdir()
    found = compile_application(lab, out, main="Nod")
    assert found.background == ("tasks.Watch",)
    assert (out / "lab" / "Nod.class").exists()
    assert "tasks.Blind is left out" in found.left_out[0]


ASKING = """
package lab;

import javax.inject.Inject;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.uiModel.ApplicationDialogType;

public class Asking extends RoboticsAPIApplication {
    @Override
    public void run() {
        StringBuilder answers = new StringBuilder();
        for (int i = 0; i < 3; i++) {
            answers.append(getApplicationUI().displayModalDialog(ApplicationDialogType.QUESTION, "Part " + i + "?",
                    "Yes", "No", "Stop"));
        }
        getLogger().info("answers " + answers);
    }
}
"""


@pytest.fixture
def asking(tmp_path: Path) -> Path:
    (tmp_path / "Asking.java").write_text(ASKING)
    return tmp_path


@needs_javac
def test_dialogs_are_answered_from_a_file_and_by_options(asking: Path) -> None:
    file = asking / "answers.txt"
    file.write_text("2  # stop\n\n# the rest follows\n")
    done = sim(asking, "--answers", str(file), "--answer", "1", "--answer", "0")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "answers 210" in done.stderr
    file.write_text("yes")
    assert "line 1: an answer must be the number of a button" in sim(asking, "--answers", str(file)).stderr
    done = sim(asking, "--answer", "3")
    assert done.returncode == 1
    assert 'the scripted answer to the dialog "Part 0?" must be 0 to 2, got 3' in done.stderr


@needs_javac
def test_a_typed_line_answers_a_dialog_that_reports_what_to_type(asking: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "heptarm.cli.main",
        "sim",
        "--app",
        str(asking),
        "--answer",
        "0",
        "--answer",
        "1",
    ]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT, text=True) as running:
        assert running.stdin is not None
        assert running.stdout is not None
        said = ""
        for line in running.stdout:
            said += line
            if "waits for the operator" in line:
                running.stdin.write("answer 7\nanswer 2\n")
                running.stdin.flush()
    assert running.returncode == 0, said
    assert "type `answer 0` for Yes, `answer 1` for No, `answer 2` for Stop" in said
    assert "no open dialog has a button 7" in said
    assert "done: answer 2" in said
    assert "answers 012" in said


@pytest.mark.parametrize(
    "options",
    [
        ("--panel",),
        ("--count", "2"),
        ("--fri", "1.15"),
        ("--fri-io", "G.S<bool"),
    ],
)
def test_an_option_that_means_nothing_to_an_application_is_refused(
    lab: Path, options: tuple[str, ...]
) -> None:
    done = refused("sim", "--app", str(lab), *options)
    assert done.returncode != 0
    assert f"{options[0]} cannot be used with heptarm sim app" in done.stderr


@pytest.mark.parametrize(
    ("options", "needed"),
    [
        (("--view-port", "8081"), "--view"),
        (("--meshes", "."), "--view"),
        (("--host", "0.0.0.0"), "--port or --view"),
        (("--key-file", "cell.key"), "--port or --view"),
    ],
)
def test_an_option_of_those_who_look_on_needs_them(lab: Path, options: tuple[str, ...], needed: str) -> None:
    done = refused("sim", "--app", str(lab), *options)
    assert done.returncode != 0
    assert f"{options[0]} needs {needed}" in done.stderr


@pytest.mark.parametrize(
    "options", [("--app-class", "Nod"), ("--app-data", "a=1"), ("--answer", "0"), ("--map", "a=b")]
)
def test_an_option_of_an_application_needs_one(options: tuple[str, ...]) -> None:
    done = refused("sim", *options)
    assert done.returncode != 0
    assert f"{options[0]} needs heptarm sim app FOLDER" in done.stderr


@pytest.mark.long
@needs_javac
def test_a_project_file_a_fault_and_a_payload_reach_an_application(lab: Path) -> None:
    other = lab.parent / "other.xml"
    other.write_text(PROJECT.replace('value="2"', 'value="3"'))
    done = sim(lab, "--project", str(other), "--payload", "1.5", "--verbose")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "nodded 3 times" in done.stderr
    done = sim(lab, "--fault", "set Nothing.here 1@0.3")
    assert "set Nothing.here 1: " in done.stderr
    done = sim(lab, "--fault", "nonsense@1")
    assert done.returncode != 0
    assert "'nonsense' is not understood" in done.stderr
    assert "ended with an error" not in done.stderr
    done = sim(lab, "--payload", "heavy")
    assert done.returncode != 0
    assert "does not start" in done.stderr
