package heptarm.core.session;

import java.util.List;
import java.util.Map;
import java.util.concurrent.ConcurrentHashMap;
import java.util.concurrent.CopyOnWriteArrayList;

import heptarm.core.safety.Watchdog;
import heptarm.wire.Code;

/**
 * The clients with a session, and who of them may stay: the controller always, and so many observers.
 *
 * <p>Any further client is a guest. It has a moment to take control or to stop the arm; the oldest guest goes when another one
 * comes. So nobody who fills all places shuts out the one who has to act.
 */
final class Places implements Watchdog.Check {
    private static final int MOST = 100;
    private static final long GUEST_NS = 2000000000L;
    final List<ClientConnection> clients = new CopyOnWriteArrayList<ClientConnection>();
    /** Guests, and the machine's time from which on they are guests [ns]. */
    private final Map<ClientConnection, Long> guests = new ConcurrentHashMap<ClientConnection, Long>();
    private final ControlAuthority authority;
    /** Most observers, and as many guests. */
    private final int most;
    /** With more clients than this, those that are ending included, a guest goes without a Goodbye. */
    private final int crowd;

    /**
     * Places for clients.
     *
     * @param room connections for which there is room; they take at most half of it
     */
    Places(ControlAuthority authority, int room) {
        this.authority = authority;
        most = Math.max(2, Math.min(MOST, room / 8));
        crowd = 4 * most;
    }

    /** Add a client; for one thread. */
    void add(ClientConnection client) {
        if (observers() >= most) {
            makeRoom();
            guests.put(client, System.nanoTime());
        }
        clients.add(client);
    }

    void remove(ClientConnection client) {
        clients.remove(client);
        guests.remove(client);
    }

    private void makeRoom() {
        ClientConnection oldest = null;
        long since = Long.MAX_VALUE;
        for (Map.Entry<ClientConnection, Long> guest : guests.entrySet()) {
            if (guest.getValue() < since && !authority.isController(guest.getKey())) {
                oldest = guest.getKey();
                since = guest.getValue();
            }
        }
        if (guests.size() < most || oldest == null) {
            return;
        }
        guests.remove(oldest);
        if (clients.size() < crowd) {
            dismiss(oldest);
        } else {
            oldest.leave("too many clients");
        }
    }

    /** Those that are no guests and do not control the robot. */
    private int observers() {
        int count = 0;
        for (ClientConnection client : clients) {
            if (!guests.containsKey(client) && !authority.isController(client)) {
                count++;
            }
        }
        return count;
    }

    public boolean isIdle() {
        return guests.isEmpty();
    }

    public void check() {
        long now = System.nanoTime();
        for (Map.Entry<ClientConnection, Long> guest : guests.entrySet()) {
            if (authority.isController(guest.getKey())) {
                guest.setValue(now); // it is a guest again when it releases control
            } else if (observers() < most) {
                guests.remove(guest.getKey());
            } else if (now - guest.getValue() > GUEST_NS) {
                dismiss(guest.getKey());
            }
        }
    }

    private void dismiss(ClientConnection client) {
        client.goodbye(Code.TOO_MANY_CLIENTS, most + " clients observe already; others have " + GUEST_NS / 1000000000L
                + " s to take control or to stop the arm");
    }
}
