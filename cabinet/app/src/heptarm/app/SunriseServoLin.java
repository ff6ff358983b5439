package heptarm.app;

import com.kuka.connectivity.motionModel.smartServo.ServoMotion;
import com.kuka.connectivity.motionModel.smartServoLIN.SmartServoLIN;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.Frame;

import heptarm.core.Refusal;
import heptarm.wire.CartesianDynamics;
import heptarm.wire.ServoOpen;

/** Straight servo motions. Only this class names that option's classes, so that a cabinet without it still has the others. */
final class SunriseLin {
    private SunriseLin() {
    }

    /** What a cabinet with this option can do; a LinkageError where it is not installed. */
    static String capability() {
        return SmartServoLIN.class == null ? "" : "servo_lin";
    }

    /** A servo motion at the present position; its limits hold along the axes of the base. */
    static ServoMotion<?> of(ServoOpen open, LBR robot, Tools tools) throws Refusal {
        SmartServoLIN motion = new SmartServoLIN(robot.getCurrentCartesianPosition(tools.moved(open.frame)));
        motion.setReferenceFrame(robot.getRootFrame());
        CartesianDynamics most = open.linear;
        if (!Double.isNaN(most.velocity)) {
            motion.setMaxTranslationVelocity(each(Convert.toMillimetres(most.velocity)));
        }
        if (!Double.isNaN(most.acceleration)) {
            motion.setMaxTranslationAcceleration(each(Convert.toMillimetres(most.acceleration)));
        }
        if (!Double.isNaN(most.orientation_velocity)) {
            motion.setMaxOrientationVelocity(each(most.orientation_velocity));
        }
        if (!Double.isNaN(most.orientation_acceleration)) {
            motion.setMaxOrientationAcceleration(each(most.orientation_acceleration));
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
