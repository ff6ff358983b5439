package heptarm.app;

import com.kuka.roboticsAPI.deviceModel.JointLimits;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.motionModel.HandGuidingMotion;
import com.kuka.roboticsAPI.motionModel.IMotion;

import heptarm.core.CommandRejected;
import heptarm.core.robot.GuidedSpeed;
import heptarm.core.robot.RobotModels;
import heptarm.wire.Code;
import heptarm.wire.HandGuide;
import heptarm.wire.RobotInfo;

/** Hand guiding of Sunrise. Only this class refers to the option's classes, so a cabinet without it still works. */
final class SunriseHandGuiding {
    private static final int JOINTS = 7;

    private SunriseHandGuiding() {
    }

    /** Capability that the option adds; a LinkageError if it is not installed. */
    static String capability() {
        new HandGuidingMotion();
        return "hand_guide";
    }

    /** Build the motion of a checked item. */
    static IMotion of(HandGuide guide, LBR robot) throws CommandRejected {
        HandGuidingMotion motion = new HandGuidingMotion();
        JointLimits own = robot.getJointLimits();
        double[] lowest = own.getMinJointPosition().get();
        double[] highest = own.getMaxJointPosition().get();
        RobotInfo info = RobotModels.describe(robot.getName(), lowest.clone(), highest.clone());
        boolean[] enabled = new boolean[JOINTS];
        for (int i = 0; i < JOINTS; i++) {
            enabled[i] = !(Double.isNaN(guide.q_min[i]) && Double.isNaN(guide.q_max[i]));
            lowest[i] = Double.isNaN(guide.q_min[i]) ? lowest[i] : guide.q_min[i];
            highest[i] = Double.isNaN(guide.q_max[i]) ? highest[i] : guide.q_max[i];
        }
        try {
            motion.setJointLimitsMin(lowest);
            motion.setJointLimitsMax(highest);
            motion.setJointLimitsEnabled(enabled);
            motion.setJointLimitViolationFreezesAll(guide.freezes_all);
        } catch (NoSuchMethodError e) { // older cabinets have other method names
            motion.setAxisLimitsMin(lowest);
            motion.setAxisLimitsMax(highest);
            motion.setAxisLimitsEnabled(enabled);
            motion.setAxisLimitViolationFreezesAll(guide.freezes_all);
        }
        motion.setPermanentPullOnViolationAtStart(guide.pulls_back);
        limitSpeed(motion, guide, GuidedSpeed.ofAxes(info));
        return motion;
    }

    private static void limitSpeed(HandGuidingMotion motion, HandGuide guide, double ofAxes) throws CommandRejected {
        boolean isChosen = !Double.isNaN(guide.joint_velocity) || !Double.isNaN(guide.cartesian_velocity);
        double along = Double.isNaN(guide.cartesian_velocity) ? GuidedSpeed.ALONG : guide.cartesian_velocity;
        try {
            motion.setJointVelocityLimit(Double.isNaN(guide.joint_velocity) ? ofAxes : guide.joint_velocity);
            motion.setCartVelocityLimit(Convert.toMillimetres(along));
        } catch (NoSuchMethodError e) {
            if (!isChosen) {
                return; // an older cabinet limits the speed by itself
            }
            throw new CommandRejected(Code.UNSUPPORTED, "the hand guiding of this cabinet has no speed limit (" + e.getMessage() + "); leave velocity limits out");
        }
    }
}
