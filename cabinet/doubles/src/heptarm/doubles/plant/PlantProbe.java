package heptarm.doubles.plant;

import heptarm.core.robot.SimulatorProbe;
import heptarm.doubles.runtime.Station;
import heptarm.doubles.seam.SafetyFlags;
import heptarm.doubles.seam.StateWords;
import heptarm.wire.SafetyBits;

/** Provides commanded torques, progress, brake state and fast stops of the simulated robot, which a real cabinet does not offer. */
public final class PlantProbe implements SimulatorProbe {
    private final SharedState state = Station.current().sharedState;

    @Override
    public void readTorques(double[] commanded) {
        state.read(StateWords.TAU_CMD, commanded);
    }

    @Override
    public void readProgress(double[] progressAndRemaining) {
        progressAndRemaining[0] = state.number(StateWords.PROGRESS);
        progressAndRemaining[1] = state.number(StateWords.REMAINING);
    }

    @Override
    public int safetyBits() {
        return state.flag(SafetyFlags.BRAKES_OPEN) ? SafetyBits.BRAKES_OPEN : 0;
    }

    @Override
    public void stopFast() {
        Station.current().plant.stopFast();
    }
}
