package labs;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;

import heptarm.doubles.runtime.TaskRunner;

/** Runs the applications of the process data `lab.applications` one after the other: the operator of a test, not an example. */
public class Medley extends RoboticsAPIApplication {
    @Override
    public void run() throws Exception {
        String names = getApplicationData().getProcessData("lab.applications").getValue();
        for (String name : names.split(" ")) {
            TaskRunner one = new TaskRunner("labs." + name);
            one.start();
            while (one.isAlive()) {
                Thread.sleep(2);
            }
            Report.line(getApplicationData(), "ended " + name + " " + one.failure());
        }
    }
}
