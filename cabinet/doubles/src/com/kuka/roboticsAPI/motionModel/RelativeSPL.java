package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;

import heptarm.doubles.motion.MotionTranslator;
import heptarm.doubles.runtime.NotModelled;
import heptarm.doubles.seam.PlantMotion;

/** Curved segment of a spline, relative to the end of the one before. */
public class RelativeSPL extends RelativeSplineMotionCP<RelativeSPL> {
    public RelativeSPL(ITransformation offset, AbstractFrame reference) {
        super(offset, reference);
    }

    @Override
    public PlantMotion describe(MotionTranslator to) {
        throw new NotModelled("splRel; compute the frame and use spl");
    }
}
