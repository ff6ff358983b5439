package com.kuka.fri.api.monitoring;

import com.kuka.sensitivity.LBR;

/** Monitoring by FRI. */
public interface IFriMonitoring {
    IFriConfiguration createFriConfiguration(LBR robot, String host);

    IFriSession createFriSession(IFriConfiguration configuration);
}
