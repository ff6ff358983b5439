package heptarm.doubles;

/** Hears of an order; called by the thread that ticks the plant, must not block. */
public interface MotionListener {
    void started();

    /** A part of it begins, another than the first. */
    void reached(int part);

    /** A break condition or a trigger has fired, the one of that index; of a part, or, -1, of the whole. */
    void fired(int part, boolean breaks, int index);

    /** The cause is done, cancelled, condition or error. */
    void finished(String cause, String text);
}
