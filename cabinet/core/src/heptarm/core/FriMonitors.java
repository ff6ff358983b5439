package heptarm.core;

import java.util.ArrayList;
import java.util.List;
import java.util.Map;
import java.util.concurrent.ConcurrentHashMap;

import heptarm.wire.Code;

/** FRI sessions that only monitor: they run beside the motions. */
final class FriMonitors {
    private static final int MOST = 8;

    private final Map<Long, FriRun> sessions = new ConcurrentHashMap<Long, FriRun>();

    synchronized void open(long id, FriRun run) throws Refusal {
        if (sessions.size() >= MOST) {
            throw new Refusal(Code.QUEUE_FULL, "command", "monitor", "", MOST + " FRI sessions are open already; close one of them");
        }
        run.number(id);
        run.start();
        sessions.put(id, run);
    }

    /** Ends a session; false: there is none of that number. */
    boolean close(long id) {
        FriRun run = sessions.remove(id);
        if (run != null) {
            run.finish(0, "");
        }
        return run != null;
    }

    void closeAll() {
        List<Long> all = new ArrayList<Long>(sessions.keySet());
        for (Long id : all) {
            close(id);
        }
    }

    /** Ends what nobody answers. */
    void look() {
        for (Map.Entry<Long, FriRun> one : sessions.entrySet()) {
            if (!one.getValue().look()) {
                sessions.remove(one.getKey());
            }
        }
    }
}
