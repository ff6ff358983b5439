package com.kuka.roboticsAPI.conditionModel;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.math.CoordinateAxis;

import heptarm.doubles.motion.WrenchCondition;
import heptarm.doubles.seam.Condition;

/** A component of the external force is outside a band [N]. */
public class ForceComponentCondition extends WrenchCondition {
    private final CoordinateAxis axis;
    private final double[] band;

    public ForceComponentCondition(AbstractFrame measured, CoordinateAxis axis, double low, double high) {
        this(measured, null, axis, low, high);
    }

    public ForceComponentCondition(AbstractFrame measured, CoordinateAxis axis, double low, double high, double tolerance) {
        this(measured, null, axis, low, high, tolerance);
    }

    public ForceComponentCondition(AbstractFrame measured, AbstractFrame orientation, CoordinateAxis axis, double low, double high) {
        super(measured, orientation);
        this.axis = axis;
        this.band = band(low, high);
    }

    public ForceComponentCondition(AbstractFrame measured, AbstractFrame orientation, CoordinateAxis axis, double low, double high,
            double tolerance) {
        this(measured, orientation, axis, low, high);
        tolerance(tolerance);
    }

    @Override
    protected Condition forPlant(LBR robot) {
        return outside(robot, band, axis.ordinal());
    }
}
