package com.kuka.roboticsAPI.geometricModel.redundancy;

import com.kuka.common.params.IParameterSet;

/** Redundancy of a robot at a pose. */
public interface IRedundancyCollection {
    /** Status and turn, then E1 where there is one. */
    IParameterSet getAllParameters();

    IRedundancyCollection copy();
}
