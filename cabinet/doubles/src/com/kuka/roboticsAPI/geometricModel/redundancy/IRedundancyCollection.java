package com.kuka.roboticsAPI.geometricModel.redundancy;

import com.kuka.common.params.IParameterSet;

/** What a pose leaves open of a robot's joints. */
public interface IRedundancyCollection {
    /** Status and turn, then E1 where there is one. */
    IParameterSet getAllParameters();

    IRedundancyCollection copy();
}
