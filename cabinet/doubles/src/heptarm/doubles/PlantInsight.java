package heptarm.doubles;

import heptarm.core.Insight;

/** Commanded torques and progress, straight from the plant. */
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
}
