package heptarm.core.motion;

import heptarm.core.Clock;
import heptarm.core.CommandRejected;
import heptarm.core.state.SignalTable;
import heptarm.wire.Action;
import heptarm.wire.Code;
import heptarm.wire.Notify;
import heptarm.wire.SetSignal;

/** Executes the actions of triggers that have fired, and reports them. */
public final class TriggerActions {
    private final SignalTable signals;
    private final MotionReporter reporter;
    private final Clock clock;

    public TriggerActions(SignalTable signals, MotionReporter reporter, Clock clock) {
        this.signals = signals;
        this.reporter = reporter;
        this.clock = clock;
    }

    void execute(Program program, int item, int trigger) {
        Action action = program.run.items[item].triggers[trigger].action;
        double time = (clock.nanos() - program.began) * 1e-9;
        int code = 0;
        String text = "";
        if (action instanceof SetSignal) {
            try {
                signals.write((SetSignal) action);
            } catch (CommandRejected e) {
                code = e.code;
                text = e.getMessage();
            } catch (RuntimeException e) {
                code = Code.EXECUTION_FAILED;
                text = String.valueOf(e.getMessage());
            }
        }
        String label = action instanceof Notify ? ((Notify) action).label : "";
        reporter.triggerFired(program.id, item, trigger, label, time, code, text);
    }
}
