package heptarm.doubles;

/** Hears of a condition; called by the thread that ticks the plant, must not block. */
public interface ConditionListener {
    void changed(boolean holds);
}
