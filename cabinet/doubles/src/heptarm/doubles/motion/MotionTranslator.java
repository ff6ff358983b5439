package heptarm.doubles.motion;

import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;

import com.kuka.connectivity.fastRobotInterface.FRIJointOverlay;
import com.kuka.roboticsAPI.conditionModel.ICondition;
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

import heptarm.doubles.seam.Condition;
import heptarm.doubles.seam.FriOverlay;
import heptarm.doubles.seam.MotionCondition;
import heptarm.doubles.seam.MotionOrder;
import heptarm.doubles.seam.PlantMotion;
import heptarm.doubles.seam.Pose;
import heptarm.doubles.seam.Redundancy;

/** Translates motions of the Sunrise API (mm) into those of the plant (SI): each motion describes itself with it. */
public final class MotionTranslator {
    private static final double MM = 1e-3;

    private final ObjectFrame motionFrame;
    private final LBR robot;

    private MotionTranslator(ObjectFrame motionFrame, LBR robot) {
        this.motionFrame = motionFrame;
        this.robot = robot;
    }

    /** The order for a motion of a frame on the robot. */
    public static MotionOrder of(long id, IMotion motion, ObjectFrame moved, LBR robot) {
        MotionOrder order = new MotionOrder();
        order.id = id;
        order.motion = new MotionTranslator(moved, robot).described(motion);
        order.tcp = pose(robot.getFlange().transformationTo(moved));
        if (motion instanceof RobotMotion) {
            RobotMotion<?> whole = (RobotMotion<?>) motion;
            order.conditions = conditions(whole, robot);
            order.friOverlay = overlay(whole.overlay());
            order.mode = ControlModeTranslator.of(whole.getMode(), moved, robot);
        }
        return order;
    }

    private PlantMotion described(IMotion motion) {
        if (!(motion instanceof Motion)) {
            throw new IllegalArgumentException("the virtual cabinet cannot execute a motion of class " + motion.getClass().getName());
        }
        return ((Motion<?>) motion).describe(this);
    }

    /** The motions of a batch, or the segments of a spline. */
    public PlantMotion[] parts(List<? extends RobotMotion<?>> parts) {
        for (RobotMotion<?> one : parts) {
            if (!one.breakConditions().isEmpty()) {
                throw new IllegalArgumentException("break conditions of single parts are not supported: set them on the whole batch or spline");
            }
        }
        return parts.stream().map(this::described).toArray(PlantMotion[]::new);
    }

    /** Motions of a batch, segments of a spline; none of others. */
    static List<? extends RobotMotion<?>> parts(IMotion motion) {
        return motion instanceof Motion ? ((Motion<?>) motion).parts() : List.of();
    }

    public LBR robot() {
        return robot;
    }

    public ObjectFrame motionFrame() {
        return motionFrame;
    }

    /** Whether a frame is fixed to the flange; null is not. */
    public boolean isOnFlange(AbstractFrame frame) {
        for (AbstractFrame one = frame; one != null; one = one.getParent()) {
            if (one == robot.getFlange()) {
                return true;
            }
        }
        return false;
    }

    /** Pose of a frame in the base. */
    public Pose pose(AbstractFrame frame) {
        return place(frame.transformationFromWorld());
    }

    /** A transformation in the plant's terms. */
    public static Pose place(ITransformation any) {
        double[] numbers = pose(any);
        Pose place = new Pose();
        place.xyz = Arrays.copyOfRange(numbers, 0, 3);
        place.quat = Arrays.copyOfRange(numbers, 3, 7);
        return place;
    }

    /** Redundancy of a frame. */
    public Redundancy redundancy(AbstractFrame frame) {
        return redundancy(frame, robot);
    }

    /** Triggers, then break conditions: one that is both is reported before it ends the motion. */
    private static MotionCondition[] conditions(RobotMotion<?> whole, LBR robot) {
        List<MotionCondition> found = new ArrayList<>();
        add(found, whole.triggerConditions(), false, -1, robot);
        List<? extends RobotMotion<?>> parts = whole.parts();
        for (int i = 0; i < parts.size(); i++) {
            add(found, parts.get(i).triggerConditions(), false, i, robot);
        }
        add(found, whole.breakConditions(), true, -1, robot);
        return found.toArray(new MotionCondition[0]);
    }

    private static void add(List<MotionCondition> to, List<ICondition> conditions, boolean breaks, int part, LBR robot) {
        Condition[] translated = AbstractCondition.translate(conditions, robot);
        for (int i = 0; i < translated.length; i++) {
            MotionCondition one = new MotionCondition();
            one.condition = translated[i];
            one.breaks = breaks;
            one.part = part;
            one.index = i;
            to.add(one);
        }
    }

    /** Quaternion of a frame's axes in the base; null: of none. */
    public static double[] axes(AbstractFrame frame) {
        return frame == null ? null : axes(frame, World.Current.getRootFrame());
    }

    /** Quaternion of a frame's axes seen from another frame. */
    public static double[] axes(AbstractFrame frame, AbstractFrame from) {
        return Arrays.copyOfRange(pose(from.transformationTo(frame)), 3, 7);
    }

    private static FriOverlay overlay(IMotionOverlay overlay) {
        if (overlay == null) {
            return null;
        }
        if (!(overlay instanceof FRIJointOverlay)) {
            throw new IllegalArgumentException("the virtual cabinet has no overlay " + overlay.getClass().getName());
        }
        FriOverlay made = new FriOverlay();
        made.session = ((FRIJointOverlay) overlay).session().number();
        made.command = ((FRIJointOverlay) overlay).mode().ordinal();
        return made;
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
