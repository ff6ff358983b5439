package heptarm.doubles.motion;

import java.util.Arrays;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;

import heptarm.doubles.seam.Condition;
import heptarm.doubles.seam.MeasuringFrame;
import heptarm.doubles.seam.WrenchAbove;
import heptarm.doubles.seam.WrenchOutside;

/** A condition on the external force or torque at a frame. The simulated estimate is exact: tolerances have no effect. */
public abstract class WrenchCondition extends AbstractCondition {
    /** Component of a wrench with which its torques begin. */
    protected static final int TORQUES = 3;

    private final AbstractFrame measured;
    private final AbstractFrame orientation;

    protected WrenchCondition(AbstractFrame measured, AbstractFrame orientation) {
        this.measured = measured;
        this.orientation = orientation;
    }

    /** The magnitude of some components (forces along x y z, then torques about them) is above a threshold. */
    protected final Condition above(LBR robot, double threshold, int... components) {
        WrenchAbove condition = new WrenchAbove();
        condition.frame = frame(robot);
        for (int component : components) {
            condition.components |= 1 << component;
        }
        condition.threshold = threshold;
        return condition;
    }

    /** A component (forces along x y z, then torques about them) is outside a band. */
    protected final Condition outside(LBR robot, double[] band, int component) {
        WrenchOutside condition = new WrenchOutside();
        condition.frame = frame(robot);
        condition.component = component;
        condition.low = band[0];
        condition.high = band[1];
        return condition;
    }

    /** Measuring point and axes; without frames those of the flange. */
    private MeasuringFrame frame(LBR robot) {
        AbstractFrame point = measured == null ? robot.getFlange() : measured;
        AbstractFrame axes = orientation == null ? point : orientation;
        MeasuringFrame frame = new MeasuringFrame();
        frame.pointMoves = moves(point, robot);
        frame.point = Arrays.copyOf(seen(point, frame.pointMoves, robot), 3);
        frame.axesMove = moves(axes, robot);
        frame.axes = Arrays.copyOfRange(seen(axes, frame.axesMove, robot), 3, 7);
        return frame;
    }

    /** Whether a frame is fixed to the flange. */
    private static boolean moves(AbstractFrame frame, LBR robot) {
        for (AbstractFrame one = frame; one != null; one = one.getParent()) {
            if (one == robot.getFlange()) {
                return true;
            }
        }
        return false;
    }

    /** Pose seen from the flange if the frame is fixed to it, otherwise from the base. */
    private static double[] seen(AbstractFrame frame, boolean moves, LBR robot) {
        return MotionTranslator.pose((moves ? robot.getFlange() : robot.getRootFrame()).transformationTo(frame));
    }
}
