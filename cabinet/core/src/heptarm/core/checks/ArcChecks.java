package heptarm.core.checks;

import java.util.Locale;

import heptarm.core.CommandRejected;
import heptarm.wire.Circ;
import heptarm.wire.CircSegment;
import heptarm.wire.Code;
import heptarm.wire.Hold;
import heptarm.wire.Item;
import heptarm.wire.Lin;
import heptarm.wire.LinSegment;
import heptarm.wire.Pose;
import heptarm.wire.PtpPose;
import heptarm.wire.SplSegment;
import heptarm.wire.Spline;
import heptarm.wire.SplineSegment;

/**
 * Refuses arcs whose points define no circle, before any motion of the program moves.
 *
 * <p>The start of an arc is known behind a motion to a pose of the same motion frame, and behind a segment. The planner
 * checks the others. The limits are those of heptarm.circle_through.
 */
final class ArcChecks {
    /** Least distance of two points [m]. */
    private static final double LEAST = 1e-5;
    /** Least angle between via and end, seen from the start [rad]. */
    private static final double FLAT = 1e-4;
    private static final String REMEDY = "give a point between start and end";

    private ArcChecks() {
    }

    /** Check the arcs of a program; `name` is that of its list of items. */
    static void check(Item[] items, String name) throws CommandRejected {
        double[] start = null;
        String frame = null;
        for (int i = 0; i < items.length; i++) {
            double[] here = items[i].frame.equals(frame) ? start : null;
            if (items[i].motion instanceof Hold) {
                continue;
            }
            start = end(items[i], here, name + "[" + i + "].motion.");
            frame = items[i].frame;
        }
    }

    /** Where a motion ends; null: not known. */
    private static double[] end(Item item, double[] start, String path) throws CommandRejected {
        if (item.motion instanceof PtpPose) {
            return ((PtpPose) item.motion).target.xyz;
        }
        if (item.motion instanceof Lin) {
            return ((Lin) item.motion).target.xyz;
        }
        if (item.motion instanceof Circ) {
            Circ arc = (Circ) item.motion;
            check(start, arc.via, arc.end, path);
            return arc.end.xyz;
        }
        if (!(item.motion instanceof Spline)) {
            return null;
        }
        double[] here = start;
        SplineSegment[] segments = ((Spline) item.motion).segments;
        for (int i = 0; i < segments.length; i++) {
            if (segments[i] instanceof CircSegment) {
                CircSegment arc = (CircSegment) segments[i];
                check(here, arc.via, arc.end, path + "segments[" + i + "].");
                here = arc.end.xyz;
            } else {
                here = (segments[i] instanceof LinSegment ? ((LinSegment) segments[i]).target : ((SplSegment) segments[i]).target).xyz;
            }
        }
        return here;
    }

    /** Refuse points that define no circle; an unknown start is null. */
    private static void check(double[] start, Pose via, Pose end, String path) throws CommandRejected {
        apart("via and end", minus(end.xyz, via.xyz), path + "via", REMEDY);
        if (start == null) {
            return;
        }
        double[] toVia = minus(via.xyz, start);
        double[] toEnd = minus(end.xyz, start);
        apart("start and via", toVia, path + "via", REMEDY);
        apart("start and end", toEnd, path + "end", "a full circle is two arcs: give the opposite point as the first end");
        double[] normal = {toVia[1] * toEnd[2] - toVia[2] * toEnd[1], toVia[2] * toEnd[0] - toVia[0] * toEnd[2],
            toVia[0] * toEnd[1] - toVia[1] * toEnd[0]};
        double sine = length(normal) / (length(toVia) * length(toEnd));
        if (!(sine >= FLAT)) {
            String angle = String.format(Locale.ROOT, "%.3g", Math.asin(Math.min(1.0, sine)));
            throw new CommandRejected(Code.OUT_OF_RANGE, path + "via", angle, "[" + FLAT + ", pi/2] rad",
                    "start, via and end lie on a line: seen from the start, via must be at least " + FLAT
                            + " rad beside the direction to the end, got " + angle + " rad; move via off the line, or use a straight line");
        }
    }

    private static void apart(String what, double[] between, String parameter, String remedy) throws CommandRejected {
        double distance = length(between);
        if (!(distance >= LEAST)) {
            String text = String.format(Locale.ROOT, "%.3g", distance);
            throw new CommandRejected(Code.OUT_OF_RANGE, parameter, text, "[" + LEAST + ", inf) m",
                    "the points of a circle must be at least " + LEAST + " m apart, got " + what + " " + text + " m apart; " + remedy);
        }
    }

    private static double[] minus(double[] a, double[] b) {
        return new double[] {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    }

    private static double length(double[] v) {
        return Math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    }
}
