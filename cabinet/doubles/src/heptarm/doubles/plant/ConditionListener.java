package heptarm.doubles.plant;

/** Receives the changes of a condition; called on the realtime thread of the plant, must not block. */
public interface ConditionListener {
    void changed(boolean holds);
}
