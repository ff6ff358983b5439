"""Clients of heptarm observe an application of somebody else while it moves the arm, and may stop it."""

from __future__ import annotations

import re
import shutil
import subprocess
import time
from contextlib import suppress
from pathlib import Path

import pytest

import heptarm as ha
from tests.cli.running import HEPTARM

pytestmark = pytest.mark.skipif(shutil.which("javac") is None, reason="no javac here")

SWINGING = """
package lab;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import javax.inject.Inject;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;

public class Swinging extends RoboticsAPIApplication {
    @Inject
    private LBR robot;

    @Override
    public void run() {
        double far = 0.5;
        while (robot.move(ptp(0, far, 0, -1, 0, 1, 0).setJointVelocityRel(0.2)) != null && reached(far)) {
            far = -far;
        }
        getLogger().info("somebody has stopped the arm");
        robot.move(ptp(0, 0, 0, 0, 0, 0, 0));
    }

    private boolean reached(double a2) {
        return Math.abs(robot.getCommandedJointPosition().get(1) - a2) < 0.01;
    }
}
"""


def test_an_application_is_observed_recorded_and_stopped(tmp_path: Path) -> None:
    (tmp_path / "Swinging.java").write_text(SWINGING)
    command = [*HEPTARM, "sim", "--app", str(tmp_path), "--port", "0"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT, text=True) as process:
        try:
            assert process.stdout is not None
            target = ""
            for line in process.stdout:
                if found := re.search(r"Observe it with (sim://\S+)", line):
                    target = found[1]
                    break
            with ha.connect(target, control=False) as arm:
                arm.wait_until(lambda state: abs(state.q[1]) > 0.2, timeout=60.0)
                with (
                    pytest.raises(ha.NotInControl, match="the application Swinging controls this robot"),
                    ha.connect(target),
                ):
                    pass
                shown = subprocess.run(
                    [*HEPTARM, "state", "--target", target],
                    capture_output=True,
                    text=True,
                    timeout=60,
                    check=False,
                )
                assert shown.returncode == 0, shown.stderr
                with suppress(ha.HeptarmError):  # the cabinet ends with the application
                    while process.poll() is None:  # a stop between two motions ends none
                        arm.stop()
                        time.sleep(0.3)
            said = process.stdout.read()
            assert process.wait(timeout=60) == 0, said
            assert "somebody has stopped the arm" in said
        finally:
            process.kill()
