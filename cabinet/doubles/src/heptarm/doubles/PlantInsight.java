package heptarm.doubles;

import heptarm.core.Insight;
import heptarm.wire.SafetyBits;

/** Commanded torques, progress, brakes and fast stops, straight from the plant. */
public final class PlantInsight implements Insight {
    private final Ring ring = Station.current().ring;

    @Override
    public void readTorques(double[] commanded) {
        ring.read(Ring.TAU_CMD, commanded);
    }

    @Override
    public void readProgress(double[] progressAndRemaining) {
        ring.read(Ring.PROGRESS, progressAndRemaining);
    }

    @Override
    public int safetyBits() {
        return (ring.integer(Ring.FLAGS) & Ring.BRAKES_OPEN) != 0 ? SafetyBits.BRAKES_OPEN : 0;
    }

    @Override
    public void stopFast() {
        Station.current().plant.stopFast();
    }
}
