package com.kuka.geometry;

import com.kuka.math.geometry.Transformation;
import com.kuka.motion.IMotion;
import com.kuka.motion.IMotionContainer;

import heptarm.doubles2.Behind;
import heptarm.doubles2.Container;

/** A frame of the robot. */
public class ObjectFrame implements Frame {
    public final heptarm.sunrise1.roboticsAPI.geometricModel.ObjectFrame behind;

    public ObjectFrame(heptarm.sunrise1.roboticsAPI.geometricModel.ObjectFrame behind) {
        this.behind = behind;
    }

    @Override
    public Transformation getTransformationFromParent() {
        return Behind.transformation(behind.getTransformationFromParent());
    }

    public IMotionContainer moveAsync(IMotion motion) {
        return Container.of(behind.moveAsync(motion.behind()));
    }
}
