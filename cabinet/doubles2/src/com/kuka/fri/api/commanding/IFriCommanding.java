package com.kuka.fri.api.commanding;

import com.kuka.fri.api.monitoring.IFriSession;

/** Commanding by FRI. */
public interface IFriCommanding {
    IFriJointOverlay createJointOverlay(IFriSession session, EClientCommandMode mode);
}
