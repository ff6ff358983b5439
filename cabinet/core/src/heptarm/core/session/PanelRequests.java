package heptarm.core;

import heptarm.wire.Accepted;
import heptarm.wire.Code;
import heptarm.wire.GetProcessData;
import heptarm.wire.Message;
import heptarm.wire.ProcessData;
import heptarm.wire.SetKey;
import heptarm.wire.SetProcessData;
import heptarm.wire.SetSignals;
import heptarm.wire.ShowMessage;

/** Requests that concern the cabinet's signals, its smartPAD and its process data. */
final class Panel {
    private static final String OWN = "heptarm.";
    private static final String SECRET = "heptarm.key";

    private Panel() {
    }

    static boolean concerns(Message message) {
        return message instanceof SetSignals || message instanceof SetKey || message instanceof ShowMessage
                || message instanceof GetProcessData || message instanceof SetProcessData;
    }

    /** Carries one out; returns its answer. */
    static Message answer(Server server, Message message) throws Refusal {
        if (message instanceof SetSignals) {
            server.signals.write((SetSignals) message);
        } else if (message instanceof SetKey) {
            server.robot.setKey((SetKey) message);
        } else if (message instanceof ShowMessage) {
            server.robot.show(((ShowMessage) message).severity.value(), ((ShowMessage) message).text);
        } else if (message instanceof SetProcessData) {
            SetProcessData wish = (SetProcessData) message;
            if (wish.name.startsWith(OWN)) {
                throw new Refusal(Code.UNSUPPORTED, "name", wish.name, "", "settings of heptarm itself are made at the smartPAD");
            }
            server.robot.setProcessData(wish.name, wish.value);
        } else {
            String name = ((GetProcessData) message).name;
            if (SECRET.equals(name)) {
                throw new Refusal(Code.UNSUPPORTED, "name", name, "", "the key is told to nobody");
            }
            return new ProcessData(name, server.robot.processData(name));
        }
        return new Accepted(0);
    }
}
