package heptarm.app;

import java.util.ArrayList;
import java.util.Arrays;
import java.util.Iterator;
import java.util.List;
import java.util.ServiceLoader;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseExecutionService;
import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.core.Log;
import heptarm.core.robot.Robot;
import heptarm.core.robot.RobotModels;
import heptarm.core.robot.SimulatorProbe;
import heptarm.wire.RobotInfo;

/** Assembles the cabinet's robot for the core. */
final class SunriseRobot {
    private SunriseRobot() {
    }

    /** The robot with what an application's project provides for it: tools, frames and signals by its process data. */
    static Robot of(LBR lbr, RoboticsAPIApplication application, SunrisePanel panel, ProcessSettings settings, Log log) {
        SunriseExecutionService execution = (SunriseExecutionService) lbr.getController().getExecutionService();
        SimulatorProbe probe = probe();
        RobotInfo info = RobotModels.describe(lbr.getName(), lbr.getJointLimits().getMinJointPosition().get(),
                lbr.getJointLimits().getMaxJointPosition().get());
        SunriseTools tools = new SunriseTools(lbr, application.getApplicationData(), settings.text("heptarm.tools"),
                settings.text("heptarm.frames"), probe, log);
        SunriseSignals signals = new SunriseSignals(lbr.getController(), settings.text("heptarm.io"), log);
        return new Robot(info, lbr.getController().getName(), probe != null, capabilities(log),
                new SunriseMotions(lbr, tools, signals, execution, application.getApplicationControl(), probe, log),
                new SunriseSensors(lbr, tools, probe), new SunriseSafety(lbr, execution, application.getRecovery(), probe), tools,
                signals, panel);
    }

    /** Null on a real robot. */
    private static SimulatorProbe probe() {
        Iterator<SimulatorProbe> found = ServiceLoader.load(SimulatorProbe.class, SimulatorProbe.class.getClassLoader()).iterator();
        return found.hasNext() ? found.next() : null;
    }

    private static String[] capabilities(Log log) {
        List<String> all = new ArrayList<String>(Arrays.asList(MotionBuilder.CAPABILITIES));
        try {
            all.addAll(Arrays.asList(SunriseServo.capabilities()));
        } catch (LinkageError e) {
            log.info("this cabinet has no servo motions: " + e);
        }
        try {
            all.add(SunriseServoLin.capability());
        } catch (LinkageError e) {
            log.info("this cabinet has no Cartesian servo motions: " + e);
        }
        try {
            all.addAll(Arrays.asList(SunriseFri.capabilities()));
        } catch (LinkageError e) {
            log.info("this cabinet has no FRI: " + e);
        }
        try {
            all.add(SunriseHandGuiding.capability());
        } catch (LinkageError e) {
            log.info("this cabinet has no hand guiding: " + e);
        }
        try {
            all.add(SunriseTools.capability());
        } catch (NoSuchMethodException e) {
            log.info("this cabinet has no safety workpiece: " + e);
        }
        return all.toArray(new String[0]);
    }
}
