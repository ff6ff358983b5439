package heptarm.doubles;

import java.util.List;

import com.kuka.connectivity.fastRobotInterface.FRIJointOverlay;
import com.kuka.connectivity.motionModel.directServo.DirectServo;
import com.kuka.connectivity.motionModel.smartServo.ServoMotion;
import com.kuka.connectivity.motionModel.smartServo.SmartServo;
import com.kuka.connectivity.motionModel.smartServoLIN.SmartServoLIN;
import com.kuka.roboticsAPI.conditionModel.ICondition;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
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
import com.kuka.roboticsAPI.motionModel.BrakeTest;
import com.kuka.roboticsAPI.motionModel.CIRC;
import com.kuka.roboticsAPI.motionModel.CartesianPTP;
import com.kuka.roboticsAPI.motionModel.HandGuidingMotion;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.IMotionOverlay;
import com.kuka.roboticsAPI.motionModel.LIN;
import com.kuka.roboticsAPI.motionModel.MotionBatch;
import com.kuka.roboticsAPI.motionModel.PTP;
import com.kuka.roboticsAPI.motionModel.PTPHome;
import com.kuka.roboticsAPI.motionModel.PositionHold;
import com.kuka.roboticsAPI.motionModel.RelativeLIN;
import com.kuka.roboticsAPI.motionModel.RobotMotion;
import com.kuka.roboticsAPI.motionModel.SPL;
import com.kuka.roboticsAPI.motionModel.Spline;
import com.kuka.roboticsAPI.motionModel.SplineJP;
import com.kuka.roboticsAPI.motionModel.SplineMotionCP;

/** Turns motions of the Sunrise API (millimetres) into the plant's orders (SI). */
public final class Orders {
    private static final double MM = 1e-3;

    private Orders() {
    }

    /** The order for a motion of a frame on the robot. */
    public static MotionOrder of(long id, IMotion motion, ObjectFrame moved, LBR robot) {
        MotionOrder order = make(id, motion, robot);
        order.tcp = pose(robot.getFlange().transformationTo(moved));
        List<? extends RobotMotion<?>> parts = parts(motion);
        order.parts = new MotionOrder[parts.size()];
        for (int i = 0; i < order.parts.length; i++) {
            order.parts[i] = of(id, parts.get(i), moved, robot);
            inherit(order.parts[i], motion);
            if (order.parts[i].breaks.length > 0) {
                throw new IllegalArgumentException("the virtual cabinet watches break conditions of a whole batch or spline only");
            }
        }
        if (motion instanceof RelativeLIN) {
            turn(order, (RelativeLIN) motion, moved, robot);
        }
        if (motion instanceof RobotMotion) {
            parametrize(order, (RobotMotion<?>) motion);
            order.breaks = conditions(((RobotMotion<?>) motion).breakConditions(), robot);
            order.triggers = conditions(((RobotMotion<?>) motion).triggerConditions(), robot);
            overlay(order, ((RobotMotion<?>) motion).overlay());
            order.mode = Modes.of(((RobotMotion<?>) motion).getMode(), moved, robot);
        }
        return order;
    }

    /** An offset in the axes of another frame that moves along, in the moved frame's own: queued, the arm will be elsewhere. */
    private static void turn(MotionOrder order, RelativeLIN motion, ObjectFrame moved, LBR robot) {
        for (AbstractFrame one = motion.getReference(); one != null; one = one.getParent()) {
            if (one == robot.getFlange()) {
                Transformation to = moved.transformationTo(motion.getReference());
                Transformation turn = Transformation.ofRad(0, 0, 0, to.getAlphaRad(), to.getBetaRad(), to.getGammaRad());
                order.offset = pose(turn.compose(motion.getOffset()).compose(turn.invert()));
                order.reference = null;
            }
        }
    }

    private static double[][] conditions(List<ICondition> all, LBR robot) {
        double[][] numbers = new double[all.size()][];
        for (int i = 0; i < numbers.length; i++) {
            numbers[i] = ConditionOrder.of(all.get(i), robot);
        }
        return numbers;
    }

    /** Motions of a batch, segments of a spline; none of others. */
    static List<? extends RobotMotion<?>> parts(IMotion motion) {
        if (motion instanceof MotionBatch) {
            return ((MotionBatch) motion).motions();
        }
        if (motion instanceof Spline) {
            return ((Spline) motion).segments();
        }
        return motion instanceof SplineJP ? ((SplineJP) motion).segments() : List.of();
    }

    /** What a part does not say, the whole says. */
    private static void inherit(MotionOrder part, IMotion whole) {
        parametrize(part, (RobotMotion<?>) whole);
    }

    /** Fills in what has not been said yet. */
    private static void parametrize(MotionOrder order, RobotMotion<?> motion) {
        fill(order.relative, motion.relativeParameters());
        double[] blending = motion.blendingParameters();
        blending[1] *= MM;
        fill(order.blending, blending);
        if (motion instanceof SplineMotionCP) {
            double[] cartesian = ((SplineMotionCP<?>) motion).cartesianParameters();
            for (int i = 0; i < 3; i++) {
                cartesian[i] *= MM;
            }
            fill(order.cartesian, cartesian);
            int[] orientation = ((SplineMotionCP<?>) motion).orientationParameters();
            for (int i = 0; i < orientation.length; i++) {
                order.orientation[i] = order.orientation[i] < 0 ? orientation[i] : order.orientation[i];
            }
        }
    }

    private static void fill(double[] gaps, double[] values) {
        for (int i = 0; i < gaps.length; i++) {
            gaps[i] = Double.isNaN(gaps[i]) ? values[i] : gaps[i];
        }
    }

    private static MotionOrder make(long id, IMotion motion, LBR robot) {
        MotionOrder order;
        if (motion instanceof PTP) {
            order = new MotionOrder(id, "ptp");
            order.joints = ((PTP) motion).getDestination().get();
        } else if (motion instanceof PTPHome) {
            order = new MotionOrder(id, "ptp");
            order.joints = robot.home() instanceof JointPosition ? ((JointPosition) robot.home()).get() : null;
            if (order.joints == null) {
                target(order, (AbstractFrame) robot.home(), robot);
            }
        } else if (motion instanceof BrakeTest) {
            order = new MotionOrder(id, "hold");
            order.duration = ((BrakeTest) motion).seconds();
        } else if (motion instanceof CartesianPTP) {
            order = new MotionOrder(id, "ptp");
            target(order, ((CartesianPTP) motion).getDestination(), robot);
        } else if (motion instanceof LIN) {
            order = new MotionOrder(id, "lin");
            target(order, ((LIN) motion).getDestination(), robot);
        } else if (motion instanceof CIRC) {
            order = new MotionOrder(id, "circ");
            order.via = pose(((CIRC) motion).auxiliary().transformationFromWorld());
            target(order, ((CIRC) motion).getDestination(), robot);
        } else if (motion instanceof SPL) {
            order = new MotionOrder(id, "spl");
            target(order, ((SPL) motion).getDestination(), robot);
        } else if (motion instanceof MotionBatch || motion instanceof Spline || motion instanceof SplineJP) {
            order = new MotionOrder(id,
                    motion instanceof MotionBatch ? "batch" : motion instanceof Spline ? "spline" : "spline_joints");
        } else if (motion instanceof RelativeLIN) {
            RelativeLIN relative = (RelativeLIN) motion;
            order = new MotionOrder(id, "lin_rel");
            order.offset = pose(relative.getOffset());
            order.reference = axes(relative.getReference());
        } else if (motion instanceof PositionHold) {
            order = new MotionOrder(id, "hold");
            order.duration = ((PositionHold) motion).seconds();
        } else if (motion instanceof HandGuidingMotion) {
            order = new MotionOrder(id, "guide");
            order.guiding = ((HandGuidingMotion) motion).terms();
            order.guiding[15] *= MM;
        } else if (motion instanceof SmartServo || motion instanceof DirectServo) {
            order = new MotionOrder(id, motion instanceof SmartServo ? "servo" : "direct");
            order.timing = ((ServoMotion<?>) motion).timing();
        } else if (motion instanceof SmartServoLIN) {
            order = new MotionOrder(id, "straight");
            order.timing = ((SmartServoLIN) motion).timing();
            order.straight = ((SmartServoLIN) motion).limits();
            order.reference = axes(((SmartServoLIN) motion).reference());
        } else {
            throw new IllegalArgumentException("the virtual cabinet cannot carry out a " + motion.getClass().getName());
        }
        return order;
    }

    /** Quaternion of a frame's axes in the base; null: of none. */
    private static double[] axes(AbstractFrame frame) {
        if (frame == null) {
            return null;
        }
        double[] placed = pose(World.Current.getRootFrame().transformationTo(frame));
        return new double[] {placed[3], placed[4], placed[5], placed[6]};
    }

    private static void overlay(MotionOrder order, IMotionOverlay overlay) {
        if (overlay instanceof FRIJointOverlay) {
            order.friSession = ((FRIJointOverlay) overlay).session().number();
            order.friCommand = ((FRIJointOverlay) overlay).mode().ordinal();
        } else if (overlay != null) {
            throw new IllegalArgumentException("the virtual cabinet has no overlay " + overlay.getClass().getName());
        }
    }

    private static void target(MotionOrder order, AbstractFrame frame, LBR robot) {
        order.pose = pose(frame.transformationFromWorld());
        order.redundancy = redundancy(frame, robot);
    }

    /** E1, status and turn of a frame; NaN and -1 where it says nothing. */
    public static double[] redundancy(AbstractFrame frame, LBR robot) {
        IRedundancyCollection redundancy = frame.getRedundancyInformationForDevice(robot);
        double[] numbers = {Double.NaN, -1, -1};
        if (redundancy instanceof StatusTurnRedundancy) {
            numbers[1] = ((StatusTurnRedundancy) redundancy).getStatus();
            numbers[2] = ((StatusTurnRedundancy) redundancy).getTurn();
        }
        if (redundancy instanceof LBRE1Redundancy) {
            numbers[0] = ((LBRE1Redundancy) redundancy).getE1();
        }
        return numbers;
    }

    /** Metres and quaternion x y z w of a transformation. */
    public static double[] pose(ITransformation any) {
        Transformation t = Transformation.of(any);
        Matrix r = t.getRotationMatrix();
        double[] q = quaternion(r);
        return new double[] {t.getX() * MM, t.getY() * MM, t.getZ() * MM, q[0], q[1], q[2], q[3]};
    }

    /** The largest component leads, so that it is accurate everywhere. */
    private static double[] quaternion(Matrix r) {
        double trace = r.get(0, 0) + r.get(1, 1) + r.get(2, 2);
        double[] q = new double[4];
        int lead = 3;
        double most = trace;
        for (int i = 0; i < 3; i++) {
            if (r.get(i, i) > most) {
                most = r.get(i, i);
                lead = i;
            }
        }
        if (lead == 3) {
            q[0] = r.get(2, 1) - r.get(1, 2);
            q[1] = r.get(0, 2) - r.get(2, 0);
            q[2] = r.get(1, 0) - r.get(0, 1);
            q[3] = 1.0 + trace;
        } else {
            int j = (lead + 1) % 3;
            int k = (lead + 2) % 3;
            q[lead] = 1.0 + r.get(lead, lead) - r.get(j, j) - r.get(k, k);
            q[j] = r.get(j, lead) + r.get(lead, j);
            q[k] = r.get(k, lead) + r.get(lead, k);
            q[3] = r.get(k, j) - r.get(j, k);
        }
        double norm = Math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        for (int i = 0; i < 4; i++) {
            q[i] /= norm;
        }
        return q;
    }

    /** Millimetres of metres and a quaternion. */
    public static Transformation transformation(double[] pose) {
        double x = pose[3];
        double y = pose[4];
        double z = pose[5];
        double w = pose[6];
        double a = Math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z));
        double sb = -2 * (x * z - w * y);
        double cb = Math.hypot(1 - 2 * (y * y + z * z), 2 * (x * y + w * z));
        double b = Math.atan2(sb, cb);
        double c = Math.atan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y));
        if (cb < 1e-12) {
            a = Math.atan2(-2 * (x * y - w * z), 1 - 2 * (x * x + z * z));
            c = 0.0;
        }
        return Transformation.ofRad(pose[0] / MM, pose[1] / MM, pose[2] / MM, a, b, c);
    }
}
