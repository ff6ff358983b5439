package heptarm.core.robot;

import heptarm.core.CommandRejected;
import heptarm.wire.AskOperator;
import heptarm.wire.SetKey;

/** The smartPAD and the process data of the project. */
public interface PanelPort {
    /** Set text and LED of a user key for clients. */
    void setKey(SetKey key) throws CommandRejected;

    /** A process data value as text. */
    String processData(String name) throws CommandRejected;

    /** Set a process data value; the text must parse as the value's type. */
    void setProcessData(String name, String value) throws CommandRejected;

    /** Show a dialog and wait for the operator, for as long as that takes; returns the index of the pressed button. */
    int ask(AskOperator dialog);

    /** Show a message to the operator. */
    void show(int severity, String text);
}
