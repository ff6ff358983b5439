package heptarm.doubles.plant;

import java.lang.invoke.MethodHandles;
import java.lang.invoke.VarHandle;
import java.nio.ByteBuffer;
import java.nio.ByteOrder;

import heptarm.doubles.seam.HeaderWords;
import heptarm.doubles.seam.ImageWords;
import heptarm.doubles.seam.SafetyFlags;
import heptarm.doubles.seam.Seam;
import heptarm.doubles.seam.StateWords;
import heptarm.doubles.seam.TargetKind;
import heptarm.doubles.seam.TargetWords;

/**
 * Reads the last states of the plant from memory shared with Python, and writes servo targets, outputs and the override into it.
 *
 * <p>A thread that a {@link PlantClock} has woken for a tick reads the state of exactly that tick for a while; a thread that
 * holds a tick reads the state of that tick until it releases it, however late it comes to that. All others read the newest state.
 */
public final class SharedState {
    private static final int WORD = Long.BYTES;
    private static final int TARGET = WORD * TargetWords.START;
    /** A thread that was woken longer ago than this [ticks], or that wakes later than half of it, reads the newest state. */
    private static final int OLDEST = 400;
    private static final int FAR = OLDEST / 2;

    private static final VarHandle LONGS =
            MethodHandles.byteBufferViewVarHandle(long[].class, ByteOrder.nativeOrder());

    private final ByteBuffer memory;
    private volatile Runnable onWrite = () -> { };
    private final ThreadLocal<View> views = ThreadLocal.withInitial(View::new);

    /** A copy of the state that a thread reads. */
    private static final class View {
        /** -1: none. */
        long tick = -1;
        boolean held;
        final long[] words = new long[StateWords.SIZE];
    }

    public SharedState(ByteBuffer memory) {
        this.memory = memory.order(ByteOrder.nativeOrder());
        if (memory.capacity() != WORD * Seam.MEMORY_WORDS) {
            throw new IllegalStateException("shared memory must have " + WORD * Seam.MEMORY_WORDS + " bytes, got "
                    + memory.capacity() + "; compile the cabinet again");
        }
    }

    /** A word of the memory. */
    private long word(int index) {
        return (long) LONGS.getAcquire(memory, WORD * index);
    }

    private void setWord(int index, long value) {
        LONGS.setRelease(memory, WORD * index, value);
    }

    /** Number of the newest tick that is due: one that is computed ahead counts from that moment on. */
    public long newest() {
        long tick = computed();
        return tick > 0 && System.nanoTime() < wallTime(tick) ? tick - 1 : tick;
    }

    /** Number of the newest tick that is computed; it is the newest one or the next. */
    public long computed() {
        return word(HeaderWords.START + HeaderWords.NEWEST);
    }

    long anchor() {
        return word(HeaderWords.START + HeaderWords.ANCHOR);
    }

    /** Length of a tick by the machine's clock [ns]; 0 while ticks follow each other as fast as possible. */
    private long period() {
        double rate = rate();
        return rate > 0.0 ? (long) (Seam.TICK_NS / rate) : 0;
    }

    /** The machine's time, see {@link System#nanoTime}, at which a tick is due. */
    public long wallTime(long tick) {
        return anchor() + tick * period();
    }

    /**
     * Publishes the newest state again as that of each tick that is due: the robot rests. Only while the plant's realtime thread waits
     * in {@link TimerQueue#rest}, and in one thread at a time.
     *
     * @param last tick after which none is published
     * @param late a tick that cannot be due, unless the machine was suspended: then that time is given up
     * @param ahead the next tick counts as due if it is so near [ns]; no other one is published before it is due
     */
    void repeat(long last, long late, long ahead) {
        long tick = computed();
        long now = System.nanoTime();
        long due = (now + Math.min(ahead, period()) - anchor()) / period();
        if (due > late) {
            due = tick + 1;
            setWord(HeaderWords.START + HeaderWords.ANCHOR, now - due * period());
        }
        int from = base(tick);
        for (long next = tick + 1; next <= Math.min(due, last); next++) {
            int to = base(next);
            setWord(to + StateWords.SEQ, 2 * next + 1);
            VarHandle.storeStoreFence();
            for (int i = 0; i < StateWords.SIZE; i++) {
                if (i != StateWords.SEQ && i != StateWords.TIME) {
                    memory.putLong(WORD * (to + i), memory.getLong(WORD * (from + i)));
                }
            }
            memory.putLong(WORD * (to + StateWords.TIME), next * Seam.TICK_NS);
            setWord(to + StateWords.SEQ, 2 * next + 2);
            setWord(HeaderWords.START + HeaderWords.NEWEST, next);
        }
    }

    /** First word of the state of a tick. */
    private static int base(long tick) {
        return StateWords.START + (int) (tick % Seam.SLOTS) * StateWords.SIZE;
    }

    /** Calls a runnable whenever the override or an output has been written; it must not block. */
    void onWrite(Runnable runnable) {
        onWrite = runnable;
    }

    double rate() {
        return Double.longBitsToDouble(word(HeaderWords.START + HeaderWords.RATE));
    }

    void setWakeTime(long nanos) {
        setWord(HeaderWords.START + HeaderWords.WAKE, nanos);
    }

    /** Factor on every programmed speed. */
    public void setOverride(double value) {
        setWord(HeaderWords.START + HeaderWords.OVERRIDE, Double.doubleToRawLongBits(value));
        onWrite.run();
    }

    /** Writes a servo target, which replaces the previous one at the plant's next tick. For straight lines q is a pose. */
    public synchronized void postTarget(long order, double[] q, double[] velocity) {
        long seq = word(TargetWords.START + TargetWords.SEQ);
        setWord(TargetWords.START + TargetWords.SEQ, seq + 1);
        VarHandle.storeStoreFence();
        memory.putLong(TARGET + WORD * TargetWords.ORDER, order);
        memory.putLong(TARGET + WORD * TargetWords.KIND,
                (velocity == null ? TargetKind.POSITION : TargetKind.POSITION_WITH_VELOCITY).value());
        for (int i = 0; i < q.length; i++) {
            memory.putDouble(TARGET + WORD * (TargetWords.Q + i), q[i]);
            memory.putDouble(TARGET + WORD * (TargetWords.DQ + i), velocity == null ? 0.0 : velocity[i]);
        }
        setWord(TargetWords.START + TargetWords.SEQ, seq + 2);
    }

    /** Selects the tick that the calling thread reads from now on, or the newest if that tick is too old; returns the selected tick. */
    long view(long tick) {
        View view = views.get();
        view.held = false;
        copy(view, newest() - tick > FAR ? newest() : Math.min(tick, computed()));
        return view.tick;
    }

    /**
     * Keeps the calling thread at a tick, or at the newest if that tick is not kept any more, until {@link #release}. A tick that is
     * not due yet can be held by the thread that has selected it.
     */
    void hold(long tick) {
        View view = views.get();
        if (view.tick != tick) {
            copy(view, Math.min(tick, newest()));
        }
        view.held = true;
    }

    /** Lets the calling thread read the newest state again. */
    void release() {
        View view = views.get();
        view.held = false;
        view.tick = -1;
    }

    /** The tick that the calling thread holds; -1: none. */
    long held() {
        View view = views.get();
        return view.held ? view.tick : -1;
    }

    private void copy(View view, long wanted) {
        long tick = wanted;
        while (view.tick != tick) {
            int base = base(tick);
            if (word(base + StateWords.SEQ) == 2 * tick + 2) {
                view.tick = -1;
                for (int i = 0; i < StateWords.SIZE; i++) {
                    view.words[i] = memory.getLong(WORD * (base + i));
                }
                VarHandle.loadLoadFence();
                if (word(base + StateWords.SEQ) == 2 * tick + 2) {
                    view.tick = tick;
                    return;
                }
            }
            tick = newest(); // it was overwritten
        }
    }

    /** Value of a signal of the IO image. */
    public double signal(int place) {
        return Double.longBitsToDouble(word(ImageWords.START + place));
    }

    public void setSignal(int place, double value) {
        setWord(ImageWords.START + place, Double.doubleToRawLongBits(value));
        onWrite.run();
    }

    /** Copies the doubles of an array of a state, see {@link StateWords}. */
    public void read(int word, double[] out) {
        read(word, out, 0, out.length);
    }

    /** Copies {@code count} doubles of a state from {@code word} on. */
    public void read(int word, double[] out, int at, int count) {
        View view = views.get();
        if (!view.held && (view.tick < 0 || newest() - view.tick > OLDEST)) {
            view.tick = -1;
            copy(view, newest());
            view.tick = -1;
        }
        for (int i = 0; i < count; i++) {
            out[at + i] = Double.longBitsToDouble(view.words[word + i]);
        }
    }

    /** One double of a state. */
    public double number(int word) {
        double[] out = new double[1];
        read(word, out);
        return out[0];
    }

    /** Whether a bit of {@link SafetyFlags} is set. */
    public boolean flag(int bit) {
        return (integer(StateWords.FLAGS) & bit) != 0;
    }

    /** One integer of a state. */
    public long integer(int word) {
        return Double.doubleToRawLongBits(number(word));
    }
}
