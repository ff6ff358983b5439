"""Scenarios: programs in the cabinet itself, in Java; they need a Java compiler and simulators of their own."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from heptarm import _resources
from heptarm.arm.arm import Arm
from heptarm.errors import HeptarmError
from heptarm.testing.measure import Unfit, holds, note
from heptarm.testing.scenario import Risk, scenario

_PATIENCE = 120.0
#: An application as a Sunrise programmer writes it, knowing nothing of heptarm.
_FOREIGN = """
package lab;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.lin;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import javax.inject.Inject;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.Frame;

public class Nod extends RoboticsAPIApplication {
    @Inject
    private LBR robot;

    @Override
    public void run() {
        robot.move(ptp(0, 0.5, 0, -1.5, 0, 1.0, 0).setJointVelocityRel(0.8));
        Frame start = robot.getCurrentCartesianPosition(robot.getFlange());
        robot.move(lin(start.copy().setZ(start.getZ() + 40)).setCartVelocity(200));
        Frame end = robot.getCurrentCartesianPosition(robot.getFlange());
        getLogger().info("lifted by " + Math.round(end.getZ() - start.getZ()) + " mm");
        int times = getApplicationData().getProcessData("lab.times").getValue();
        getLogger().info("told " + times + " times");
    }
}
"""
_PROJECT = """
<persistence><processDataContainer>
<processData dataType="java.lang.Integer" id="lab.times" defaultValue="1" value="2"/>
</processDataContainer></persistence>
"""


def _sim(folder: Path, *options: str) -> str:
    """Compile and run an application in a simulator of its own; what it logged.

    Raises:
        Unfit: there is no Java compiler here.
    """
    if shutil.which("javac") is None:
        raise Unfit("there is no javac here")
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
    done = subprocess.run(command, capture_output=True, text=True, timeout=_PATIENCE, check=False)
    if done.returncode:
        last = (done.stderr or done.stdout).strip().splitlines()[-3:]
        raise HeptarmError(f"the application ended with {done.returncode}: {' | '.join(last)}")
    return done.stderr


@scenario(line=13, risk=Risk.STILL, virtual=True)
def foreign(arm: Arm) -> None:
    """Somebody else's Sunrise application is compiled and run as it is, with its own process data."""
    with TemporaryDirectory(prefix="heptarm-") as name:
        folder = Path(name)
        (folder / "src" / "lab").mkdir(parents=True)
        (folder / "src" / "lab" / "Nod.java").write_text(_FOREIGN, encoding="utf-8")
        (folder / "RoboticsAPI.data.xml").write_text(_PROJECT, encoding="utf-8")
        said = _sim(folder)
    holds("lifted by 40 mm" in said, "it measured its line: 40 mm")
    holds("told 2 times" in said, "it read its process data")


@scenario(line=12, risk=Risk.STILL, virtual=True)
def own(arm: Arm) -> None:
    """An application on heptarm's core, without any network: motions, a condition, a refusal."""
    folder = _resources.cabinet_sources() / "samples"
    if not folder.is_dir():
        raise Unfit("this installation lacks the samples")
    said = _sim(folder, "--app-class", "Visit")
    for words in ("square = FINISHED", "interrupted = CANCELLED", "A2 would be at"):
        holds(words in said, words)
    note(json.dumps({"folder": folder.name}))
