"""`heptarm sim --app`: applications of other people, and those written on heptarm's core without any network."""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from heptarm.errors import CommandRejected
from heptarm.virtual.application import background, compile_application, find

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "cabinet" / "samples"

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


def sim(folder: Path, *options: str, speed: str = "5") -> subprocess.CompletedProcess[str]:
    command = [
        sys.executable,
        "-m",
        "heptarm.cli.main",
        "sim",
        "--app",
        str(folder),
        "--speed",
        "5",
        *options,
    ]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


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


@needs_javac
def test_its_error_is_told_and_process_data_can_be_given(lab: Path) -> None:
    done = sim(lab, "--app-data", "lab.times=6", speed="0")
    assert done.returncode == 1
    assert "a stiff neck" in done.stderr


@needs_javac
def test_what_does_not_compile_is_told_with_the_compilers_words(lab: Path) -> None:
    (lab / "src" / "lab" / "Bad.java").write_text("class Bad { int x = nothing; }")
    with pytest.raises(CommandRejected, match=r"(?s)does not compile.*nothing"):
        compile_application(lab, lab)


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
    done = sim(ROOT / "examples" / "sunrise", "--app-data", "cell.parts=1", speed="3")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 parts are placed, the gripper closed 1 times" in done.stderr


def test_what_a_project_holds_besides_its_applications(tmp_path: Path) -> None:
    source = tmp_path / "src" / "tasks"
    source.mkdir(parents=True)
    (source / "Base.java").write_text("package tasks; abstract class Base extends RoboticsAPIBackgroundTask {}")
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


@needs_javac
@pytest.mark.parametrize(
    ("name", "said"),
    [
        (
            "Visit",
            (
                "square = FINISHED",
                "curve = FINISHED",
                "interrupted = CANCELLED",
                "touched = CONDITION by condition 3",
                "refused = items[0].motion.q[1]: A2 would be at",
            ),
        ),
        ("Stir", ("spoon, moving its bowl", "stirred = CANCELLED", "mm to the side", "lamp 1.0", "ready = true")),
    ],
)
def test_an_application_on_heptarms_core_needs_no_network(name: str, said: tuple[str, ...]) -> None:
    done = sim(SAMPLES, "--app-class", name, speed="2")
    assert done.returncode == 0, done.stdout + done.stderr
    for text in said:
        assert text in done.stderr
