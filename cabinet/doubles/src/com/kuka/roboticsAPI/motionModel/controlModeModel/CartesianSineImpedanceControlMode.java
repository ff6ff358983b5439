package com.kuka.roboticsAPI.motionModel.controlModeModel;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.CartDOF;
import com.kuka.roboticsAPI.geometricModel.CartPlane;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

import heptarm.doubles.motion.ControlModeTranslator;
import heptarm.doubles.seam.ImpedanceMode;
import heptarm.doubles.seam.SineImpedance;

/** Cartesian impedance with an overlaid force: in each direction a constant and a sine, with rise and fall times. */
public class CartesianSineImpedanceControlMode extends CartesianImpedanceControlMode {
    private static final double FASTEST = 15.0;
    private static final double LISSAJOUS_RATIO = 0.4;

    private final double[] amplitude = new double[DIRECTIONS];
    private final double[] frequency = new double[DIRECTIONS];
    private final double[] phaseDeg = new double[DIRECTIONS];
    private final double[] bias = new double[DIRECTIONS];
    private final double[] forceLimit = filled(OFF);
    private final double[] positionLimit = filled(OFF);
    private double totalTime = Double.NaN;
    private double riseTime;
    private double holdTime = Double.NaN;
    private double fallTime;
    private boolean stayActive;

    public CartesianSineImpedanceControlMode() {
    }

    public CartesianSineImpedanceControlMode(CartesianSineImpedanceControlMode other) {
        super(other);
        double[][] from = {other.amplitude, other.frequency, other.phaseDeg, other.bias, other.forceLimit, other.positionLimit};
        double[][] into = {amplitude, frequency, phaseDeg, bias, forceLimit, positionLimit};
        for (int i = 0; i < from.length; i++) {
            System.arraycopy(from[i], 0, into[i], 0, DIRECTIONS);
        }
        totalTime = other.totalTime;
        riseTime = other.riseTime;
        holdTime = other.holdTime;
        fallTime = other.fallTime;
        stayActive = other.stayActive;
    }

    /** Selects the directions whose parameters are set. */
    public static class CartSineImpBuilder extends CartImpBuilder {
        private final CartesianSineImpedanceControlMode mode;

        CartSineImpBuilder(CartesianSineImpedanceControlMode mode, CartDOF... directions) {
            super(mode, directions);
            this.mode = mode;
        }

        @Override
        public CartSineImpBuilder setStiffness(double value) {
            super.setStiffness(value);
            return this;
        }

        @Override
        public CartSineImpBuilder setDamping(double value) {
            super.setDamping(value);
            return this;
        }

        @Override
        public CartSineImpBuilder setAdditionalControlForce(double value) {
            super.setAdditionalControlForce(value);
            return this;
        }

        private CartSineImpBuilder put(double[] into, double value) {
            fill(into, value);
            return this;
        }

        public CartSineImpBuilder setAmplitude(double value) {
            return put(mode.amplitude, notNegative("amplitude", value));
        }

        public CartSineImpBuilder setFrequency(double hertz) {
            return put(mode.frequency, within("frequency", hertz, 0.0, FASTEST));
        }

        public CartSineImpBuilder setPhaseDeg(double degrees) {
            return put(mode.phaseDeg, notNegative("phase", degrees));
        }

        public CartSineImpBuilder setBias(double value) {
            return put(mode.bias, finite("bias", value));
        }

        public CartSineImpBuilder setForceLimit(double value) {
            return put(mode.forceLimit, notNegative("forceLimit", value));
        }

        public CartSineImpBuilder setPositionLimit(double value) {
            return put(mode.positionLimit, notNegative("positionLimit", value));
        }
    }

    @Override
    public CartSineImpBuilder parametrize(CartDOF... directions) {
        return new CartSineImpBuilder(this, directions);
    }

    // ------------------------------------------------------------------------------ patterns

    public static CartesianSineImpedanceControlMode createDesiredForce(CartDOF direction, double force, double stiffness) {
        CartesianSineImpedanceControlMode mode = new CartesianSineImpedanceControlMode();
        mode.parametrize(direction).setBias(force).setStiffness(stiffness);
        return mode;
    }

    public static CartesianSineImpedanceControlMode createSinePattern(CartDOF direction, double frequency, double amplitude,
            double stiffness) {
        CartesianSineImpedanceControlMode mode = new CartesianSineImpedanceControlMode();
        mode.parametrize(direction).setFrequency(frequency).setAmplitude(amplitude).setStiffness(stiffness);
        return mode;
    }

    public static CartesianSineImpedanceControlMode createLissajousPattern(CartPlane plane, double frequency, double amplitude,
            double stiffness) {
        CartesianSineImpedanceControlMode mode = new CartesianSineImpedanceControlMode();
        mode.parametrize(first(plane)).setFrequency(frequency).setAmplitude(amplitude).setStiffness(stiffness);
        mode.parametrize(second(plane)).setFrequency(LISSAJOUS_RATIO * frequency).setAmplitude(amplitude).setPhaseDeg(90)
                .setStiffness(stiffness);
        return mode;
    }

    /** Outwards for half of the time, then inwards. */
    public static CartesianSineImpedanceControlMode createSpiralPattern(CartPlane plane, double frequency, double amplitude,
            double stiffness, double totalTime) {
        CartesianSineImpedanceControlMode mode = new CartesianSineImpedanceControlMode();
        mode.parametrize(first(plane), second(plane)).setFrequency(frequency).setAmplitude(amplitude).setStiffness(stiffness);
        mode.parametrize(first(plane)).setPhaseDeg(90);
        mode.setTotalTime(totalTime).setRiseTime(0.5 * totalTime).setFallTime(0.5 * totalTime);
        return mode;
    }

    private static CartDOF first(CartPlane plane) {
        return plane == CartPlane.YZ ? CartDOF.Y : CartDOF.X;
    }

    private static CartDOF second(CartPlane plane) {
        return plane == CartPlane.XY ? CartDOF.Y : CartDOF.Z;
    }

    // ------------------------------------------------------------------------------ times

    /** The force ends after this time at the latest [s]. */
    public CartesianSineImpedanceControlMode setTotalTime(double seconds) {
        totalTime = notNegative("totalTime", seconds);
        return this;
    }

    public CartesianSineImpedanceControlMode setRiseTime(double seconds) {
        riseTime = notNegative("riseTime", seconds);
        return this;
    }

    public CartesianSineImpedanceControlMode setHoldTime(double seconds) {
        holdTime = notNegative("holdTime", seconds);
        return this;
    }

    public CartesianSineImpedanceControlMode setFallTime(double seconds) {
        fallTime = notNegative("fallTime", seconds);
        return this;
    }

    public double getRiseTime() {
        return riseTime;
    }

    /** NaN: for ever. */
    public double getHoldTime() {
        return holdTime;
    }

    public double getFallTime() {
        return fallTime;
    }

    /** The motion does not end before the pattern. */
    public CartesianSineImpedanceControlMode setStayActiveUntilPatternFinished(boolean stay) {
        stayActive = stay;
        return this;
    }

    @Override
    public ImpedanceMode forPlant(ObjectFrame motionFrame, LBR robot) {
        SineImpedance pattern = new SineImpedance();
        pattern.base = spring(motionFrame, robot);
        pattern.amplitude = ControlModeTranslator.directions(amplitude);
        pattern.frequency = ControlModeTranslator.directions(frequency);
        double[] phase = new double[DIRECTIONS];
        for (int i = 0; i < DIRECTIONS; i++) {
            phase[i] = Math.toRadians(phaseDeg[i] % 360.0);
        }
        pattern.phase = ControlModeTranslator.directions(phase);
        pattern.bias = ControlModeTranslator.directions(bias);
        pattern.forceLimit = ControlModeTranslator.forceLimits(forceLimit);
        pattern.positionLimit = ControlModeTranslator.motionLimits(positionLimit);
        pattern.totalTime = totalTime;
        pattern.riseTime = riseTime;
        pattern.holdTime = holdTime;
        pattern.fallTime = fallTime;
        pattern.stayActive = stayActive;
        return pattern;
    }
}
