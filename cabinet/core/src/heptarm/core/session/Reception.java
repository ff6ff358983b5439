package heptarm.core.session;

import java.io.IOException;
import java.net.InetAddress;
import java.net.InetSocketAddress;
import java.net.ServerSocket;
import java.net.Socket;
import java.util.ArrayList;
import java.util.List;

import heptarm.core.FailureLog;
import heptarm.core.Log;
import heptarm.core.Threads;
import heptarm.wire.Code;
import heptarm.wire.Goodbye;
import heptarm.wire.Halted;
import heptarm.wire.StopKind;

/**
 * Accepts connections and serves those that have no session yet.
 *
 * <p>Anyone can open connections, so these cost little: one thread looks after all of them, there are only so many, each has a
 * second, and the oldest one goes when another comes. A Halt is executed here, by a thread of its own, so that no number of
 * clients keeps anyone from stopping the arm.
 *
 * <p>The thread polls plain sockets: the streams of a java.nio channel cannot read and write at the same time in Java 6.
 */
final class Reception {
    /** Connections that the system keeps until they are accepted, at most: an overflow would cost a client a second. */
    private static final int BACKLOG = 4096;
    private static final int MAX_WAITING = 256;
    private static final int MAX_OF_ADDRESS = 192;
    private static final long PATIENCE_NS = 1000000000L;
    /** For how long the last frame to a connection can be read before the connection is closed. */
    private static final long LINGER_NS = 1500000000L;
    private static final long POLL_MS = 2;

    private final ServerSettings settings;
    private final FrameEncoder frames;
    private final Host host;
    private final Log log;
    /** Most connections without a session. */
    private final int mostWaiting;
    private final List<Newcomer> waiting = new ArrayList<Newcomer>();
    private final List<Newcomer> displaced = new ArrayList<Newcomer>();
    private final List<Newcomer> halting = new ArrayList<Newcomer>();
    private final List<Newcomer> halted = new ArrayList<Newcomer>();
    private ServerSocket socket;
    private Thread acceptor;
    private Thread receptionist;
    private Thread stopper;
    private volatile boolean closed;

    /** Receives the clients that have proved what they must, and the stops. */
    interface Host {
        void admit(Newcomer newcomer) throws IOException;

        void halt(StopKind kind, String who);
    }

    Reception(ServerSettings settings, FrameEncoder frames, Host host, int room, Log log) {
        this.settings = settings;
        this.frames = frames;
        this.host = host;
        this.log = log;
        mostWaiting = Math.max(4, Math.min(MAX_WAITING, room / 4));
    }

    /** Open the port; returns it. */
    int open() throws IOException {
        socket = new ServerSocket();
        socket.setReuseAddress(true);
        socket.bind(new InetSocketAddress(InetAddress.getByName(settings.bind), settings.port), BACKLOG);
        return socket.getLocalPort();
    }

    void start() {
        receptionist = Threads.start("ha-reception", new Runnable() {
            public void run() {
                receive();
            }
        });
        stopper = Threads.start("ha-stopper", new Runnable() {
            public void run() {
                halt();
            }
        });
        acceptor = Threads.start("ha-acceptor", new Runnable() {
            public void run() {
                accept();
            }
        });
    }

    /** Close the port and all connections that have no session. */
    void close() {
        closed = true;
        try {
            if (socket != null) {
                socket.close();
            }
        } catch (IOException e) {
            log.error("closing the port", e);
        }
        Threads.join(acceptor);
        Threads.end(receptionist);
        Threads.end(stopper);
        synchronized (waiting) {
            waiting.addAll(displaced);
            for (Newcomer one : waiting) {
                dismiss(one);
            }
            waiting.clear();
        }
    }

    private static void dismiss(Newcomer one) {
        try {
            if (!one.isLeaving()) {
                one.end(new Goodbye(Code.SHUTTING_DOWN, "the cabinet application is closing"));
            }
        } catch (IOException e) { // it has gone first
        }
        one.close();
    }

    // ------------------------------------------------------------------------------------------- accepting

    private void accept() {
        FailureLog failures = new FailureLog(log);
        while (!closed) {
            Socket peer = null;
            try {
                peer = socket.accept();
                welcome(peer);
                failures.succeeded();
            } catch (IOException e) {
                if (!closed) {
                    log.warn("a connection was not accepted: " + e);
                    Threads.pause(); // a cause such as too many open files does not vanish at once
                }
            } catch (Throwable e) { // the memory is used up, say: clients that come later need this thread
                failures.failed("accepting a connection", e);
                if (peer == null) {
                    Threads.pause();
                } else {
                    close(peer);
                }
            }
        }
    }

    /** Take in a connection; one that its peer has reset already is closed at once, since a stop of the arm may be next. */
    private void welcome(Socket peer) {
        try {
            peer.setTcpNoDelay(true);
            add(new Newcomer(peer, new Handshake(settings.key), frames));
        } catch (IOException e) {
            close(peer);
        }
    }

    private static void close(Socket peer) {
        try {
            peer.close();
        } catch (IOException e) { // it is gone either way
        }
    }

    private void add(Newcomer newcomer) throws IOException {
        if (!settings.allows(newcomer.address)) {
            newcomer.refuse(Code.NOT_ALLOWED, newcomer.address + " is not on the allow-list");
        }
        synchronized (waiting) {
            makeRoom(newcomer.address);
            waiting.add(newcomer);
            waiting.notifyAll();
        }
    }

    /** The oldest one goes if there are too many, first of the same address. */
    private void makeRoom(String address) {
        Newcomer oldest = null;
        int count = 0;
        for (Newcomer one : waiting) {
            if (one.address.equals(address) && one.halt() == null) {
                count++;
                oldest = oldest == null ? one : oldest;
            }
        }
        if (count < mostOfAddress() && waiting.size() < mostWaiting) {
            return;
        }
        if (count < mostOfAddress()) {
            oldest = waiting.get(0);
        }
        waiting.remove(oldest);
        displaced.add(oldest);
    }

    private int mostOfAddress() {
        return Math.min(MAX_OF_ADDRESS, 3 * mostWaiting / 4);
    }

    // ------------------------------------------------------------------------------------------- receiving

    private void receive() {
        List<Newcomer> all = new ArrayList<Newcomer>();
        List<Newcomer> gone = new ArrayList<Newcomer>();
        FailureLog failures = new FailureLog(log);
        try {
            while (!closed) {
                all.clear();
                gone.clear();
                synchronized (waiting) {
                    while (waiting.isEmpty() && displaced.isEmpty()) {
                        waiting.wait();
                    }
                    all.addAll(waiting);
                    gone.addAll(displaced);
                    displaced.clear();
                }
                try {
                    for (Newcomer one : gone) {
                        displace(one);
                    }
                    for (Newcomer one : all) {
                        serve(one);
                    }
                    answerHalted();
                    failures.succeeded();
                } catch (Throwable e) { // the memory is used up, say: who comes later needs this thread
                    failures.failed("serving connections without a session", e);
                }
                Thread.sleep(POLL_MS);
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    private static void displace(Newcomer one) {
        try {
            if (!one.isLeaving()) {
                one.refuse(Code.TOO_MANY_CLIENTS, "too many connections wait for a session; try again");
            }
        } catch (IOException e) { // it has gone first
        }
        one.close();
    }

    private void serve(Newcomer one) {
        try {
            boolean isNew = one.halt() == null;
            one.serve();
            if (one.isLeaving()) {
                if (one.age() > LINGER_NS) {
                    drop(one);
                }
            } else if (one.handshake.isDone()) {
                if (remove(one)) {
                    host.admit(one);
                }
            } else if (one.halt() != null) {
                if (isNew) {
                    synchronized (halting) {
                        halting.add(one);
                        halting.notifyAll();
                    }
                }
            } else if (one.age() > PATIENCE_NS) {
                one.refuse(Code.SILENT, "it did not open a session within " + PATIENCE_NS / 1000000000L + " s");
            }
        } catch (IOException e) {
            drop(one);
        } catch (Throwable e) { // also a class that this cabinet lacks
            drop(one);
            log.error("receiving " + one.address, e);
        }
    }

    private void drop(Newcomer one) {
        remove(one);
        one.close();
    }

    private boolean remove(Newcomer one) {
        synchronized (waiting) {
            return waiting.remove(one);
        }
    }

    // ------------------------------------------------------------------------------------------- stopping

    private void halt() {
        List<Newcomer> all = new ArrayList<Newcomer>();
        FailureLog failures = new FailureLog(log);
        try {
            while (!closed) {
                all.clear();
                synchronized (halting) {
                    while (halting.isEmpty()) {
                        halting.wait();
                    }
                    all.addAll(halting);
                    halting.clear();
                }
                try {
                    halt(all);
                    failures.succeeded();
                } catch (Throwable e) { // the next stop needs this thread
                    failures.failed("answering a stop", e);
                }
            }
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    /** Execute each kind of stop once, however many request it. */
    private void halt(List<Newcomer> all) {
        for (StopKind kind : StopKind.values()) {
            String who = "";
            for (Newcomer one : all) {
                who = one.halt().kind == kind ? one.address : who;
            }
            if (who.length() == 0) {
                continue;
            }
            try {
                host.halt(kind, who);
            } catch (Throwable e) { // also a class that this cabinet lacks
                for (Newcomer one : all) {
                    one.failure = String.valueOf(e);
                }
                log.error("stopping the robot for " + who, e);
            }
        }
        synchronized (halting) {
            halted.addAll(all);
        }
    }

    private void answerHalted() {
        List<Newcomer> all;
        synchronized (halting) {
            all = new ArrayList<Newcomer>(halted);
            halted.clear();
        }
        for (Newcomer one : all) {
            try {
                if (one.failure == null) {
                    one.end(new Halted());
                } else {
                    one.refuse(Code.INTERNAL, "the stop failed: " + one.failure + "; press the emergency stop");
                }
            } catch (IOException e) { // it did not wait for the answer
                drop(one);
            }
        }
    }
}
