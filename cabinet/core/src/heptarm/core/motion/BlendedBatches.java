package heptarm.core.motion;

import java.util.Arrays;

import heptarm.core.checks.Conditions;
import heptarm.wire.Blending;
import heptarm.wire.Condition;
import heptarm.wire.Encoder;
import heptarm.wire.Item;
import heptarm.wire.Mode;
import heptarm.wire.Motion;
import heptarm.wire.PathReached;
import heptarm.wire.PositionMode;
import heptarm.wire.Reaction;

/** Decides which items of a program go to the robot as one batch, because each is blended into the next. */
final class BlendedBatches {
    private BlendedBatches() {
    }

    /** Number of items from an index on that form one batch: at least 1. */
    static int length(Item[] items, int first) {
        int last = first;
        while (last + 1 < items.length && isBlended(items[last].motion) && canBlend(items[last], items[last + 1])) {
            last++;
        }
        return last - first + 1;
    }

    private static boolean isBlended(Motion motion) {
        Blending blending = motion.blending();
        return blending != null && (blending.relative > 0 || blending.distance > 0 || blending.orientation > 0);
    }

    /** A motion with another break condition, reaction, motion frame or control mode starts and ends at rest. */
    private static boolean canBlend(Item one, Item next) {
        return next.motion.blending() != null && one.frame.equals(next.frame) && canEndTogether(one.until, next.until)
                && Arrays.equals(bytes(one.mode), bytes(next.mode)) && Arrays.equals(bytes(one.reaction), bytes(next.reaction));
    }

    /** A point on the path belongs to a single motion. */
    private static boolean canEndTogether(Condition one, Condition next) {
        Encoder first = new Encoder();
        Encoder second = new Encoder();
        one.write(first);
        next.write(second);
        return Arrays.equals(first.toBytes(), second.toBytes()) && !Conditions.contains(one, PathReached.class);
    }

    private static byte[] bytes(Reaction reaction) {
        Encoder out = new Encoder();
        if (reaction != null) {
            out.putU8(reaction.tag());
            reaction.write(out);
        }
        return out.toBytes();
    }

    private static byte[] bytes(Mode mode) {
        Encoder out = new Encoder();
        Mode effective = mode == null ? new PositionMode() : mode;
        out.putU8(effective.tag());
        effective.write(out);
        return out.toBytes();
    }
}
