package heptarm.doubles;

import java.util.ArrayList;
import java.util.List;

import com.kuka.roboticsAPI.conditionModel.BooleanIOCondition;
import com.kuka.roboticsAPI.conditionModel.ForceComponentCondition;
import com.kuka.roboticsAPI.conditionModel.ForceCondition;
import com.kuka.roboticsAPI.conditionModel.ICondition;
import com.kuka.roboticsAPI.conditionModel.IORangeCondition;
import com.kuka.roboticsAPI.conditionModel.JointTorqueCondition;
import com.kuka.roboticsAPI.conditionModel.MotionPathCondition;
import com.kuka.roboticsAPI.conditionModel.TorqueComponentCondition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;

/**
 * Turns conditions of the Sunrise API into numbers for the plant, in SI and in postfix order; each node is its kind and what
 * belongs to it, see heptarm/virtual/condition.py.
 *
 * <p>A frame is nine numbers: 1 if the point is fixed to the flange, x y z seen from the flange or the base; 1 if the axes are
 * fixed to the flange, their quaternion there or in the base.
 */
public final class ConditionOrder {
    private static final int JOINT_TORQUE = 1;
    private static final int FORCE = 2;
    private static final int FORCE_COMPONENT = 5;
    private static final int TORQUE_COMPONENT = 6;
    private static final int BOOLEAN_SIGNAL = 7;
    private static final int OUTSIDE_RANGE = 8;
    private static final int PATH = 9;
    private static final int COMBINED = 32;

    private final LBR robot;
    private final List<Double> numbers = new ArrayList<>();

    private ConditionOrder(LBR robot) {
        this.robot = robot;
    }

    public static double[] of(ICondition condition, LBR robot) {
        ConditionOrder order = new ConditionOrder(robot);
        order.add(condition);
        return order.numbers.stream().mapToDouble(Double::doubleValue).toArray();
    }

    private void put(double... values) {
        for (double value : values) {
            numbers.add(value);
        }
    }

    private void add(ICondition condition) {
        if (condition instanceof Criterion.Combined) {
            Criterion.Combined combined = (Criterion.Combined) condition;
            for (ICondition part : combined.parts) {
                add(part);
            }
            put(COMBINED + combined.kind.ordinal());
            put(combined.parts.length);
        } else if (condition instanceof JointTorqueCondition) {
            put(JOINT_TORQUE);
            put(((JointTorqueCondition) condition).numbers());
        } else if (condition instanceof ForceCondition) {
            put(FORCE + ((ForceCondition) condition).part().ordinal());
            frame((Estimated) condition);
            put(((ForceCondition) condition).numbers());
        } else if (condition instanceof ForceComponentCondition) {
            put(FORCE_COMPONENT);
            frame((Estimated) condition);
            put(((ForceComponentCondition) condition).numbers());
        } else if (condition instanceof TorqueComponentCondition) {
            put(TORQUE_COMPONENT);
            frame((Estimated) condition);
            put(((TorqueComponentCondition) condition).numbers());
        } else if (condition instanceof BooleanIOCondition) {
            put(BOOLEAN_SIGNAL);
            put(((BooleanIOCondition) condition).numbers());
        } else if (condition instanceof IORangeCondition) {
            put(OUTSIDE_RANGE);
            put(((IORangeCondition) condition).numbers());
            put(COMBINED + Criterion.Kind.NOT.ordinal(), 1);
        } else if (condition instanceof MotionPathCondition) {
            put(PATH);
            put(((MotionPathCondition) condition).numbers());
        } else {
            throw new IllegalArgumentException("the virtual cabinet cannot watch a " + condition.getClass().getName());
        }
    }

    private void frame(Estimated condition) {
        AbstractFrame point = condition.measured() == null ? robot.getFlange() : condition.measured();
        AbstractFrame axes = condition.orientation() == null ? robot.getFlange() : condition.orientation();
        double[] at = seen(point);
        double[] turned = seen(axes);
        put(at[0], at[1], at[2], at[3]);
        put(turned[0], turned[4], turned[5], turned[6], turned[7]);
    }

    /** 1 and the pose seen from the flange, or 0 and the pose in the base. */
    private double[] seen(AbstractFrame frame) {
        boolean moves = false;
        for (AbstractFrame one = frame; one != null; one = one.getParent()) {
            moves |= one == robot.getFlange();
        }
        double[] pose = Orders.pose((moves ? robot.getFlange() : robot.getRootFrame()).transformationTo(frame));
        double[] result = new double[8];
        result[0] = moves ? 1 : 0;
        System.arraycopy(pose, 0, result, 1, 7);
        return result;
    }
}
