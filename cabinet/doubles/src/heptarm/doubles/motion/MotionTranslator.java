package heptarm.doubles.motion;

import java.util.Arrays;
import java.util.List;

import com.kuka.connectivity.fastRobotInterface.FRIJointOverlay;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.deviceModel.LBRE1Redundancy;
import com.kuka.roboticsAPI.deviceModel.StatusTurnRedundancy;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.World;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Matrix;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.geometricModel.redundancy.IRedundancyCollection;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.IMotionOverlay;
import com.kuka.roboticsAPI.motionModel.Motion;
import com.kuka.roboticsAPI.motionModel.RobotMotion;
import com.kuka.roboticsAPI.motionModel.SplineMotionCP;

import heptarm.doubles.seam.Blending;
import heptarm.doubles.seam.CartesianDynamics;
import heptarm.doubles.seam.FriOverlay;
import heptarm.doubles.seam.MotionOrder;
import heptarm.doubles.seam.Redundancy;

/** Translates motions of the Sunrise API (mm) into orders for the plant (SI). */
public final class MotionTranslator {
    private static final double MM = 1e-3;

    private MotionTranslator() {
    }

    /** The order for a motion of a frame on the robot. */
    public static MotionOrder of(long id, IMotion motion, ObjectFrame moved, LBR robot) {
        if (!(motion instanceof Motion)) {
            throw new IllegalArgumentException("the virtual cabinet cannot execute a motion of class " + motion.getClass().getName());
        }
        MotionOrder order = new MotionOrder();
        order.id = id;
        ((Motion<?>) motion).describe(order, moved, robot);
        order.tcp = pose(robot.getFlange().transformationTo(moved));
        List<? extends RobotMotion<?>> parts = parts(motion);
        order.parts = new MotionOrder[parts.size()];
        for (int i = 0; i < order.parts.length; i++) {
            order.parts[i] = of(id, parts.get(i), moved, robot);
            parametrize(order.parts[i], (RobotMotion<?>) motion); // what a part leaves open
            if (order.parts[i].breaks.length > 0) {
                throw new IllegalArgumentException("break conditions of single parts are not supported: set them on the whole batch or spline");
            }
        }
        if (motion instanceof RobotMotion) {
            parametrize(order, (RobotMotion<?>) motion);
            order.breaks = AbstractCondition.translate(((RobotMotion<?>) motion).breakConditions(), robot);
            order.triggers = AbstractCondition.translate(((RobotMotion<?>) motion).triggerConditions(), robot);
            overlay(order, ((RobotMotion<?>) motion).overlay());
            order.mode = ControlModeTranslator.of(((RobotMotion<?>) motion).getMode(), moved, robot);
        }
        return order;
    }

    /** Motions of a batch, segments of a spline; none of others. */
    static List<? extends RobotMotion<?>> parts(IMotion motion) {
        return motion instanceof Motion ? ((Motion<?>) motion).parts() : List.of();
    }

    /** Sets the parameters that have not been set yet. */
    private static void parametrize(MotionOrder order, RobotMotion<?> motion) {
        fill(order.jointDynamics.velocity, motion.jointDynamics().velocity);
        fill(order.jointDynamics.acceleration, motion.jointDynamics().acceleration);
        fill(order.jointDynamics.jerk, motion.jointDynamics().jerk);
        Blending blending = order.blending;
        blending.relative = first(blending.relative, motion.blending().relative);
        blending.distance = first(blending.distance, motion.blending().distance);
        blending.angle = first(blending.angle, motion.blending().angle);
        if (motion instanceof SplineMotionCP) {
            SplineMotionCP<?> path = (SplineMotionCP<?>) motion;
            CartesianDynamics into = order.cartesianDynamics;
            CartesianDynamics from = path.cartesianDynamics();
            into.velocity = first(into.velocity, from.velocity);
            into.acceleration = first(into.acceleration, from.acceleration);
            into.jerk = first(into.jerk, from.jerk);
            into.orientationVelocity = first(into.orientationVelocity, from.orientationVelocity);
            into.orientationAcceleration = first(into.orientationAcceleration, from.orientationAcceleration);
            into.orientationJerk = first(into.orientationJerk, from.orientationJerk);
            order.orientationType = order.orientationType == null ? path.orientationType() : order.orientationType;
            order.orientationReference =
                    order.orientationReference == null ? path.orientationReference() : order.orientationReference;
        }
    }

    private static void fill(double[] gaps, double[] values) {
        for (int i = 0; i < gaps.length; i++) {
            gaps[i] = first(gaps[i], values[i]);
        }
    }

    /** The first number that was set. */
    private static double first(double value, double other) {
        return Double.isNaN(value) ? other : value;
    }

    /** Quaternion of a frame's axes in the base; null: of none. */
    public static double[] axes(AbstractFrame frame) {
        return frame == null ? null : axes(frame, World.Current.getRootFrame());
    }

    /** Quaternion of a frame's axes seen from another frame. */
    public static double[] axes(AbstractFrame frame, AbstractFrame from) {
        return Arrays.copyOfRange(pose(from.transformationTo(frame)), 3, 7);
    }

    private static void overlay(MotionOrder order, IMotionOverlay overlay) {
        if (overlay instanceof FRIJointOverlay) {
            order.friOverlay = new FriOverlay();
            order.friOverlay.session = ((FRIJointOverlay) overlay).session().number();
            order.friOverlay.command = ((FRIJointOverlay) overlay).mode().ordinal();
        } else if (overlay != null) {
            throw new IllegalArgumentException("the virtual cabinet has no overlay " + overlay.getClass().getName());
        }
    }

    /** Set the target of an order to a frame. */
    public static void target(MotionOrder order, AbstractFrame frame, LBR robot) {
        order.pose = pose(frame.transformationFromWorld());
        order.redundancy = redundancy(frame, robot);
    }

    /** Redundancy of a frame. */
    public static Redundancy redundancy(AbstractFrame frame, LBR robot) {
        IRedundancyCollection redundancy = frame.getRedundancyInformationForDevice(robot);
        Redundancy found = new Redundancy();
        if (redundancy instanceof StatusTurnRedundancy) {
            found.status = ((StatusTurnRedundancy) redundancy).getStatus();
            found.turn = ((StatusTurnRedundancy) redundancy).getTurn();
        }
        if (redundancy instanceof LBRE1Redundancy) {
            found.e1 = ((LBRE1Redundancy) redundancy).getE1();
        }
        return found;
    }

    /** Metres and quaternion x y z w of a transformation. */
    public static double[] pose(ITransformation any) {
        Transformation t = Transformation.of(any);
        Matrix r = t.getRotationMatrix();
        double[] q = quaternion(r);
        return new double[] {t.getX() * MM, t.getY() * MM, t.getZ() * MM, q[0], q[1], q[2], q[3]};
    }

    /** Computes the largest component first, so that the result is accurate everywhere. */
    private static double[] quaternion(Matrix r) {
        double trace = r.get(0, 0) + r.get(1, 1) + r.get(2, 2);
        double[] q = new double[4];
        int largest = 3;
        double most = trace;
        for (int i = 0; i < 3; i++) {
            if (r.get(i, i) > most) {
                most = r.get(i, i);
                largest = i;
            }
        }
        if (largest == 3) {
            q[0] = r.get(2, 1) - r.get(1, 2);
            q[1] = r.get(0, 2) - r.get(2, 0);
            q[2] = r.get(1, 0) - r.get(0, 1);
            q[3] = 1.0 + trace;
        } else {
            int j = (largest + 1) % 3;
            int k = (largest + 2) % 3;
            q[largest] = 1.0 + r.get(largest, largest) - r.get(j, j) - r.get(k, k);
            q[j] = r.get(j, largest) + r.get(largest, j);
            q[k] = r.get(k, largest) + r.get(largest, k);
            q[3] = r.get(k, j) - r.get(j, k);
        }
        double norm = Math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        for (int i = 0; i < 4; i++) {
            q[i] /= norm;
        }
        return q;
    }
}
