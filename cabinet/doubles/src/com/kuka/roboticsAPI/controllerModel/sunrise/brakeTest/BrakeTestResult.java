package com.kuka.roboticsAPI.controllerModel.sunrise.brakeTest;

/** The result of a brake test. */
public final class BrakeTestResult {
    private final int axis;
    private final BrakeState state;
    private final double torque;
    private final double most;

    /** Created by the simulation. */
    public BrakeTestResult(int axis, BrakeState state, double torque, double most) {
        this.axis = axis;
        this.state = state;
        this.torque = torque;
        this.most = most;
    }

    public BrakeState getState() {
        return state;
    }

    @Override
    public String toString() {
        return String.format("brake of A%d: %s at %.1f Nm, the axis exerts at most %.1f Nm", axis + 1, state, torque, most);
    }
}
