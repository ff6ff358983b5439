package heptarm.core;

import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;

import heptarm.wire.Message;

/** Delivers events to the sessions and to programs in the cabinet, in the thread that publishes them. */
public final class EventBus {
    private final List<Listener> listeners = new CopyOnWriteArrayList<Listener>();

    /** Receives every event; must not block. */
    public interface Listener {
        void received(Message event);
    }

    public void add(Listener listener) {
        listeners.add(listener);
    }

    public void remove(Listener listener) {
        listeners.remove(listener);
    }

    public void publish(Message event) {
        for (Listener listener : listeners) {
            listener.received(event);
        }
    }
}
