package heptarm.doubles.pad;

import java.util.ArrayDeque;
import java.util.Queue;

import com.kuka.roboticsAPI.uiModel.ApplicationDialogType;

import heptarm.doubles.runtime.ApplicationServices;

/** Modal dialogs of the smartPAD, shown one at a time and answered by the simulated operator. */
public final class DialogQueue {
    private static final int MAX_BUTTONS = 12;

    private final Queue<Integer> scripted = new ArrayDeque<>();
    private String shown;
    private int buttons;
    private int answer = -1;

    /** Shows a dialog and waits for its answer: the index of the button that was pressed. */
    synchronized int ask(ApplicationDialogType type, String text, String... labels) {
        if (labels.length < 1 || labels.length > MAX_BUTTONS) {
            throw new IllegalArgumentException("a dialog must have 1 to " + MAX_BUTTONS + " buttons, got " + labels.length);
        }
        try {
            while (shown != null) {
                wait();
            }
            shown = text;
            buttons = labels.length;
            answer = -1;
            Integer next = scripted.poll();
            String question = type + ": " + text + " " + String.join(" / ", labels);
            if (next != null) {
                if (next < 0 || next >= labels.length) {
                    throw new IllegalArgumentException("the scripted answer to the dialog \"" + text + "\" must be 0 to "
                            + (labels.length - 1) + ", got " + next);
                }
                ApplicationServices.current().logger.info(question + ", answered " + next + ": " + labels[next]);
                return next;
            }
            ApplicationServices.current().logger.info(question + "; waits for the operator: " + remedy(labels));
            while (answer < 0) {
                wait();
            }
            return answer;
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
            throw new IllegalStateException("interrupted while a dialog was shown", e);
        } finally {
            shown = null;
            notifyAll();
        }
    }

    /** Appends an answer for a dialog to come: the scripted answers are used up in the order of the dialogs. */
    public synchronized void script(int button) {
        scripted.add(button);
    }

    /** What the operator types for each button. */
    private static String remedy(String... labels) {
        StringBuilder text = new StringBuilder("type ");
        for (int i = 0; i < labels.length; i++) {
            text.append(i == 0 ? "" : ", ").append("`answer ").append(i).append("` for ").append(labels[i]);
        }
        return text.toString();
    }

    /** Presses a button of the shown dialog; false if there is none or it has no such button. */
    public synchronized boolean press(int button) {
        if (shown == null || answer >= 0 || button < 0 || button >= buttons) {
            return false;
        }
        answer = button;
        notifyAll();
        return true;
    }

    /** Text of the dialog that is shown; null: none. */
    public synchronized String text() {
        return shown;
    }
}
