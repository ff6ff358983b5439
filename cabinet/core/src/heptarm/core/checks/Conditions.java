package heptarm.core.checks;

import java.util.ArrayList;
import java.util.List;

import heptarm.core.CommandRejected;
import heptarm.core.state.SignalTable;
import heptarm.wire.AllOf;
import heptarm.wire.AnyOf;
import heptarm.wire.Code;
import heptarm.wire.Condition;
import heptarm.wire.ConditionNode;
import heptarm.wire.Inverted;
import heptarm.wire.IoType;
import heptarm.wire.PathReached;
import heptarm.wire.PathReference;
import heptarm.wire.SignalInfo;
import heptarm.wire.SignalIs;
import heptarm.wire.SignalOutside;

/** Conditions as trees, and checks between their fields; the generated code checks the range of each field. */
public final class Conditions {
    private static final Tree[] NONE = new Tree[0];

    private Conditions() {
    }

    /** A node with its operands. */
    public static final class Tree {
        /** Index in the postfix list; identifies the node when it fires. */
        public final int index;
        public final ConditionNode node;
        public final Tree[] parts;

        Tree(int index, ConditionNode node, Tree[] parts) {
            this.index = index;
            this.node = node;
            this.parts = parts;
        }
    }

    /** The trees of which any true one fires the condition: the operands of an AnyOf at the root, otherwise the root. */
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

    /** Whether a condition contains a node of a kind. */
    public static boolean contains(Condition condition, Class<? extends ConditionNode> kind) {
        for (ConditionNode node : condition.nodes) {
            if (kind.isInstance(node)) {
                return true;
            }
        }
        return false;
    }

    /** The tree of a condition with at least one node. */
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

    /** Refuses a condition that is malformed, or refers to an unknown signal. */
    public static void check(Condition condition, String path, SignalInfo[] signals) throws CommandRejected {
        int results = 0;
        for (int i = 0; i < condition.nodes.length; i++) {
            String at = path + ".nodes[" + i + "]";
            ConditionNode node = condition.nodes[i];
            if (arity(node) > results) {
                throw new CommandRejected(Code.BAD_CONDITION, at, node.getClass().getSimpleName() + " of " + arity(node),
                        "at most " + results, "it combines " + arity(node) + " results, but there are only " + results);
            }
            results += 1 - arity(node);
            check(node, at, signals);
        }
        if (condition.nodes.length > 0 && results != 1) {
            throw new CommandRejected(Code.BAD_CONDITION, path + ".nodes", Integer.toString(results), "1",
                    "the nodes must leave 1 result, got " + results + "; combine them with AllOf or AnyOf");
        }
    }

    private static void check(ConditionNode node, String at, SignalInfo[] signals) throws CommandRejected {
        if (node.low() >= node.high()) {
            throw new CommandRejected(Code.OUT_OF_RANGE, at + ".low", Double.toString(node.low()), "below " + node.high(),
                    "low must be below high (" + node.high() + "), got " + node.low());
        }
        if (node instanceof SignalOutside) {
            SignalTable.index(((SignalOutside) node).signal, signals, at + ".signal");
        } else if (node instanceof SignalIs) {
            SignalInfo info = signals[SignalTable.index(((SignalIs) node).signal, signals, at + ".signal")];
            if (info.type != IoType.BOOLEAN) {
                throw new CommandRejected(Code.BAD_CONDITION, at + ".signal", info.name, "a boolean signal",
                        info.name + " is a number signal; compare it, as in io[\"" + info.name + "\"] > 5");
            }
        } else if (node instanceof PathReached) {
            PathReached point = (PathReached) node;
            boolean fromStart = point.reference == PathReference.START;
            if (fromStart ? point.distance < 0 : point.distance > 0) {
                throw new CommandRejected(Code.OUT_OF_RANGE, at + ".distance", Double.toString(point.distance),
                        fromStart ? "[0.0, 100.0] m" : "[-100.0, 0.0] m",
                        "distance must be " + (fromStart ? "0 m or more from the start" : "0 m or less from the destination") + ", got "
                                + point.distance + " m");
            }
        }
    }
}
