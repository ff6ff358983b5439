package heptarm.doubles;

import com.kuka.roboticsAPI.controllerModel.sunrise.ISunriseRequestService;
import com.kuka.roboticsAPI.controllerModel.sunrise.api.SSR;
import com.kuka.roboticsAPI.controllerModel.sunrise.connectionLib.Message;

/** Answers the command that torque referencing sends at each of its poses; other commands fail. */
public final class Referencing implements ISunriseRequestService {
    private static final int MEASURE = 2;
    private static final int DONE = 1;
    private static final int FAILED = 0;

    private final Station station;

    public Referencing(Station station) {
        this.station = station;
    }

    /** A measurement needs an arm that rests. */
    @Override
    public Message sendSynchronousSSR(SSR request) {
        boolean moving = (station.ring.integer(Ring.FLAGS) & Ring.MOVING) != 0;
        return new Message(request.safetyCommand() == MEASURE && !moving ? DONE : FAILED);
    }
}
