package heptarm.core.session;

import heptarm.core.CommandRejected;
import heptarm.core.robot.PanelPort;
import heptarm.core.robot.Robot;
import heptarm.core.state.SignalTable;
import heptarm.wire.Accepted;
import heptarm.wire.AskOperator;
import heptarm.wire.Code;
import heptarm.wire.GetProcessData;
import heptarm.wire.Message;
import heptarm.wire.ProcessData;
import heptarm.wire.SetKey;
import heptarm.wire.SetProcessData;
import heptarm.wire.SetSignals;
import heptarm.wire.ShowMessage;

/** Requests that concern the cabinet's signals, its smartPAD and its process data. */
final class PanelRequests {
    private static final String OWN = "heptarm.";
    private static final String SECRET = "heptarm.key";

    private final SignalTable signals;
    private final Robot robot;
    private final PanelPort panel;
    private final OperatorDialogs dialogs;

    PanelRequests(SignalTable signals, Robot robot, OperatorDialogs dialogs) {
        this.signals = signals;
        this.robot = robot;
        this.panel = robot.panel;
        this.dialogs = dialogs;
    }

    static boolean handles(Message message) {
        return message instanceof SetSignals || message instanceof SetKey || message instanceof ShowMessage || message instanceof AskOperator
                || message instanceof GetProcessData || message instanceof SetProcessData;
    }

    /** Execute a request; returns its answer. */
    Message execute(Message message) throws CommandRejected {
        if (message instanceof SetKey) {
            robot.require("user_keys", "", "user keys");
        } else if (message instanceof AskOperator) {
            robot.require("dialogs", "", "dialogs");
        } else if (message instanceof GetProcessData || message instanceof SetProcessData) {
            robot.require("process_data", "", "process data");
        }
        if (message instanceof SetSignals) {
            signals.write((SetSignals) message);
        } else if (message instanceof SetKey) {
            panel.setKey((SetKey) message);
        } else if (message instanceof ShowMessage) {
            panel.show(((ShowMessage) message).severity.value(), ((ShowMessage) message).text);
        } else if (message instanceof AskOperator) {
            return new Accepted(dialogs.ask((AskOperator) message));
        } else if (message instanceof SetProcessData) {
            SetProcessData request = (SetProcessData) message;
            if (request.name.startsWith(OWN)) {
                throw new CommandRejected(Code.UNSUPPORTED, "name", request.name, "",
                        request.name + " is a setting of heptarm itself; change it at the smartPAD");
            }
            panel.setProcessData(request.name, request.value);
        } else {
            String name = ((GetProcessData) message).name;
            if (SECRET.equals(name)) {
                throw new CommandRejected(Code.UNSUPPORTED, "name", name, "", "the pre-shared key cannot be read; look at the smartPAD");
            }
            return new ProcessData(name, panel.processData(name));
        }
        return new Accepted(0);
    }
}
