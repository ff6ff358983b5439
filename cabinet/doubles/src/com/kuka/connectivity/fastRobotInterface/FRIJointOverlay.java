package com.kuka.connectivity.fastRobotInterface;

import com.kuka.roboticsAPI.motionModel.IMotionOverlay;

/** Superimposes the commands of an FRI client on a motion. */
public class FRIJointOverlay implements IMotionOverlay {
    private final FRISession session;
    private final ClientCommandMode mode;

    public FRIJointOverlay(FRISession session) {
        this(session, ClientCommandMode.POSITION);
    }

    public FRIJointOverlay(FRISession session, ClientCommandMode mode) {
        this.session = session;
        this.mode = mode;
    }

    /** Session and mode; for the simulation. */
    public FRISession session() {
        return session;
    }

    /** Quantity that the client commands; for the simulation. */
    public ClientCommandMode mode() {
        return mode;
    }
}
