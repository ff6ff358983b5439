package heptarm.core;

import java.util.Arrays;

import heptarm.wire.Blending;
import heptarm.wire.Circ;
import heptarm.wire.Condition;
import heptarm.wire.Encoder;
import heptarm.wire.Item;
import heptarm.wire.Lin;
import heptarm.wire.LinRel;
import heptarm.wire.Mode;
import heptarm.wire.Motion;
import heptarm.wire.PathReached;
import heptarm.wire.PositionMode;
import heptarm.wire.Ptp;
import heptarm.wire.PtpHome;
import heptarm.wire.PtpPose;

/** Which items of a program the robot gets as one batch, since one is blended into the next. */
final class Batches {
    private Batches() {
    }

    /** How many items from one on belong together: at least 1. */
    static int length(Item[] items, int first) {
        int last = first;
        while (last + 1 < items.length && isBlended(items[last].motion) && canBlend(items[last], items[last + 1])) {
            last++;
        }
        return last - first + 1;
    }

    private static boolean isBlended(Motion motion) {
        Blending blending = of(motion);
        return blending != null && (blending.relative > 0 || blending.distance > 0 || blending.orientation > 0);
    }

    /** Null: of a motion that has none. */
    private static Blending of(Motion motion) {
        if (motion instanceof Ptp) {
            return ((Ptp) motion).blending;
        }
        if (motion instanceof PtpHome) {
            return ((PtpHome) motion).blending;
        }
        if (motion instanceof PtpPose) {
            return ((PtpPose) motion).blending;
        }
        if (motion instanceof Lin) {
            return ((Lin) motion).blending;
        }
        if (motion instanceof LinRel) {
            return ((LinRel) motion).blending;
        }
        return motion instanceof Circ ? ((Circ) motion).blending : null;
    }

    /** A motion that another condition may end, that moves another frame or in another control mode begins and ends at rest. */
    private static boolean canBlend(Item one, Item next) {
        return of(next.motion) != null && one.frame.equals(next.frame) && canEndTogether(one.until, next.until)
                && Arrays.equals(octets(one.mode), octets(next.mode));
    }

    /** A point on the path is one of a single motion. */
    private static boolean canEndTogether(Condition one, Condition next) {
        Encoder first = new Encoder();
        Encoder second = new Encoder();
        one.write(first);
        next.write(second);
        return Arrays.equals(first.toBytes(), second.toBytes()) && !Conditions.contains(one, PathReached.class);
    }

    private static byte[] octets(Mode mode) {
        Encoder out = new Encoder();
        Mode known = mode == null ? new PositionMode() : mode;
        out.putU8(known.tag());
        known.write(out);
        return out.toBytes();
    }

    /** Hands a batch to the robot; called by the motion thread. */
    static void start(Server server, Program program, int first, int count) {
        Item[] items = Arrays.copyOfRange(program.run.items, first, first + count);
        Job.Listener[] listeners = new Job.Listener[count];
        for (int i = 0; i < count; i++) {
            listeners[i] = program.listener(first + i);
        }
        try {
            program.adopt(server.robot.start(items, items[0].mode == null ? new PositionMode() : items[0].mode, listeners));
        } catch (Refusal e) {
            for (int i = 1; i < count; i++) {
                program.skip(first + i);
            }
            listeners[0].finished(Job.Ended.FAILED, e.code, e.getMessage());
        }
    }
}
