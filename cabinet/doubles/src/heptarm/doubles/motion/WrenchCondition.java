package heptarm.doubles.motion;

import java.util.Arrays;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.math.CoordinateAxis;

import heptarm.doubles.seam.Axis;
import heptarm.doubles.seam.MeasuringFrame;

/** A condition on the external force or torque at a frame. The simulated estimate is exact: tolerances have no effect. */
public abstract class WrenchCondition extends AbstractCondition {
    private final AbstractFrame measured;
    private final AbstractFrame orientation;

    protected WrenchCondition(AbstractFrame measured, AbstractFrame orientation) {
        this.measured = measured;
        this.orientation = orientation;
    }

    /** Measuring point and axes; without frames those of the flange. */
    protected final MeasuringFrame frame(LBR robot) {
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

    /** An axis in the plant's terms. */
    protected static Axis axis(CoordinateAxis axis) {
        return Axis.valueOf(axis.name());
    }
}
