package com.kuka.roboticsAPI.motionModel;

import java.util.concurrent.TimeUnit;

import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.motionModel.controlModeModel.IMotionControlMode;

/** Creates motions. */
public final class BasicMotions {
    private BasicMotions() {
    }

    public static PTP ptp(double... radians) {
        return new PTP(new JointPosition(radians));
    }

    public static PTP ptp(JointPosition position) {
        return new PTP(position);
    }

    public static CartesianPTP ptp(AbstractFrame frame) {
        return new CartesianPTP(frame);
    }

    /** To the robot's home position. */
    public static PTPHome ptpHome() {
        return new PTPHome();
    }

    public static LIN lin(AbstractFrame frame) {
        return new LIN(frame);
    }

    public static CIRC circ(AbstractFrame auxiliary, AbstractFrame destination) {
        return new CIRC(auxiliary, destination);
    }

    public static SPL spl(AbstractFrame frame) {
        return new SPL(frame);
    }

    public static MotionBatch batch(RobotMotion<?>... motions) {
        return new MotionBatch(motions);
    }

    /** An offset of zero; its setters change it. */
    public static RelativeLIN linRel() {
        return linRel(Transformation.IDENTITY);
    }

    /** Not simulated; applications that name it compile. */
    public static RelativeSPL splRel(ITransformation offset) {
        return new RelativeSPL(offset, null);
    }

    /** See {@link #splRel(ITransformation)}. */
    public static RelativeSPL splRel(ITransformation offset, AbstractFrame reference) {
        return new RelativeSPL(offset, reference);
    }

    public static RelativeLIN linRel(double x, double y, double z) {
        return linRel(Transformation.ofTranslation(x, y, z));
    }

    public static RelativeLIN linRel(double x, double y, double z, AbstractFrame reference) {
        return linRel(Transformation.ofTranslation(x, y, z), reference);
    }

    public static RelativeLIN linRel(double x, double y, double z, double a, double b, double c) {
        return linRel(Transformation.ofRad(x, y, z, a, b, c));
    }

    public static RelativeLIN linRel(double x, double y, double z, double a, double b, double c, AbstractFrame reference) {
        return linRel(Transformation.ofRad(x, y, z, a, b, c), reference);
    }

    public static RelativeLIN linRel(ITransformation offset) {
        return new RelativeLIN(offset, null);
    }

    public static RelativeLIN linRel(ITransformation offset, AbstractFrame reference) {
        return new RelativeLIN(offset, reference);
    }

    public static PositionHold positionHold(IMotionControlMode mode, long duration, TimeUnit unit) {
        return new PositionHold(mode, duration, unit);
    }
}
