package heptarm.fake;

import java.io.BufferedReader;
import java.io.InputStreamReader;

import heptarm.core.Clock;
import heptarm.core.Config;
import heptarm.core.Log;
import heptarm.core.RealClock;
import heptarm.core.Server;

/** The core on a fake robot: prints its port, serves until it reads a line, closes, and names the threads that are left. */
public final class FakeCabinet {
    private FakeCabinet() {
    }

    /** Arguments: rate of the clock, key, allow-list, heartbeat [s], cost of a getter [s]. */
    public static void main(String[] args) throws Exception {
        double rate = Double.parseDouble(args[0]);
        Clock clock = rate == 1.0 ? new RealClock() : new ScaledClock(rate);
        FakeRobot robot = new FakeRobot(clock, Math.round(Double.parseDouble(args[4]) * 1e9));
        Thread axes = new Thread(robot, "fake-robot");
        axes.setDaemon(true);
        axes.start();
        Server server = new Server(robot, new Config("127.0.0.1", 0, args[1], args[2], Double.parseDouble(args[3]), 1000.0),
                clock, new ErrLog());
        System.out.println(server.start());
        BufferedReader in = new BufferedReader(new InputStreamReader(System.in));
        String line = in.readLine();
        while ("threads".equals(line)) {
            System.out.println(threads());
            line = in.readLine();
        }
        server.close();
        server.close();
        System.out.println(threads());
    }

    private static String threads() {
        StringBuilder names = new StringBuilder();
        for (Thread thread : Thread.getAllStackTraces().keySet()) {
            if (thread.getName().startsWith("ha-")) {
                names.append(thread.getName()).append(' ');
            }
        }
        return names.toString().trim();
    }

    private static final class ErrLog implements Log {
        @Override
        public void info(String text) {
            System.err.println("info " + text);
        }

        @Override
        public void warn(String text) {
            System.err.println("warn " + text);
        }

        @Override
        public void error(String text, Throwable cause) {
            System.err.println("error " + text);
            cause.printStackTrace();
        }
    }
}
