package com.kuka.connectivity.fastRobotInterface;

/** State and quality of an FRI session at one time. */
public class FRIChannelInformation {
    /** State of the session. */
    public enum FRISessionState { IDLE, MONITORING_WAIT, MONITORING_READY, COMMANDING_WAIT, COMMANDING_ACTIVE }

    /** Quality of the connection. */
    public enum FRIConnectionQuality { POOR, FAIR, GOOD, EXCELLENT }

    private final FRISessionState state;
    private final FRIConnectionQuality quality;
    private final double latency;
    private final double jitter;

    public FRIChannelInformation(FRISessionState state, FRIConnectionQuality quality, double latency, double jitter) {
        this.state = state;
        this.quality = quality;
        this.latency = latency;
        this.jitter = jitter;
    }

    public FRISessionState getFRISessionState() {
        return state;
    }

    public FRIConnectionQuality getQuality() {
        return quality;
    }

    /** Mean latency of the answers [ms]. */
    public double getLatency() {
        return latency;
    }

    /** Jitter: mean change of the latency from one answer to the next [ms]. */
    public double getJitter() {
        return jitter;
    }

    @Override
    public String toString() {
        return state + ", quality " + quality + ", latency " + latency + " ms, jitter " + jitter + " ms";
    }
}
