package heptarm.fake;

import java.io.BufferedReader;
import java.io.InputStreamReader;
import java.util.Arrays;

import heptarm.core.Clock;
import heptarm.core.Log;
import heptarm.core.RealClock;
import heptarm.core.Threads;
import heptarm.core.robot.Robot;
import heptarm.core.robot.RobotModels;
import heptarm.core.session.CabinetServer;
import heptarm.core.session.ServerSettings;

/** The core on a fake robot: prints its port, serves until it reads a line, closes, and names the threads that are left. */
public final class FakeCabinet {
    private FakeCabinet() {
    }

    /** Arguments: rate of the clock, key, allow-list, heartbeat [s], cost of a getter [s], tcp: no UDP port. */
    public static void main(String[] args) throws Exception {
        double rate = Double.parseDouble(args[0]);
        Clock clock = rate == 1.0 ? new RealClock() : new ScaledClock(rate);
        Robot robot = robot(clock, Math.round(Double.parseDouble(args[4]) * 1e9));
        CabinetServer server = new CabinetServer(robot, new ServerSettings("127.0.0.1", 0, args[1], args[2], Double.parseDouble(args[3]), 1000.0,
                !"tcp".equals(args[5]), ""),
                clock, new ErrLog());
        System.out.println(server.start());
        BufferedReader in = new BufferedReader(new InputStreamReader(System.in));
        String line = in.readLine();
        while ("threads".equals(line) || "revoke".equals(line)) {
            if ("revoke".equals(line)) {
                server.revokeControl("revoked by the operator");
            }
            System.out.println(threads());
            line = in.readLine();
        }
        server.close();
        server.close();
        System.out.println(threads());
    }

    private static Robot robot(Clock clock, long getterNanos) {
        FakeFaults faults = new FakeFaults(clock, getterNanos);
        FakeSafety safety = new FakeSafety(faults);
        FakeSignals signals = new FakeSignals(faults);
        double[] q = new double[7];
        FakeSensors sensors = new FakeSensors(faults, q);
        FakeMotions motions = new FakeMotions(faults, safety, sensors, signals, q);
        Threads.start("fake-robot", motions);
        double[] high = {2.96, 2.09, 2.96, 2.09, 2.96, 2.09, 3.05};
        double[] low = Arrays.stream(high).map(limit -> -limit).toArray();
        return new Robot(RobotModels.describe("LBR_iiwa_14_R820_1", low, high), "fake", true, new String[] {"ptp", "hold", "pause", "override", "triggers", "dialogs", "user_keys", "process_data", "tools"}, motions,
                sensors, safety, new FakeTools(), signals, new FakePanel(faults, safety));
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
