package heptarm.core.session;

import java.net.InetAddress;
import java.net.UnknownHostException;
import java.util.HashSet;
import java.util.Set;

/** Settings of the server, from the cabinet's process data. */
public final class ServerSettings {
    public static final String VERSION = "0.1.0";
    /** Check sum of the installed sources, written by `heptarm install-cabinet`; empty in heptarm itself. */
    public static final String SOURCES = "";

    private static final double MIN_KEY_BITS = 80;
    private static final int MIN_DIFFERENT = 8;

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
    /** Open the UDP port of the same number. */
    public final boolean datagrams;
    /** The program that controls the robot instead of any client, which may observe and stop; empty: clients may control. */
    public final String reservedFor;

    public ServerSettings(String bind, int port, String key, String allow, double heartbeat, double maxRate, boolean datagrams,
            String reservedFor) {
        this.bind = bind;
        this.port = port;
        this.key = key;
        this.allow = allow;
        this.heartbeat = heartbeat;
        this.maxRate = maxRate;
        this.datagrams = datagrams;
        this.reservedFor = reservedFor;
    }

    /** Why the key is too weak; empty: it is strong enough, or there is none. The Python side has the same rule. */
    public String keyWeakness() {
        Set<Character> different = new HashSet<Character>();
        for (int i = 0; i < key.length(); i++) {
            different.add(key.charAt(i));
        }
        double bits = key.length() * Math.log(Math.max(1, different.size())) / Math.log(2);
        if (key.length() == 0 || bits >= MIN_KEY_BITS && different.size() >= MIN_DIFFERENT) {
            return "";
        }
        return "the process data heptarm.key must have at least " + (int) MIN_KEY_BITS + " bits and " + MIN_DIFFERENT
                + " different characters, got " + Math.round(bits) + " bits (" + key.length() + " characters, " + different.size()
                + " of them different); make a key with `heptarm key new`";
    }

    /** Whether every program in the network may connect: all interfaces, no key, no allow-list. */
    boolean isOpenToAll() throws UnknownHostException {
        return key.length() == 0 && allow.trim().length() == 0 && InetAddress.getByName(bind).isAnyLocalAddress();
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
