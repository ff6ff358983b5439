package heptarm.core;

import java.util.ArrayList;
import java.util.List;

import heptarm.wire.AllOf;
import heptarm.wire.AnyOf;
import heptarm.wire.Code;
import heptarm.wire.Condition;
import heptarm.wire.ConditionNode;
import heptarm.wire.ForceAbove;
import heptarm.wire.ForceOutside;
import heptarm.wire.Inverted;
import heptarm.wire.IoType;
import heptarm.wire.JointTorqueOutside;
import heptarm.wire.NormalForceAbove;
import heptarm.wire.PathReached;
import heptarm.wire.PathReference;
import heptarm.wire.ShearForceAbove;
import heptarm.wire.SignalInfo;
import heptarm.wire.SignalIs;
import heptarm.wire.SignalOutside;
import heptarm.wire.TorqueOutside;

/** Conditions as trees, and what has to hold between their fields; the ranges of single fields are checked before. */
public final class Conditions {
    private static final Tree[] NONE = new Tree[0];

    private Conditions() {
    }

    /** A node with what it combines. */
    public static final class Tree {
        /** Its place in the postfix list, which names it when it fires. */
        public final int index;
        public final ConditionNode node;
        public final Tree[] parts;

        Tree(int index, ConditionNode node, Tree[] parts) {
            this.index = index;
            this.node = node;
            this.parts = parts;
        }
    }

    /** The trees of which one that holds fires the condition: the parts of an AnyOf at the root, otherwise the root. */
    public static Tree[] alternatives(Condition condition) {
        List<Tree> found = new ArrayList<Tree>();
        if (condition.nodes.length > 0) {
            split(tree(condition), found);
        }
        return found.toArray(NONE);
    }

    private static void split(Tree tree, List<Tree> found) {
        if (tree.node instanceof AnyOf) {
            for (Tree part : tree.parts) {
                split(part, found);
            }
        } else {
            found.add(tree);
        }
    }

    /** Whether a leaf of some kind is in it. */
    public static boolean contains(Condition condition, Class<? extends ConditionNode> kind) {
        for (ConditionNode node : condition.nodes) {
            if (kind.isInstance(node)) {
                return true;
            }
        }
        return false;
    }

    /** The whole of a condition that has nodes. */
    public static Tree tree(Condition condition) {
        List<Tree> stack = new ArrayList<Tree>();
        for (int i = 0; i < condition.nodes.length; i++) {
            ConditionNode node = condition.nodes[i];
            int from = stack.size() - arity(node);
            List<Tree> taken = stack.subList(from, stack.size());
            Tree tree = new Tree(i, node, taken.toArray(NONE));
            taken.clear();
            stack.add(tree);
        }
        return stack.get(0);
    }

    private static int arity(ConditionNode node) {
        if (node instanceof AllOf) {
            return ((AllOf) node).n;
        }
        return node instanceof AnyOf ? ((AnyOf) node).n : node instanceof Inverted ? 1 : 0;
    }

    /** Refuses a condition that is none, or asks for what is not there. */
    static void check(Condition condition, String path, SignalInfo[] signals) throws Refusal {
        int held = 0;
        for (int i = 0; i < condition.nodes.length; i++) {
            String at = path + ".nodes[" + i + "]";
            ConditionNode node = condition.nodes[i];
            if (arity(node) > held) {
                throw new Refusal(Code.BAD_CONDITION, at, node.getClass().getSimpleName() + " of " + arity(node),
                        "at most " + held, "it combines " + arity(node) + " results, but there are " + held);
            }
            held += 1 - arity(node);
            check(node, at, signals);
        }
        if (condition.nodes.length > 0 && held != 1) {
            throw new Refusal(Code.BAD_CONDITION, path + ".nodes", Integer.toString(held), "1",
                    "the nodes leave " + held + " results; they have to leave one");
        }
    }

    /** Name of the frame whose axes a leaf means; empty where it means none, or the moved frame's. */
    static String frame(ConditionNode node) {
        if (node instanceof ForceAbove) {
            return ((ForceAbove) node).frame;
        }
        if (node instanceof NormalForceAbove) {
            return ((NormalForceAbove) node).frame;
        }
        if (node instanceof ShearForceAbove) {
            return ((ShearForceAbove) node).frame;
        }
        if (node instanceof ForceOutside) {
            return ((ForceOutside) node).frame;
        }
        return node instanceof TorqueOutside ? ((TorqueOutside) node).frame : "";
    }

    private static void check(ConditionNode node, String at, SignalInfo[] signals) throws Refusal {
        if (node instanceof ForceOutside) {
            band(((ForceOutside) node).low, ((ForceOutside) node).high, at);
        } else if (node instanceof TorqueOutside) {
            band(((TorqueOutside) node).low, ((TorqueOutside) node).high, at);
        } else if (node instanceof JointTorqueOutside) {
            band(((JointTorqueOutside) node).low, ((JointTorqueOutside) node).high, at);
        } else if (node instanceof SignalOutside) {
            band(((SignalOutside) node).low, ((SignalOutside) node).high, at);
            Signals.of(((SignalOutside) node).signal, signals, at + ".signal");
        } else if (node instanceof SignalIs) {
            SignalInfo info = signals[Signals.of(((SignalIs) node).signal, signals, at + ".signal")];
            if (info.type != IoType.BOOLEAN) {
                throw new Refusal(Code.BAD_CONDITION, at + ".signal", info.name, "a boolean signal",
                        info.name + " is a number; compare it, as in io[\"" + info.name + "\"] > 5");
            }
        } else if (node instanceof PathReached) {
            PathReached point = (PathReached) node;
            boolean fromStart = point.reference == PathReference.START;
            if (fromStart ? point.distance < 0 : point.distance > 0) {
                throw new Refusal(Code.OUT_OF_RANGE, at + ".distance", Double.toString(point.distance),
                        fromStart ? "[0.0, 100.0] m" : "[-100.0, 0.0] m", "a point on the path lies behind the start and"
                                + " before the destination");
            }
        }
    }

    private static void band(double low, double high, String at) throws Refusal {
        if (!(low < high)) {
            throw new Refusal(Code.OUT_OF_RANGE, at + ".low", Double.toString(low), "below " + high,
                    "low is " + low + ", high is " + high + "; low has to be below high");
        }
    }
}
