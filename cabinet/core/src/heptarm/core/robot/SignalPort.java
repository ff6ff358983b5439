package heptarm.core.robot;

import heptarm.core.CommandRejected;
import heptarm.wire.SignalInfo;

/** Signals of the cabinet's IO groups; an index refers to {@link #signals}. */
public interface SignalPort {
    SignalInfo[] signals();

    /** Read {@code count} signals into their places in {@code values}. */
    void read(double[] values, int from, int count);

    /** Write outputs whose values have been checked. */
    void write(int[] places, double[] values) throws CommandRejected;
}
