package com.kuka.roboticsAPI.motionModel.controlModeModel;

import java.util.Arrays;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

import heptarm.doubles.seam.ImpedanceMode;
import heptarm.doubles.seam.JointImpedance;

/** A spring [Nm/rad] and a damper (damping ratio) in every joint. */
public class JointImpedanceControlMode extends AbstractMotionControlMode {
    private static final double STIFFNESS = 1000.0;
    private static final double DAMPING = 0.7;

    private final double[] stiffness;
    private final double[] damping;

    public JointImpedanceControlMode(int jointCount) {
        stiffness = new double[jointCount];
        damping = new double[jointCount];
        Arrays.fill(stiffness, STIFFNESS);
        Arrays.fill(damping, DAMPING);
    }

    public JointImpedanceControlMode(double... stiffness) {
        this(stiffness.length);
        setStiffness(stiffness);
    }

    public JointImpedanceControlMode(JointImpedanceControlMode other) {
        stiffness = other.stiffness.clone();
        damping = other.damping.clone();
    }

    private void set(double[] into, String name, double high, double[] values) {
        if (values.length != into.length) {
            throw new IllegalArgumentException(name + " must have " + into.length + " values, got " + values.length);
        }
        for (double value : values) {
            if (!(value >= 0.0 && value <= high)) {
                throw new IllegalArgumentException(name + " must be in [0, " + high + "], got " + value);
            }
        }
        System.arraycopy(values, 0, into, 0, into.length);
    }

    private double[] all(double value) {
        double[] values = new double[stiffness.length];
        Arrays.fill(values, value);
        return values;
    }

    public JointImpedanceControlMode setStiffness(double... values) {
        set(stiffness, "stiffness", Double.MAX_VALUE, values);
        return this;
    }

    public JointImpedanceControlMode setStiffnessForAllJoints(double value) {
        return setStiffness(all(value));
    }

    public JointImpedanceControlMode setDamping(double... values) {
        set(damping, "damping", 1.0, values);
        return this;
    }

    public JointImpedanceControlMode setDampingForAllJoints(double value) {
        return setDamping(all(value));
    }

    public double[] getStiffness() {
        return stiffness.clone();
    }

    public double[] getDamping() {
        return damping.clone();
    }

    @Override
    public ImpedanceMode forPlant(ObjectFrame motionFrame, LBR robot) {
        JointImpedance joints = new JointImpedance();
        joints.stiffness = stiffness.clone();
        joints.damping = damping.clone();
        return joints;
    }

    @Override
    public String toString() {
        return "JointImpedanceControlMode, stiffness " + Arrays.toString(stiffness) + ", damping " + Arrays.toString(damping);
    }
}
