package heptarm.fake;

import java.util.concurrent.CountDownLatch;

import heptarm.core.CommandRejected;
import heptarm.core.robot.PanelPort;
import heptarm.wire.AskOperator;
import heptarm.wire.Code;
import heptarm.wire.SetKey;

/** Three user keys and two process data values. Messages order faults, and those that begin with "operator: " safety events. */
final class FakePanel implements PanelPort {
    private static final String OPERATOR = "operator: ";

    private final FakeFaults faults;
    private final FakeSafety safety;
    private volatile double speed = 0.5;
    private volatile String keyed = "";
    private final CountDownLatch answered = new CountDownLatch(1);

    FakePanel(FakeFaults faults, FakeSafety safety) {
        this.faults = faults;
        this.safety = safety;
    }

    @Override
    public void setKey(SetKey key) throws CommandRejected {
        if (key.slot == 3) {
            throw new CommandRejected(Code.UNSUPPORTED, "this cabinet has three user keys");
        }
        keyed = key.slot + " " + key.text + " " + key.led + " " + key.enabled;
    }

    @Override
    public String processData(String name) throws CommandRejected {
        if ("keyed".equals(name)) {
            return keyed;
        }
        if ("servo".equals(name)) {
            return Double.toString(faults.stiffness);
        }
        if (!"speed".equals(name)) {
            throw new CommandRejected(Code.UNKNOWN_NAME, "name", name, "", "no process data " + name);
        }
        return Double.toString(speed);
    }

    @Override
    public void setProcessData(String name, String value) throws CommandRejected {
        processData(name);
        try {
            speed = Double.parseDouble(value);
        } catch (NumberFormatException e) {
            throw new CommandRejected(Code.OUT_OF_RANGE, "value", value, "a number", value + " is no number");
        }
    }

    /** The operator presses the last button, unless the dialog is to stay until the thread ends. */
    @Override
    public int ask(AskOperator dialog) {
        if ("broken".equals(dialog.text)) {
            throw new IllegalStateException("the smartPAD is unplugged");
        }
        if ("stay".equals(dialog.text)) {
            try {
                answered.await();
            } catch (InterruptedException e) {
                throw new IllegalStateException(e);
            }
        }
        return dialog.buttons.length - 1;
    }

    @Override
    public void show(int severity, String text) {
        if ("answer".equals(text)) {
            answered.countDown();
        } else if (text.startsWith(OPERATOR)) {
            safety.operate(text.substring(OPERATOR.length()));
        } else {
            faults.order(text);
        }
    }
}
