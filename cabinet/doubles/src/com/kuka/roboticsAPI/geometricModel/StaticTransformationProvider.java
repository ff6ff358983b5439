package com.kuka.roboticsAPI.geometricModel;

import com.kuka.roboticsAPI.deviceModel.PoseInformation;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

/** A place that does not change. */
public class StaticTransformationProvider implements ITransformationProvider {
    private final Transformation transformation;

    public StaticTransformationProvider(ITransformation transformation) {
        this.transformation = Transformation.of(transformation);
    }

    @Override
    public boolean isStatic() {
        return true;
    }

    /** None: the place was not measured. */
    @Override
    public PoseInformation getPoseInformation() {
        return null;
    }

    @Override
    public Transformation getTransformation() {
        return transformation;
    }

    @Override
    public String getUniqueName() {
        return "static " + transformation;
    }
}
