package heptarm.core.session;

import heptarm.core.CommandRejected;
import heptarm.core.EventBus;
import heptarm.core.Log;
import heptarm.core.Threads;
import heptarm.core.robot.PanelPort;
import heptarm.wire.AskOperator;
import heptarm.wire.Code;
import heptarm.wire.DialogClosed;

/**
 * Asks the operator at the smartPAD, one dialog at a time.
 *
 * <p>A dialog of Sunrise blocks its thread until somebody presses a button, and no program can close it: each has a thread of
 * its own, and stays when the client that asked has gone. Its answer is then received by nobody.
 */
final class OperatorDialogs {
    private static final int MAX_LABEL = 64;

    private final PanelPort panel;
    private final EventBus events;
    private final Log log;
    private String shown;
    private long number;
    private Thread thread;

    OperatorDialogs(PanelPort panel, EventBus events, Log log) {
        this.panel = panel;
        this.events = events;
        this.log = log;
    }

    /** Show a dialog; returns its number. */
    synchronized long ask(final AskOperator request) throws CommandRejected {
        checkLabels(request.buttons);
        if (shown != null) {
            throw new CommandRejected(Code.BUSY, "text", request.text, "",
                    "the smartPAD still shows the dialog \"" + shown + "\"; press one of its buttons first");
        }
        shown = request.text;
        final long id = ++number;
        thread = Threads.start("ha-dialog", new Runnable() {
            public void run() {
                show(id, request);
            }
        });
        return id;
    }

    /** End the thread of a dialog that is still shown: the application ends. */
    void close() {
        Thread last;
        synchronized (this) {
            last = thread;
        }
        Threads.end(last);
    }

    private void show(long id, AskOperator request) {
        int button = -1;
        String problem = "";
        try {
            button = panel.ask(request);
        } catch (RuntimeException e) {
            problem = "the smartPAD could not show the dialog: " + e;
            log.warn(problem);
        } catch (LinkageError e) { // a class that this cabinet lacks
            problem = "this cabinet has no dialogs: " + e;
            log.warn(problem);
        }
        synchronized (this) {
            shown = null;
        }
        events.publish(new DialogClosed(id, button, problem));
    }

    private static void checkLabels(String[] labels) throws CommandRejected {
        for (int i = 0; i < labels.length; i++) {
            if (labels[i].length() < 1 || labels[i].length() > MAX_LABEL) {
                throw new CommandRejected(Code.BAD_LENGTH, "buttons[" + i + "]", labels[i], "1 to " + MAX_LABEL + " bytes",
                        "a button must have 1 to " + MAX_LABEL + " bytes, got " + labels[i].length());
            }
            for (int k = 0; k < i; k++) {
                if (labels[k].equals(labels[i])) {
                    throw new CommandRejected(Code.OUT_OF_RANGE, "buttons[" + i + "]", labels[i], "different labels",
                            "two buttons have the same label " + labels[i] + "; give each its own");
                }
            }
        }
    }
}
