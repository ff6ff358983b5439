"""What applications do beside moving the arm: odd constructors, threads left behind, calls that end the JVM."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.cli.running import HEPTARM

pytestmark = pytest.mark.skipif(shutil.which("javac") is None, reason="no javac here")

HABITS = """
package lab;

import java.util.ArrayList;
import java.util.List;
import java.util.concurrent.CountDownLatch;
import javax.annotation.Resource;
import javax.inject.Inject;
import javax.inject.Singleton;
import javax.jws.WebService;
import javax.xml.bind.JAXBContext;
import javax.xml.ws.handler.MessageContext;
import org.omg.CORBA.Environment;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.task.ITaskLogger;

class Habits extends RoboticsAPIApplication {
    private final LBR lbr;
    private final Left left;

    @Inject
    private Habits(LBR lbr, Left left) {
        this.lbr = lbr;
        this.left = left;
    }

    @Override
    public void run() {
        getLogger().info(lbr.getName() + " and two that know each other: " + (left.right.left == left));
        List<double[]> samples = new ArrayList<double[]>();
        for (int i = 0; i < 150; i++) {
            samples.add(new double[128 * 1024]);
        }
        getLogger().info(samples.size() + " MB are held");
        new Thread("publisher") {
            @Override
            public void run() {
                try {
                    new CountDownLatch(1).await();
                } catch (InterruptedException e) {
                    getLogger().warn("interrupted");
                }
            }
        }.start();
    }
}

@Singleton
class Left {
    @Inject Right right;
}

@Singleton
class Right {
    @Inject Left left;
}
"""
BROKEN_TASK = """
package lab;

import com.kuka.roboticsAPI.applicationModel.tasks.RoboticsAPIBackgroundTask;
import com.kuka.sunrise.common.task.categories.BackgroundTaskCategory;

@BackgroundTaskCategory(autoStart = true)
public class Camera extends RoboticsAPIBackgroundTask {
    private final int port = Integer.parseInt("none");

    @Override
    public void run() {
    }
}
"""
FAILING = """
package lab;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;

public class Failing extends RoboticsAPIApplication {
    private final int port = Integer.parseInt("drei");

    @Override
    public void run() {
    }
}
"""
EXITING = """
package lab;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;

public class Exiting extends RoboticsAPIApplication {
    @Override
    public void run() {
        System.exit(0);
    }
}
"""


def run(folder: Path, **sources: str) -> subprocess.CompletedProcess[str]:
    """Run the only application of these sources to its end."""
    for name, text in sources.items():
        (folder / f"{name}.java").write_text(text, encoding="utf-8")
    command = [*HEPTARM, "sim", "--app", str(folder), "--speed", "5"]
    return subprocess.run(command, input="", capture_output=True, text=True, timeout=120, check=False)


def test_an_application_with_the_habits_of_many_laboratories(tmp_path: Path) -> None:
    done = run(tmp_path, Habits=HABITS, Camera=BROKEN_TASK)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "LBR_iiwa_14_R820_1 and two that know each other: true" in done.stderr
    assert "150 MB are held" in done.stderr
    assert "the background task lab.Camera does not start" in done.stderr
    assert "the application has ended, its threads have not: publisher;" in done.stderr


@pytest.mark.long
def test_an_error_in_its_constructor_is_named_with_its_place(tmp_path: Path) -> None:
    done = run(tmp_path, Failing=FAILING)
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert "lab.Failing cannot be created" in last and 'For input string: "drei"' in last, done.stderr
    assert "Reflection" not in last and "Failing.java:7" in done.stderr


@pytest.mark.long
def test_a_call_of_system_exit_is_reported(tmp_path: Path) -> None:
    done = run(tmp_path, Exiting=EXITING)
    assert done.returncode == 1, done.stderr
    assert (
        "the application called System.exit" in done.stderr
    )  # maybe before the command has reported that it runs


KEYS = """
package lab;

import com.kuka.common.ThreadUtil;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.uiModel.userKeys.*;

public class Keys extends RoboticsAPIApplication implements IUserKeyListener {
    private volatile boolean done;

    @Override
    public void run() {
        IUserKeyBar bar = getApplicationUI().createUserKeyBar("Greifer links");
        bar.addUserKey(0, this, true).setText(UserKeyAlignment.TopMiddle, "fail");
        bar.addDoubleUserKey(2, this, false);
        bar.publish();
        getLogger().info("keys are published");
        while (!done) {
            ThreadUtil.milliSleep(20);
        }
    }

    @Override
    public void onKeyEvent(IUserKey key, UserKeyEvent event) {
        getLogger().info("event " + event);
        if (key.getSlot() == 0) {
            throw new IllegalStateException("no gripper");
        }
        done = event == UserKeyEvent.SecondKeyUp;
    }
}
"""


def test_a_user_key_whose_listener_fails_leaves_the_operator_at_work(tmp_path: Path) -> None:
    (tmp_path / "Keys.java").write_text(KEYS)
    pipe = subprocess.PIPE
    command = [*HEPTARM, "sim", "--app", str(tmp_path)]
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT, text=True) as process:
        try:
            assert process.stdin is not None and process.stdout is not None
            said = ""
            for line in process.stdout:
                said += line
                if "keys are published" in line:
                    process.stdin.write("press 1\npress 0\npress 2 Greifer links second\n")
                    process.stdin.flush()
            assert process.wait(timeout=60) == 0, said
        finally:
            process.kill()
    assert "there is no user key 1" in said and "press 0 Greifer links (fail)" in said
    assert "the listener of a user key ended with an error" in said and "no gripper" in said
    assert "event SecondKeyUp" in said
