package com.kuka.connectivity.motionModel.smartServoLIN;

import com.kuka.connectivity.motionModel.smartServo.IServoRuntime;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;

import heptarm.doubles.runtime.NotModelled;

/** A running SmartServoLIN. */
public interface ISmartServoLINRuntime extends IServoRuntime {
    long setDestination(AbstractFrame destination);

    Frame getCurrentCartesianPosition(ObjectFrame frame);

    /** Not simulated: the limits of a running motion stay. */
    default void setMaxTranslationVelocity(double[] millimetresPerSecond) {
        throw new NotModelled("limits of a running SmartServoLIN; set them before the motion starts");
    }

    /** See {@link #setMaxTranslationVelocity}. */
    default void setMaxOrientationVelocity(double[] radiansPerSecond) {
        setMaxTranslationVelocity(radiansPerSecond);
    }
}
