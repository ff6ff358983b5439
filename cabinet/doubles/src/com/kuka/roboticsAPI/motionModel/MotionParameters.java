package com.kuka.roboticsAPI.motionModel;

import java.util.Arrays;

import heptarm.doubles.seam.Blending;
import heptarm.doubles.seam.CartesianDynamics;
import heptarm.doubles.seam.JointDynamics;

/** Parameters of a motion, to be printed; NaN where not set. */
public final class MotionParameters {
    private static final double MM = 1e-3;

    private final String text;

    MotionParameters(RobotMotion<?> motion) {
        JointDynamics joints = motion.jointDynamics();
        Blending blending = motion.blending();
        String cartesian = "";
        if (motion instanceof SplineMotionCP) {
            CartesianDynamics path = ((SplineMotionCP<?>) motion).cartesianDynamics();
            cartesian = ", Cartesian velocity " + path.velocity / MM + " mm/s, acceleration " + path.acceleration / MM
                    + " mm/s2, jerk " + path.jerk / MM + " mm/s3, orientation velocity " + path.orientationVelocity + " rad/s, acceleration "
                    + path.orientationAcceleration + " rad/s2, jerk " + path.orientationJerk + " rad/s3";
        }
        text = motion.getClass().getSimpleName() + ", joint velocity " + Arrays.toString(joints.velocity) + ", acceleration "
                + Arrays.toString(joints.acceleration) + ", jerk " + Arrays.toString(joints.jerk) + ", blending "
                + blending.relative + ", " + blending.distance / MM + " mm, " + blending.orientation + " rad" + cartesian;
    }

    @Override
    public String toString() {
        return text;
    }
}
