package heptarm.app;

import com.kuka.connectivity.motionModel.smartServo.ServoMotion;
import com.kuka.connectivity.motionModel.smartServoLIN.SmartServoLIN;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.Frame;

import heptarm.core.CommandRejected;
import heptarm.wire.CartesianDynamics;
import heptarm.wire.ServoOpen;

/** Cartesian servo motions. Only this class refers to that option's classes, so a cabinet without it still has the others. */
final class SunriseServoLin {
    private SunriseServoLin() {
    }

    /** Capability that the option adds; a LinkageError if it is not installed. */
    static String capability() {
        return SmartServoLIN.class == null ? "" : "servo_lin";
    }

    /** Build a servo motion at the current position; its limits apply along the axes of the base. */
    static ServoMotion<?> of(ServoOpen open, LBR robot, SunriseTools tools) throws CommandRejected {
        SmartServoLIN motion = new SmartServoLIN(robot.getCurrentCartesianPosition(tools.motionFrame(open.frame)));
        motion.setReferenceFrame(robot.getRootFrame());
        CartesianDynamics limits = open.linear;
        if (!Double.isNaN(limits.velocity)) {
            motion.setMaxTranslationVelocity(each(Convert.toMillimetres(limits.velocity)));
        }
        if (!Double.isNaN(limits.acceleration)) {
            motion.setMaxTranslationAcceleration(each(Convert.toMillimetres(limits.acceleration)));
        }
        if (!Double.isNaN(limits.orientation_velocity)) {
            motion.setMaxOrientationVelocity(each(limits.orientation_velocity));
        }
        if (!Double.isNaN(limits.orientation_acceleration)) {
            motion.setMaxOrientationAcceleration(each(limits.orientation_acceleration));
        }
        return motion;
    }

    private static double[] each(double value) {
        return new double[] {value, value, value};
    }

    static void follow(ServoMotion<?> motion, Frame target) {
        ((SmartServoLIN) motion).getRuntime().setDestination(target);
    }
}
