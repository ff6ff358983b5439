package heptarm.core.session;

import java.io.BufferedReader;
import java.io.File;
import java.io.FileReader;
import java.io.IOException;

/** How many connections the operating system leaves room for: each is an open file, and a motion must not find none left. */
final class OpenFiles {
    /** For everything that is no connection. */
    private static final int RESERVE = 64;
    private static final int UNKNOWN = Integer.MAX_VALUE;
    private static final String LIMIT = "Max open files";

    private OpenFiles() {
    }

    /** Connections for which there is room now; very many where the system does not report it. */
    static int room() {
        String[] open = new File("/proc/self/fd").list();
        int limit = limit();
        return open == null || limit == UNKNOWN ? UNKNOWN : Math.max(0, limit - open.length - RESERVE);
    }

    private static int limit() {
        try {
            BufferedReader file = new BufferedReader(new FileReader("/proc/self/limits"));
            try {
                for (String line = file.readLine(); line != null; line = file.readLine()) {
                    if (line.startsWith(LIMIT)) {
                        return Integer.parseInt(line.substring(LIMIT.length()).trim().split(" +")[0]);
                    }
                }
            } finally {
                file.close();
            }
        } catch (IOException e) { // another system
            return UNKNOWN;
        } catch (NumberFormatException e) { // unlimited
            return UNKNOWN;
        }
        return UNKNOWN;
    }
}
