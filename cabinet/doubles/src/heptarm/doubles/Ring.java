package heptarm.doubles;

import java.lang.invoke.MethodHandles;
import java.lang.invoke.VarHandle;
import java.nio.ByteBuffer;
import java.nio.ByteOrder;

/**
 * Reads the plant's last states from memory shared with Python; the layout is that of heptarm/virtual/ring.py.
 *
 * <p>A thread that a {@link PlantClock} has woken for a tick reads the state of exactly that tick as long as it is kept;
 * all others read the newest.
 */
public final class Ring {
    public static final int Q = 2;
    public static final int Q_CMD = 9;
    public static final int DQ = 16;
    public static final int TAU = 23;
    public static final int TAU_EXT = 30;
    public static final int TAU_CMD = 37;
    public static final int POSE = 44;
    public static final int WRENCH = 51;
    public static final int FLAGS = 57;
    public static final int MODE = 58;
    public static final int ORDER = 59;
    public static final int PROGRESS = 60;
    public static final int REMAINING = 61;
    public static final int E1 = 62;
    public static final int REDUNDANCY = 63;

    public static final int READY = 1;
    public static final int PAUSED = 2;
    public static final int BRAKES_OPEN = 4;
    public static final int MOVING = 8;
    public static final int MASTERED = 16;
    public static final int EMERGENCY_STOP = 32;
    public static final int ENABLED = 64;
    public static final int EXTERNAL_STOP = 128;
    public static final int SAFEGUARD_OPEN = 256;
    public static final int PROTECTIVE_STOP = 512;
    public static final int DRIVE_ERROR = 1024;
    public static final int HAND_GUIDING = 2048;

    static final long TICK_NS = 1000000L;

    private static final int BOX_SEQ = 0;
    private static final int BOX_ORDER = 8;
    private static final int BOX_KIND = 16;
    private static final int BOX_Q = 24;
    private static final int BOX_DQ = 80;
    private static final long TO_JOINTS = 1;
    private static final long TO_JOINTS_WITH_VELOCITY = 2;

    private static final int BOX_WORDS = 32;
    private static final int WORDS = 64;
    private static final int HEADER = 64;
    private static final int NEWEST = 0;
    private static final int ANCHOR = 16;
    private static final int RATE = 24;
    private static final int WAKE = 32;
    private static final int OVERRIDE = 40;
    /** A view further back than this may be overwritten while it is read. */
    private static final int OLDEST = 200;
    /** Whoever wakes later than this is shown the present: it has time left to read before its view is overwritten. */
    private static final int FAR = OLDEST / 2;

    private static final VarHandle LONGS =
            MethodHandles.byteBufferViewVarHandle(long[].class, ByteOrder.nativeOrder());

    private final ByteBuffer memory;
    private final int slots;
    private final int box;
    private final ThreadLocal<long[]> views = ThreadLocal.withInitial(() -> new long[] {-1});

    public Ring(ByteBuffer memory) {
        this.memory = memory.order(ByteOrder.nativeOrder());
        this.slots = (int) memory.getLong(8);
        this.box = HEADER + slots * WORDS * 8;
    }

    private long word(int offset) {
        return (long) LONGS.getAcquire(memory, offset);
    }

    /** Number of the newest tick. */
    long newest() {
        return word(NEWEST);
    }

    long anchor() {
        return word(ANCHOR);
    }

    double rate() {
        return Double.longBitsToDouble(word(RATE));
    }

    void wakeAt(long nanos) {
        LONGS.setRelease(memory, WAKE, nanos);
    }

    /** Factor on every programmed speed. */
    public void setOverride(double value) {
        LONGS.setRelease(memory, OVERRIDE, Double.doubleToRawLongBits(value));
    }

    /** Leaves a servo target for the plant's next tick; the newest counts. On straight lines q is a pose. */
    public synchronized void post(long order, double[] q, double[] velocity) {
        long seq = memory.getLong(box + BOX_SEQ);
        LONGS.setRelease(memory, box + BOX_SEQ, seq + 1);
        VarHandle.storeStoreFence();
        memory.putLong(box + BOX_ORDER, order);
        memory.putLong(box + BOX_KIND, velocity == null ? TO_JOINTS : TO_JOINTS_WITH_VELOCITY);
        for (int i = 0; i < q.length; i++) {
            memory.putDouble(box + BOX_Q + 8 * i, q[i]);
            memory.putDouble(box + BOX_DQ + 8 * i, velocity == null ? 0.0 : velocity[i]);
        }
        LONGS.setRelease(memory, box + BOX_SEQ, seq + 2);
    }

    /** The calling thread's getters read this tick from now on, or the newest if it is long past; returns which. */
    long view(long tick) {
        long newest = newest();
        long seen = newest - tick > FAR ? newest : tick;
        views.get()[0] = seen;
        return seen;
    }

    private long tick() {
        long newest = newest();
        long view = views.get()[0];
        return view < 0 || newest - view > OLDEST ? newest : view;
    }

    /** Value of a signal of the IO image. */
    public double signal(int place) {
        return Double.longBitsToDouble(word(box + 8 * (BOX_WORDS + place)));
    }

    public void setSignal(int place, double value) {
        LONGS.setRelease(memory, box + 8 * (BOX_WORDS + place), Double.doubleToRawLongBits(value));
    }

    /** Copies doubles of a state. */
    public void read(int word, double[] out) {
        read(word, out, 0, out.length);
    }

    /** Copies {@code count} doubles of a state from {@code word} on. */
    public void read(int word, double[] out, int at, int count) {
        while (true) {
            long tick = tick();
            int base = HEADER + (int) (tick % slots) * WORDS * 8;
            if (word(base) == 2 * tick + 2) {
                for (int i = 0; i < count; i++) {
                    out[at + i] = memory.getDouble(base + 8 * (word + i));
                }
                VarHandle.loadLoadFence();
                if (word(base) == 2 * tick + 2) {
                    return;
                }
            }
            Thread.onSpinWait();
        }
    }

    /** One double of a state. */
    public double number(int word) {
        double[] out = new double[1];
        read(word, out);
        return out[0];
    }

    /** One integer of a state. */
    public long integer(int word) {
        return Double.doubleToRawLongBits(number(word));
    }
}
