package heptarm.core;

import heptarm.wire.Action;
import heptarm.wire.Code;
import heptarm.wire.Hold;
import heptarm.wire.Item;
import heptarm.wire.JointState;
import heptarm.wire.Notify;
import heptarm.wire.PathReached;
import heptarm.wire.SetSignal;
import heptarm.wire.Trigger;
import heptarm.wire.TriggerFired;

/** Triggers of motions: what is refused, and what is done and told when one fires. */
final class Triggers {
    private Triggers() {
    }

    /** Refuses those that would never fire, and actions that cannot be done. */
    static void check(Server server, Item item, String path) throws Refusal {
        for (int i = 0; i < item.triggers.length; i++) {
            Trigger one = item.triggers[i];
            String at = path + "triggers[" + i + "].";
            if (one.condition.nodes.length == 0) {
                throw new Refusal(Code.BAD_CONDITION, at + "condition", "", "", "a trigger without a condition never fires");
            }
            server.dispatcher.checkCondition(one.condition, at + "condition");
            if (item.motion instanceof Hold && Conditions.contains(one.condition, PathReached.class)) {
                throw new Refusal(Code.BAD_CONDITION, at + "condition", "PathReached", "", "a hold has no path");
            }
            if (!server.robot.watches(one.condition)) {
                throw new Refusal(Code.UNSUPPORTED, at + "condition", "SignalOutside", "SignalIs and the others",
                        "the robot does not watch number signals for triggers");
            }
            if (one.action instanceof SetSignal) {
                server.signals.check((SetSignal) one.action, at + "action");
            }
        }
    }

    /** Carries out the action of one that has fired, and tells of it. */
    static void act(Server server, Program program, int item, int trigger) {
        Action action = program.run.items[item].triggers[trigger].action;
        double time = (server.clock.nanos() - program.began) * 1e-9;
        int code = 0;
        String text = "";
        if (action instanceof SetSignal) {
            try {
                server.signals.write((SetSignal) action);
            } catch (Refusal e) {
                code = e.code;
                text = e.getMessage();
            } catch (RuntimeException e) {
                code = Code.EXECUTION_FAILED;
                text = String.valueOf(e.getMessage());
            }
        }
        JointState joints = null;
        try {
            joints = server.sampler.joints();
        } catch (RuntimeException e) { // the firing is told of in any case
            server.log.error("reading the joints when a trigger of motion " + program.id + " fired", e);
        }
        String label = action instanceof Notify ? ((Notify) action).label : "";
        server.broadcast(new TriggerFired(program.id, item, trigger, label, time, joints, code, text));
    }
}
