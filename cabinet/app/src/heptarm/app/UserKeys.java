package heptarm.app;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKey;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKeyBar;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKeyListener;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyAlignment;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyEvent;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyLED;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyLEDSize;

import heptarm.core.Log;
import heptarm.core.Server;

/** Keys at the smartPAD for a person beside the robot: stop what moves, take control away from whoever has it. */
final class UserKeys {
    private static final String BAR = "heptarm";

    private UserKeys() {
    }

    static void publish(RoboticsAPIApplication application, final Server server, final Log log) {
        IUserKeyBar bar = application.getApplicationUI().createUserKeyBar(BAR);
        add(bar, 0, "stop", UserKeyLED.Red, log, new Runnable() {
            public void run() {
                server.stop("stopped at the smartPAD");
            }
        });
        add(bar, 1, "release", UserKeyLED.Yellow, log, new Runnable() {
            public void run() {
                server.revokeControl("released at the smartPAD");
            }
        });
        bar.publish();
    }

    private static void add(IUserKeyBar bar, int slot, String text, UserKeyLED led, final Log log, final Runnable action) {
        IUserKey key = bar.addUserKey(slot, new IUserKeyListener() {
            public void onKeyEvent(IUserKey pressed, UserKeyEvent event) {
                if (event == UserKeyEvent.KeyDown) {
                    act(action, log);
                }
            }
        }, true);
        key.setText(UserKeyAlignment.TopMiddle, text);
        key.setLED(UserKeyAlignment.BottomMiddle, led, UserKeyLEDSize.Small);
    }

    /** In a thread of its own: a listener that takes its time upsets the cabinet. */
    private static void act(final Runnable action, final Log log) {
        Thread thread = new Thread(new Runnable() {
            public void run() {
                try {
                    action.run();
                } catch (RuntimeException e) {
                    log.error("a key at the smartPAD", e);
                }
            }
        }, "ha-key");
        thread.setDaemon(true);
        thread.start();
    }
}
