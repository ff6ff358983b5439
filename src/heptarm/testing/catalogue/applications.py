"""Scenarios: Java programs on the cabinet; they need a Java compiler and separate simulators."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from heptarm.arm.arm import Arm
from heptarm.errors import HeptarmError
from heptarm.testing.measure import Unfit, holds
from heptarm.testing.scenario import Risk, scenario

_PATIENCE = 120.0
#: A Sunrise application that does not use heptarm.
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
        getLogger().info("reported " + times + " times");
    }
}
"""
#: An application on heptarm's core: SI units, results with causes, refusals with parameters; no network.
_OWN = """
package lab;

import javax.inject.Inject;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;
import heptarm.app.CabinetArm;
import heptarm.core.api.Arm;
import heptarm.core.api.Move;
import heptarm.core.CommandRejected;

public class Own extends RoboticsAPIApplication {
    @Inject
    private LBR lbr;

    @Override
    public void run() throws Exception {
        Arm arm = CabinetArm.of(lbr, this);
        try {
            arm.move(Move.ptp(0.0, 0.5, 0.0, -1.4, 0.0, 1.2, 0.0).speed(0.8));
            double before = arm.pose().xyz[2];
            String how = "" + arm.move(Move.linRel(0.0, 0.0, 0.05).along("base").velocity(0.2)).cause;
            long offset = Math.round(1000 * (arm.pose().xyz[2] - before));
            getLogger().info(how + ", lifted by " + offset + " mm");
            arm.move(Move.ptp(0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0));
        } catch (CommandRejected e) {
            getLogger().info("refused " + e.parameter + ": " + e.getMessage());
        } finally {
            arm.close();
        }
    }
}
"""
_PROJECT = """
<persistence><processDataContainer>
<processData dataType="java.lang.Integer" id="lab.times" defaultValue="1" value="2"/>
</processDataContainer></persistence>
"""


def _sim(name: str, source: str) -> str:
    """Compile and run an application in a separate simulator; return its log.

    Raises:
        Unfit: no Java compiler is installed.
    """
    if shutil.which("javac") is None:
        raise Unfit("there is no javac here")
    with TemporaryDirectory(prefix="heptarm-") as folder:
        (Path(folder) / f"{name}.java").write_text(source, encoding="utf-8")
        (Path(folder) / "RoboticsAPI.data.xml").write_text(_PROJECT, encoding="utf-8")
        command = [sys.executable, "-m", "heptarm.cli.main", "sim", "app", folder, "--speed", "2"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=_PATIENCE, check=False)
    if done.returncode:
        last = (done.stderr or done.stdout).strip().splitlines()[-3:]
        raise HeptarmError(f"the application ended with {done.returncode}: {' | '.join(last)}")
    return done.stderr


@scenario(line=13, risk=Risk.STILL, virtual=True)
def foreign(arm: Arm) -> None:
    """A Sunrise application of other people compiles and runs unchanged, with its own process data."""
    said = _sim("Nod", _FOREIGN)
    holds("lifted by 40 mm" in said, "it measured its line: 40 mm")
    holds("reported 2 times" in said, "it read its process data")


@scenario(line=12, risk=Risk.STILL, virtual=True)
def own(arm: Arm) -> None:
    """An application on heptarm's core, without a network: motions, results, a refusal."""
    said = _sim("Own", _OWN)
    holds("FINISHED, lifted by 50 mm" in said, "its line was 50 mm long")
    holds("A2 must be in" in said, "what cannot be done was refused by name")
