package heptarm.doubles.plant;

import heptarm.doubles.seam.EndCause;

/** Receives the events of a motion; called on the realtime thread of the plant, must not block. */
public interface MotionListener {
    void started();

    /** A part other than the first starts. */
    void reached(int part);

    /** The break condition or trigger at an index has fired; part -1: it belongs to the whole motion. */
    void fired(int part, boolean breaks, int index);

    /** The motion has ended; the cause is the value of an {@link EndCause}. */
    void finished(int cause, String text);
}
