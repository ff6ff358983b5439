package heptarm.app;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.circ;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.lin;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.spl;

import java.util.List;

import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.PTP;
import com.kuka.roboticsAPI.motionModel.SplineJP;
import com.kuka.roboticsAPI.motionModel.SplineMotionCP;

import heptarm.core.CommandRejected;
import heptarm.wire.CartesianDynamics;
import heptarm.wire.CircSegment;
import heptarm.wire.JointDynamics;
import heptarm.wire.JointPoint;
import heptarm.wire.JointSpline;
import heptarm.wire.LinSegment;
import heptarm.wire.Orientation;
import heptarm.wire.Pose;
import heptarm.wire.SplSegment;
import heptarm.wire.Spline;
import heptarm.wire.SplineSegment;

/** Builds Sunrise splines from those of the protocol. */
final class SplineBuilder {
    private final LBR robot;

    SplineBuilder(LBR robot) {
        this.robot = robot;
    }

    static void check(Spline spline, String path) throws CommandRejected {
        for (int i = 0; i < spline.segments.length; i++) {
            MotionBuilder.checkOrientationReference(orientation(spline.segments[i]), path + "segments[" + i + "].");
        }
    }

    com.kuka.roboticsAPI.motionModel.Spline of(Spline spline, List<IMotion> listed) {
        SplineMotionCP<?>[] segments = new SplineMotionCP<?>[spline.segments.length];
        for (int i = 0; i < segments.length; i++) {
            segments[i] = of(spline.segments[i]);
            MotionBuilder.cartesian(segments[i], dynamics(spline.segments[i]));
            MotionBuilder.orientation(segments[i], orientation(spline.segments[i]));
            listed.add(segments[i]);
        }
        com.kuka.roboticsAPI.motionModel.Spline block = new com.kuka.roboticsAPI.motionModel.Spline(segments);
        MotionBuilder.joints(block, spline.joints);
        MotionBuilder.cartesian(block, spline.dynamics);
        return block;
    }

    private SplineMotionCP<?> of(SplineSegment segment) {
        if (segment instanceof SplSegment) {
            return spl(frame(((SplSegment) segment).target));
        }
        if (segment instanceof LinSegment) {
            return lin(frame(((LinSegment) segment).target));
        }
        return circ(frame(((CircSegment) segment).via), frame(((CircSegment) segment).end));
    }

    private Frame frame(Pose pose) {
        return new Frame(robot.getRootFrame(), Convert.transformation(pose));
    }

    private static CartesianDynamics dynamics(SplineSegment segment) {
        if (segment instanceof SplSegment) {
            return ((SplSegment) segment).dynamics;
        }
        return segment instanceof LinSegment ? ((LinSegment) segment).dynamics : ((CircSegment) segment).dynamics;
    }

    private static Orientation orientation(SplineSegment segment) {
        if (segment instanceof SplSegment) {
            return ((SplSegment) segment).orientation;
        }
        return segment instanceof LinSegment ? ((LinSegment) segment).orientation : ((CircSegment) segment).orientation;
    }

    static SplineJP of(JointSpline spline, List<IMotion> listed) {
        PTP[] points = new PTP[spline.points.length];
        for (int i = 0; i < points.length; i++) {
            JointPoint point = spline.points[i];
            points[i] = ptp(new JointPosition(point.q));
            MotionBuilder.joints(points[i], new JointDynamics(either(point.dynamics.velocity, spline.dynamics.velocity),
                    either(point.dynamics.acceleration, spline.dynamics.acceleration),
                    either(point.dynamics.jerk, spline.dynamics.jerk)));
            listed.add(points[i]);
        }
        SplineJP block = new SplineJP(points);
        MotionBuilder.joints(block, spline.dynamics);
        return block;
    }

    /** The point's values; where they are NaN, the spline's. */
    private static double[] either(double[] own, double[] whole) {
        double[] result = own.clone();
        for (int i = 0; i < result.length; i++) {
            result[i] = Double.isNaN(own[i]) ? whole[i] : own[i];
        }
        return result;
    }
}
