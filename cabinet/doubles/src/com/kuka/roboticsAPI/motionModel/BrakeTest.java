package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.controllerModel.sunrise.brakeTest.BrakeState;
import com.kuka.roboticsAPI.controllerModel.sunrise.brakeTest.BrakeTestResult;

import heptarm.doubles.motion.MotionContainer;
import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.runtime.Station;
import heptarm.doubles.seam.Hold;
import heptarm.doubles.seam.PlantMotion;

/** Loads the brake of an axis, from 0, with a torque [Nm]. The simulated arm rests; its brakes hold the axis' maximum torque. */
public class BrakeTest extends RobotMotion<BrakeTest> {
    private static final double SECONDS = 1.0;

    private final int axis;
    private final double torque;

    public BrakeTest(int axis, double torque) {
        if (axis < 0 || axis > 6) {
            throw new IllegalArgumentException("axis must be 0 to 6, got " + axis);
        }
        this.axis = axis;
        this.torque = notNegative("torque", torque);
    }

    /** Result of the finished test. */
    public static BrakeTestResult evaluateResult(IMotionContainer container) {
        IMotion motion = ((MotionContainer) container).getLastExecutedMotion();
        if (!(motion instanceof BrakeTest)) {
            throw new IllegalArgumentException("the motion must be a brake test, got " + container.getCommand());
        }
        BrakeTest test = (BrakeTest) motion;
        double most = Station.current().description.tauMax[test.axis];
        boolean ended = container.isFinished() && container.getErrorMessage() == null;
        BrakeState state = !ended ? BrakeState.NotTested : test.torque <= most ? BrakeState.Holds : BrakeState.Slips;
        return new BrakeTestResult(test.axis, state, test.torque, most);
    }

    @Override
    public PlantMotion describe(MotionTranslator to) {
        Hold motion = new Hold();
        motion.duration = SECONDS;
        return motion;
    }
}
