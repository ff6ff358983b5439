package heptarm.core.state;

import java.util.Arrays;

import heptarm.core.CommandRejected;
import heptarm.core.robot.SignalPort;
import heptarm.wire.Code;
import heptarm.wire.IoDirection;
import heptarm.wire.IoState;
import heptarm.wire.IoType;
import heptarm.wire.SetSignal;
import heptarm.wire.SetSignals;
import heptarm.wire.SignalInfo;
import heptarm.wire.SignalValue;

/** Signals of the cabinet's IO groups: finds them by name, writes all or none, reads a few at a time. */
public final class SignalTable {
    /** Signals to read between checks of the time: on a cabinet each one takes about 2 ms. */
    private static final int SLICE = 2;
    private static final long PATIENCE_NS = 300000L;

    private final SignalPort port;
    private final SignalInfo[] known;
    private final double[] values;
    private final long[] times;
    private int next;
    private volatile boolean all = true;

    public SignalTable(SignalPort port) {
        this.port = port;
        this.known = port.signals();
        this.values = new double[known.length];
        this.times = new long[known.length];
    }

    /** Index of a signal in a list. */
    public static int index(String name, SignalInfo[] signals, String parameter) throws CommandRejected {
        for (int i = 0; i < signals.length; i++) {
            if (signals[i].name.equals(name)) {
                return i;
            }
        }
        throw new CommandRejected(Code.UNKNOWN_NAME, parameter, name, names(signals),
                "unknown signal " + name + "; known signals: " + names(signals) + " (process data heptarm.io)");
    }

    private static String names(SignalInfo[] signals) {
        StringBuilder text = new StringBuilder();
        for (SignalInfo one : signals) {
            text.append(text.length() == 0 ? "" : ", ").append(one.name);
        }
        return text.length() == 0 ? "none" : text.toString();
    }

    /** Writes outputs after checking all of them. */
    public void write(SetSignals request) throws CommandRejected {
        int[] places = new int[request.values.length];
        double[] targets = new double[places.length];
        for (int i = 0; i < places.length; i++) {
            places[i] = check(request.values[i], "values[" + i + "]");
            targets[i] = request.values[i].value;
        }
        port.write(places, targets);
    }

    /** Writes one output after checking it. */
    public void write(SetSignal request) throws CommandRejected {
        port.write(new int[] {check(request, "")}, new double[] {request.value});
    }

    /** Index of an output, after checking that it may take the value. */
    public int check(SetSignal one, String path) throws CommandRejected {
        int place = index(one.signal, known, path + ".signal");
        SignalInfo info = known[place];
        if (info.direction != IoDirection.OUTPUT) {
            throw new CommandRejected(Code.UNSUPPORTED, path + ".signal", info.name, "an output",
                    info.name + " is an input of the cabinet; write an output instead");
        }
        boolean whole = info.type == IoType.ANALOG || one.value == Math.rint(one.value);
        if (!(one.value >= info.low && one.value <= info.high) || !whole) {
            String allowed = info.type == IoType.BOOLEAN ? "0 (false) or 1 (true)"
                    : (info.type == IoType.ANALOG ? "" : "a whole number in ") + "[" + info.low + ", " + info.high + "]";
            throw new CommandRejected(Code.OUT_OF_RANGE, path + ".value", Double.toString(one.value), allowed,
                    info.name + " must be " + allowed + ", got " + one.value);
        }
        return place;
    }

    /** A new subscriber gets no value from before its subscription: the next reading is one of all signals. */
    void readAllNext() {
        all = true;
    }

    /**
     * Reads some of the signals; all of them when that is quick, and for a new subscriber. The stamp is that of the oldest
     * value. One thread.
     */
    IoState read(long now) {
        boolean isWhole = all;
        all = false;
        next = isWhole ? 0 : next;
        long started = System.nanoTime();
        do {
            int count = Math.min(SLICE, known.length - next);
            port.read(values, next, count);
            Arrays.fill(times, next, next + count, now);
            next = next + count < known.length ? next + count : 0;
        } while (next != 0 && (isWhole || System.nanoTime() - started < PATIENCE_NS));
        long oldest = now;
        SignalValue[] result = new SignalValue[known.length];
        for (int i = 0; i < result.length; i++) {
            result[i] = new SignalValue(i, values[i]);
            oldest = Math.min(oldest, times[i]);
        }
        return new IoState(oldest, result);
    }
}
