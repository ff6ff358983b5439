package com.kuka.fri;

import com.kuka.fri.common.ClientCommandMode;

import heptarm.doubles2.IMotionOverlay;

/** An overlay of joint positions. */
public final class FRIJointOverlay implements IMotionOverlay {
    private final FRISession session;

    public FRIJointOverlay(FRISession session, ClientCommandMode mode) {
        this.session = session;
    }

    @Override
    public heptarm.sunrise1.roboticsAPI.motionModel.IMotionOverlay behind() {
        return new heptarm.sunrise1.connectivity.fastRobotInterface.FRIJointOverlay(session.behind);
    }
}
