package heptarm.doubles.runtime;

import com.kuka.roboticsAPI.controllerModel.sunrise.ISunriseRequestService;
import com.kuka.roboticsAPI.controllerModel.sunrise.api.SSR;
import com.kuka.roboticsAPI.controllerModel.sunrise.connectionLib.Message;

import heptarm.doubles.seam.SafetyFlags;

/** Answers the command that torque referencing sends at each of its poses; other commands fail. */
public final class TorqueReferencing implements ISunriseRequestService {
    private static final int MEASURE = 2;
    private static final int DONE = 1;
    private static final int FAILED = 0;

    private final Station station;

    public TorqueReferencing(Station station) {
        this.station = station;
    }

    /** Answers; a measurement succeeds only while the arm is at rest. */
    @Override
    public Message sendSynchronousSSR(SSR request) {
        boolean moving = station.sharedState.flag(SafetyFlags.MOVING);
        return new Message(request.safetyCommand() == MEASURE && !moving ? DONE : FAILED);
    }
}
