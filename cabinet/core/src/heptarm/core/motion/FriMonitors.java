package heptarm.core.motion;

import java.util.ArrayList;
import java.util.List;
import java.util.Map;
import java.util.concurrent.ConcurrentHashMap;

import heptarm.core.Clock;
import heptarm.core.CommandRejected;
import heptarm.core.Log;
import heptarm.core.robot.MotionPort;
import heptarm.core.safety.Watchdog;
import heptarm.wire.Code;
import heptarm.wire.FriOpen;

/** FRI sessions that only monitor: they run beside the motions. */
public final class FriMonitors implements Watchdog.Check {
    private static final int MAX_SESSIONS = 8;

    private final MotionPort port;
    private final MotionReporter reporter;
    private final Clock clock;
    private final Log log;
    private final Map<Long, FriActivity> sessions = new ConcurrentHashMap<Long, FriActivity>();

    public FriMonitors(MotionPort port, MotionReporter reporter, Clock clock, Log log) {
        this.port = port;
        this.reporter = reporter;
        this.clock = clock;
        this.log = log;
    }

    public synchronized void open(long id, FriOpen open) throws CommandRejected {
        if (sessions.size() >= MAX_SESSIONS) {
            throw new CommandRejected(Code.QUEUE_FULL, "command", "monitor", "",
                    "at most " + MAX_SESSIONS + " FRI sessions may be open; close one of them");
        }
        FriActivity session = new FriActivity(open, port, reporter, clock, log);
        session.number(id);
        session.start();
        sessions.put(id, session);
    }

    /** Close a session; false: none has that id. */
    public boolean close(long id) {
        FriActivity session = sessions.remove(id);
        if (session != null) {
            session.finish(0, "");
        }
        return session != null;
    }

    public void closeAll() {
        List<Long> all = new ArrayList<Long>(sessions.keySet());
        for (Long id : all) {
            close(id);
        }
    }

    public boolean isIdle() {
        return sessions.isEmpty();
    }

    /** Closes sessions whose client does not answer. */
    public void check() {
        for (Map.Entry<Long, FriActivity> one : sessions.entrySet()) {
            if (!one.getValue().checkClient()) {
                sessions.remove(one.getKey());
            }
        }
    }
}
