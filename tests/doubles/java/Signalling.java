package sample;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.positionHold;

import java.io.PrintWriter;
import java.util.concurrent.TimeUnit;
import java.util.concurrent.atomic.AtomicInteger;

import javax.inject.Inject;
import javax.inject.Singleton;

import com.kuka.common.ThreadUtil;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.conditionModel.BooleanIOCondition;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.ioModel.AbstractIOGroup;
import com.kuka.roboticsAPI.ioModel.IOTypes;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.uiModel.ApplicationDialogType;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKey;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKeyBar;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKeyListener;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyAlignment;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyEvent;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyLED;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyLEDSize;

/** IO groups and user keys as a Sunrise programmer writes them; the test plays the world through standard input. */
public class Signalling extends RoboticsAPIApplication {
    /** Of the kind that a project generates. */
    @Singleton
    public static class FlangeIOGroup extends AbstractIOGroup {
        @Inject
        public FlangeIOGroup(Controller controller) {
            super(controller, "MediaFlange");
            addInput("UserButton", IOTypes.BOOLEAN, 1);
            addInput("Pressure", IOTypes.ANALOG, 12, 0, 10);
            addDigitalOutput("LEDBlue", IOTypes.BOOLEAN, 1);
            addDigitalOutput("Part", IOTypes.UNSIGNED_INTEGER, 8);
            addAnalogOutput("Valve", IOTypes.ANALOG, 12, 0, 10);
        }

        public boolean getUserButton() {
            return getBooleanIOValue("UserButton", false);
        }

        public double getPressure() {
            return getAnalogIOValue("Pressure", false);
        }

        public boolean getLEDBlue() {
            return getBooleanIOValue("LEDBlue", true);
        }

        public void setLEDBlue(Boolean value) {
            setDigitalOutput("LEDBlue", value);
        }

        public Long getPart() {
            return getNumberIOValue("Part", true).longValue();
        }

        public void setPart(Long value) {
            setDigitalOutput("Part", value);
        }

        public double getValve() {
            return getAnalogIOValue("Valve", true);
        }

        public void setValve(double value) {
            setAnalogOutput("Valve", value);
        }
    }

    @Inject
    private LBR lbr;
    @Inject
    private FlangeIOGroup flange;

    private PrintWriter out;

    @Override
    public void initialize() {
        try {
            String file = getApplicationData().getProcessData("sample.file").getValue();
            out = new PrintWriter(file, "UTF-8");
        } catch (java.io.IOException e) {
            throw new IllegalStateException(e);
        }
    }

    @Override
    public void run() throws Exception {
        flange.setLEDBlue(true);
        flange.setPart(200L);
        flange.setValve(2.5);
        say("outputs are read back", flange.getLEDBlue() && flange.getPart() == 200 && flange.getValve() == 2.5);
        int refused = 0;
        for (int i = 0; i < 4; i++) {
            try {
                if (i == 0) {
                    flange.setPart(256L);
                } else if (i == 1) {
                    flange.setValve(10.5);
                } else if (i == 2) {
                    flange.getInput("Knob");
                } else {
                    flange.getIO("UserButton", true);
                }
            } catch (IllegalArgumentException e) {
                refused++;
            }
        }
        say("bad values and names throw", refused == 4);
        final AtomicInteger pressed = new AtomicInteger();
        IUserKeyBar bar = getApplicationUI().createUserKeyBar("cell");
        IUserKey key = bar.addUserKey(1, new IUserKeyListener() {
            public void onKeyEvent(IUserKey one, UserKeyEvent event) {
                pressed.addAndGet(event == UserKeyEvent.KeyDown ? 1 : 100);
                one.setLED(UserKeyAlignment.BottomMiddle, UserKeyLED.Green, UserKeyLEDSize.Normal);
            }
        }, true);
        key.setText(UserKeyAlignment.TopMiddle, "go");
        bar.publish();
        say("READY", true);
        IMotionContainer hold = lbr.move(positionHold(null, 60, TimeUnit.SECONDS)
                .breakWhen(new BooleanIOCondition(flange.getInput("UserButton"), true)));
        say("the button ends a motion", hold.getFiredBreakConditionInfo() != null && flange.getUserButton());
        say("an analog input is what the world makes it", flange.getPressure() == 6.5);
        boolean waited = getObserverManager().waitFor(
                new BooleanIOCondition(flange.getInput("UserButton"), false), 30, TimeUnit.SECONDS);
        say("and its release is waited for", waited);
        for (int i = 0; i < 600 && pressed.get() < 101; i++) {
            ThreadUtil.milliSleep(50);
        }
        say("a key is pressed and released", pressed.get() == 101 && key.getSlot() == 1);
        say("ASKED", true);
        int answer = getApplicationUI().displayModalDialog(ApplicationDialogType.QUESTION, "Go on?", "no", "yes");
        say("a dialog is answered", answer == 1);
        boolean many = false;
        try {
            getApplicationUI().displayModalDialog(ApplicationDialogType.INFORMATION, "no buttons");
        } catch (IllegalArgumentException e) {
            many = true;
        }
        say("a dialog has buttons", many);
    }

    private void say(String what, boolean is) {
        out.println(what + " = " + is);
        out.flush();
    }
}
