package heptarm.core.motion;

import java.util.ArrayList;
import java.util.List;

import heptarm.core.Clock;
import heptarm.core.Log;
import heptarm.core.robot.Sensors;
import heptarm.wire.Retreat;

/**
 * Records a motion that a break condition may end: before the condition fires the joints that the arm has passed, if it may have
 * to move back; afterwards the force of the contact. The motion thread calls it between its waits.
 */
final class ContactLog {
    private static final long PASSED_NS = 20000000L;
    private static final long FORCE_NS = 2000000L;
    /** A reader that is later than this does not catch up. */
    private static final long LATE_NS = 100000000L;
    /** Points per distance of the retreat, and most points that are kept. */
    private static final double RESOLUTION = 0.1;
    private static final int MAX_POINTS = 2000;
    /** A change of a joint that makes a point even if the motion frame rests [rad]. */
    private static final double TURN = 0.01;

    private final Sensors sensors;
    private final Clock clock;
    private final Log log;
    /** Length of the retreat [m]; 0: none. */
    private final double distance;
    private final List<Point> passed = new ArrayList<Point>();
    /** Index of the first item that it records, and the cabinet time of its start [ns]; what was passed before does not count. */
    private final int first;
    private volatile long began = Long.MAX_VALUE;
    private boolean isTouching;
    private boolean hasFailed;
    private long due;
    /** Cabinet time of the newest force [ns]. */
    private long read;
    private double peak = Double.NaN;
    private double rest = Double.NaN;

    /** Commanded joints [rad] and commanded position of the motion frame [m] at a cabinet time [ns]. */
    private static final class Point {
        final long time;
        final double[] q;
        final double[] xyz;

        Point(long time, double[] q, double[] xyz) {
            this.time = time;
            this.q = q;
            this.xyz = xyz;
        }

        double distance(Point other) {
            double sum = 0.0;
            for (int i = 0; i < xyz.length; i++) {
                sum += (xyz[i] - other.xyz[i]) * (xyz[i] - other.xyz[i]);
            }
            return Math.sqrt(sum);
        }

        double turn(Point other) {
            double most = 0.0;
            for (int i = 0; i < q.length; i++) {
                most = Math.max(most, Math.abs(q[i] - other.q[i]));
            }
            return most;
        }
    }

    /** Retreat: the reaction for which the passed joints are recorded; null: none. */
    ContactLog(Sensors sensors, Clock clock, Log log, int first, Retreat retreat) {
        this.sensors = sensors;
        this.clock = clock;
        this.log = log;
        this.first = first;
        distance = retreat == null ? 0.0 : retreat.distance;
        due = clock.nanos();
        recordJoints(); // an arm that already moves has another start
    }

    /** An item has started. Any thread. */
    void started(int item) {
        if (item >= first) {
            began = Math.min(began, clock.nanos());
        }
    }

    /** Whether there is something to record now and then. */
    boolean isActive() {
        return isTouching || distance > 0.0;
    }

    /** Cabinet time of the next record [ns]. */
    long due() {
        return due;
    }

    /** The break condition has fired: record forces from now on. */
    void touched() {
        if (!isTouching) {
            recordJoints();
            isTouching = true;
            due = clock.nanos();
        }
        record();
    }

    /** Record what is due when it is called: a reading of a cabinet takes a period or longer, and is of the present, so one is enough. */
    void record() {
        long now = clock.nanos();
        if (!isTouching) {
            if (now >= due) {
                recordJoints();
                due = now + PASSED_NS;
            }
            return;
        }
        due = Math.max(due, now - LATE_NS);
        while (due <= now) {
            double force = force(due);
            peak = peak >= force ? peak : force;
            due = Math.max(due, read) + FORCE_NS;
        }
    }

    /** The arm has come to rest. */
    void rested() {
        if (isTouching) {
            record();
            rest = force(clock.nanos());
            peak = peak >= rest ? peak : rest;
        }
    }

    /** Largest force since the condition fired [N]; NaN if none was read. */
    double peak() {
        return peak;
    }

    /** Force at the end [N]; NaN if none was read. */
    double rest() {
        return rest;
    }

    /** Joints that the arm passed at the distance of the retreat before the present position, or at its start; null: none are known. */
    double[] back() {
        recordJoints();
        if (passed.isEmpty()) {
            return null;
        }
        Point here = passed.get(passed.size() - 1);
        int start = passed.size() - 1;
        while (start > 0 && passed.get(start).time > began) {
            start--;
        }
        for (int i = passed.size() - 2; i >= start; i--) {
            double far = here.distance(passed.get(i));
            if (far >= distance) {
                double near = here.distance(passed.get(i + 1));
                return between(passed.get(i + 1).q, passed.get(i).q, (distance - near) / Math.max(far - near, 1e-12));
            }
        }
        return passed.get(start).q;
    }

    private static double[] between(double[] from, double[] to, double fraction) {
        double[] result = new double[from.length];
        for (int i = 0; i < result.length; i++) {
            result[i] = from[i] + Math.min(1.0, Math.max(0.0, fraction)) * (to[i] - from[i]);
        }
        return result;
    }

    private void recordJoints() {
        if (distance <= 0.0) {
            return;
        }
        clock.hold(clock.nanos());
        try {
            Point here = new Point(clock.stamp(), sensors.readJoints(clock.stamp()).q_cmd, sensors.readPose(clock.stamp()).xyz_cmd);
            Point last = passed.isEmpty() ? null : passed.get(passed.size() - 1);
            if (last == null || here.distance(last) > RESOLUTION * distance || here.turn(last) > TURN) {
                passed.add(here);
            }
        } catch (RuntimeException e) {
            failed(e);
        } finally {
            clock.release();
        }
        if (passed.size() > MAX_POINTS) {
            passed.subList(0, MAX_POINTS / 2).clear();
        }
    }

    private double force(long time) {
        clock.hold(time);
        try {
            read = clock.stamp();
            double[] force = sensors.readWrench(read).force;
            return Math.sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]);
        } catch (RuntimeException e) {
            failed(e);
            return Double.NaN;
        } finally {
            clock.release();
        }
    }

    private void failed(RuntimeException e) {
        if (!hasFailed) {
            hasFailed = true;
            log.error("reading the robot in contact", e);
        }
    }
}
