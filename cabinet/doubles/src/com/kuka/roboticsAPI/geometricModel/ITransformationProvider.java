package com.kuka.roboticsAPI.geometricModel;

import com.kuka.roboticsAPI.deviceModel.PoseInformation;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;

/** Where a frame is in its parent. */
public interface ITransformationProvider {
    boolean isStatic();

    PoseInformation getPoseInformation();

    ITransformation getTransformation();

    String getUniqueName();
}
