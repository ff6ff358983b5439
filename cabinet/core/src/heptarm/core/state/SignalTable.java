package heptarm.core;

import heptarm.wire.Code;
import heptarm.wire.IoDirection;
import heptarm.wire.IoState;
import heptarm.wire.IoType;
import heptarm.wire.SetSignal;
import heptarm.wire.SetSignals;
import heptarm.wire.SignalInfo;
import heptarm.wire.SignalValue;

/** Signals of the cabinet's IO groups: found by name, written all or none, read a few at a time. */
final class Signals {
    /** So many are read before looking at the time: on a cabinet each one takes some 2 ms. */
    private static final int SLICE = 2;
    private static final long PATIENCE_NS = 300000L;

    private final Robot robot;
    private final SignalInfo[] known;
    private final double[] values;
    private int next;
    private boolean complete;
    private long began;

    Signals(Robot robot) {
        this.robot = robot;
        this.known = robot.signals();
        this.values = new double[known.length];
    }

    /** Place of a signal in the robot's list. */
    static int of(String name, SignalInfo[] signals, String parameter) throws Refusal {
        for (int i = 0; i < signals.length; i++) {
            if (signals[i].name.equals(name)) {
                return i;
            }
        }
        throw new Refusal(Code.UNKNOWN_NAME, parameter, name, names(signals), "no signal " + name);
    }

    private static String names(SignalInfo[] signals) {
        StringBuilder text = new StringBuilder();
        for (SignalInfo one : signals) {
            text.append(text.length() == 0 ? "" : ", ").append(one.name);
        }
        return text.length() == 0 ? "this cabinet has none (process data heptarm.io)" : text.toString();
    }

    /** Writes outputs that a client wants, if all of them can be what they shall be. */
    void write(SetSignals wish) throws Refusal {
        int[] places = new int[wish.values.length];
        double[] wanted = new double[places.length];
        for (int i = 0; i < places.length; i++) {
            places[i] = check(wish.values[i], "values[" + i + "]");
            wanted[i] = wish.values[i].value;
        }
        robot.writeSignals(places, wanted);
    }

    /** Writes one output. */
    void write(SetSignal wish) throws Refusal {
        robot.writeSignals(new int[] {check(wish, "")}, new double[] {wish.value});
    }

    /** Place of an output that may have a value. */
    int check(SetSignal one, String path) throws Refusal {
        int place = of(one.signal, known, path + ".signal");
        SignalInfo info = known[place];
        if (info.direction != IoDirection.OUTPUT) {
            throw new Refusal(Code.UNSUPPORTED, path + ".signal", info.name, "an output",
                    info.name + " is an input of the cabinet; only outputs can be written");
        }
        boolean whole = info.type == IoType.ANALOG || one.value == Math.rint(one.value);
        if (!(one.value >= info.low && one.value <= info.high) || !whole) {
            String allowed = info.type == IoType.BOOLEAN ? "0 (false) or 1 (true)"
                    : (info.type == IoType.ANALOG ? "" : "a whole number in ") + "[" + info.low + ", " + info.high + "]";
            throw new Refusal(Code.OUT_OF_RANGE, path + ".value", Double.toString(one.value), allowed,
                    info.name + " cannot be " + one.value);
        }
        return place;
    }

    /** Reads some of them, all the first time and where that is quick; by the sampler. The stamp is that of the oldest value. */
    IoState read(long now) {
        long started = System.nanoTime();
        do {
            if (next == 0) {
                began = now;
            }
            int count = Math.min(SLICE, known.length - next);
            robot.readSignals(values, next, count);
            next += count;
            if (next >= known.length) {
                next = 0;
                complete = true;
            }
        } while (!complete || next != 0 && System.nanoTime() - started < PATIENCE_NS);
        SignalValue[] told = new SignalValue[known.length];
        for (int i = 0; i < told.length; i++) {
            told[i] = new SignalValue(i, values[i]);
        }
        return new IoState(began, told);
    }
}
