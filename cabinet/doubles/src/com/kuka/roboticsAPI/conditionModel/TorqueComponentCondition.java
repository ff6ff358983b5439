package com.kuka.roboticsAPI.conditionModel;

import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.math.CoordinateAxis;

import heptarm.doubles.Estimated;

/** A component of the external torque lies outside a band [Nm]. */
public class TorqueComponentCondition extends Estimated {
    private final CoordinateAxis axis;
    private final double[] band;

    public TorqueComponentCondition(AbstractFrame measured, CoordinateAxis axis, double low, double high) {
        this(measured, null, axis, low, high);
    }

    public TorqueComponentCondition(AbstractFrame measured, CoordinateAxis axis, double low, double high, double tolerance) {
        this(measured, null, axis, low, high, tolerance);
    }

    public TorqueComponentCondition(AbstractFrame measured, AbstractFrame orientation, CoordinateAxis axis, double low, double high) {
        super(measured, orientation);
        this.axis = axis;
        this.band = band(low, high);
    }

    public TorqueComponentCondition(AbstractFrame measured, AbstractFrame orientation, CoordinateAxis axis, double low, double high,
            double tolerance) {
        this(measured, orientation, axis, low, high);
        tolerance(tolerance);
    }

    /** Axis and band; for the simulation. */
    public double[] numbers() {
        return new double[] {axis.ordinal(), band[0], band[1]};
    }
}
