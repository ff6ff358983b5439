package com.kuka.roboticsAPI.conditionModel;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.math.CoordinateAxis;

import heptarm.doubles.motion.WrenchCondition;
import heptarm.doubles.seam.Condition;

/** The magnitude of the external force, or of its part along or across an axis, is above a threshold [N]. */
public final class ForceCondition extends WrenchCondition {
    /** Which part of the force. */
    private enum Part { SPATIAL, NORMAL, SHEAR }

    private static final double ANY = Double.MAX_VALUE;

    private final Part part;
    private final CoordinateAxis axis;
    private final double threshold;

    private ForceCondition(Part part, AbstractFrame measured, AbstractFrame orientation, CoordinateAxis axis, double threshold,
            double tolerance) {
        super(measured, orientation);
        this.part = part;
        this.axis = axis;
        this.threshold = threshold(threshold);
        tolerance(tolerance);
    }

    public static ForceCondition createSpatialForceCondition(AbstractFrame measured, double threshold) {
        return createSpatialForceCondition(measured, null, threshold, ANY);
    }

    public static ForceCondition createSpatialForceCondition(AbstractFrame measured, double threshold, double tolerance) {
        return createSpatialForceCondition(measured, null, threshold, tolerance);
    }

    public static ForceCondition createSpatialForceCondition(AbstractFrame measured, AbstractFrame orientation, double threshold) {
        return createSpatialForceCondition(measured, orientation, threshold, ANY);
    }

    public static ForceCondition createSpatialForceCondition(AbstractFrame measured, AbstractFrame orientation, double threshold,
            double tolerance) {
        return new ForceCondition(Part.SPATIAL, measured, orientation, CoordinateAxis.X, threshold, tolerance);
    }

    public static ForceCondition createNormalForceCondition(AbstractFrame measured, CoordinateAxis axis, double threshold) {
        return createNormalForceCondition(measured, null, axis, threshold, ANY);
    }

    public static ForceCondition createNormalForceCondition(AbstractFrame measured, CoordinateAxis axis, double threshold,
            double tolerance) {
        return createNormalForceCondition(measured, null, axis, threshold, tolerance);
    }

    public static ForceCondition createNormalForceCondition(AbstractFrame measured, AbstractFrame orientation, CoordinateAxis axis,
            double threshold) {
        return createNormalForceCondition(measured, orientation, axis, threshold, ANY);
    }

    public static ForceCondition createNormalForceCondition(AbstractFrame measured, AbstractFrame orientation, CoordinateAxis axis,
            double threshold, double tolerance) {
        return new ForceCondition(Part.NORMAL, measured, orientation, axis, threshold, tolerance);
    }

    public static ForceCondition createShearForceCondition(AbstractFrame measured, CoordinateAxis axis, double threshold) {
        return createShearForceCondition(measured, null, axis, threshold, ANY);
    }

    public static ForceCondition createShearForceCondition(AbstractFrame measured, CoordinateAxis axis, double threshold,
            double tolerance) {
        return createShearForceCondition(measured, null, axis, threshold, tolerance);
    }

    public static ForceCondition createShearForceCondition(AbstractFrame measured, AbstractFrame orientation, CoordinateAxis axis,
            double threshold) {
        return createShearForceCondition(measured, orientation, axis, threshold, ANY);
    }

    public static ForceCondition createShearForceCondition(AbstractFrame measured, AbstractFrame orientation, CoordinateAxis axis,
            double threshold, double tolerance) {
        return new ForceCondition(Part.SHEAR, measured, orientation, axis, threshold, tolerance);
    }

    public double getThreshold() {
        return threshold;
    }

    @Override
    protected Condition forPlant(LBR robot) {
        int along = axis.ordinal();
        switch (part) {
            case NORMAL:
                return above(robot, threshold, along);
            case SHEAR:
                return above(robot, threshold, (along + 1) % 3, (along + 2) % 3);
            default:
                return above(robot, threshold, 0, 1, 2);
        }
    }
}
