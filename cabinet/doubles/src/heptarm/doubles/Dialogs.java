package heptarm.doubles;

import com.kuka.roboticsAPI.uiModel.ApplicationDialogType;

/** Dialogs of the smartPAD, one at a time, answered by whoever plays the operator. */
public final class Dialogs {
    private static final int MOST_BUTTONS = 12;

    private String shown;
    private int buttons;
    private int answer = -1;

    /** Shows a dialog and waits for its answer: the index of the button that was pressed. */
    synchronized int ask(ApplicationDialogType type, String text, String... labels) {
        if (labels.length < 1 || labels.length > MOST_BUTTONS) {
            throw new IllegalArgumentException("a dialog has 1 to " + MOST_BUTTONS + " buttons, not " + labels.length);
        }
        try {
            while (shown != null) {
                wait();
            }
            shown = text;
            buttons = labels.length;
            answer = -1;
            Desk.current().logger.info(type + ": " + text + " " + String.join(" / ", labels));
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

    /** Presses a button of the dialog that is shown; false if there is none. */
    public synchronized boolean press(int button) {
        if (shown == null || answer >= 0 || button < 0 || button >= buttons) {
            return false;
        }
        answer = button;
        notifyAll();
        return true;
    }

    /** What is asked; null: nothing. */
    public synchronized String text() {
        return shown;
    }
}
