package heptarm.core.session;

/** Settings of the server, from the cabinet's process data. */
public final class ServerSettings {
    public static final String VERSION = "0.1.0";

    /** Address to listen on. */
    public final String bind;
    /** Port; 0: any free one. */
    public final int port;
    /** Pre-shared key; empty: none. */
    public final String key;
    /** Addresses that may connect, separated by spaces or commas; empty: all. */
    public final String allow;
    /** Both sides send something at least this often [s]. */
    public final double heartbeat;
    /** Highest state rate [Hz]. */
    public final double maxRate;

    public ServerSettings(String bind, int port, String key, String allow, double heartbeat, double maxRate) {
        this.bind = bind;
        this.port = port;
        this.key = key;
        this.allow = allow;
        this.heartbeat = heartbeat;
        this.maxRate = maxRate;
    }

    boolean allows(String address) {
        if (allow.trim().length() == 0) {
            return true;
        }
        for (String one : allow.trim().split("[,\\s]+")) {
            if (one.equals(address)) {
                return true;
            }
        }
        return false;
    }
}
