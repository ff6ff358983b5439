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
import heptarm.core.session.CabinetServer;
import heptarm.wire.KeyLed;
import heptarm.wire.SetKey;

/**
 * User keys at the smartPAD: stop the robot, take control away from the controller; and a bar of four keys for clients, which set
 * their text and LED and receive their events.
 */
final class UserKeys {
    private static final String BAR = "heptarm";
    private static final String CLIENT_BAR = "client";
    private static final int SLOTS = 4;

    private final IUserKey[] forClients = new IUserKey[SLOTS];

    private UserKeys(RoboticsAPIApplication application, final CabinetServer server, final Log log) {
        IUserKeyBar bar = application.getApplicationUI().createUserKeyBar(CLIENT_BAR);
        for (int i = 0; i < SLOTS; i++) {
            final int slot = i;
            forClients[i] = bar.addUserKey(i, new IUserKeyListener() {
                public void onKeyEvent(IUserKey pressed, UserKeyEvent event) {
                    final boolean down = event == UserKeyEvent.KeyDown;
                    if (down || event == UserKeyEvent.KeyUp) {
                        server.keyPressed(slot, down);
                    }
                }
            }, true);
            forClients[i].setEnabled(false);
        }
        bar.publish();
    }

    /** Set text and LED of a key for clients. */
    void set(SetKey request) {
        IUserKey key = forClients[request.slot];
        key.setText(UserKeyAlignment.TopMiddle, request.text);
        key.setLED(UserKeyAlignment.BottomMiddle, led(request.led), UserKeyLEDSize.Small);
        key.setEnabled(request.enabled);
    }

    private static UserKeyLED led(KeyLed led) {
        if (led == KeyLed.GREEN) {
            return UserKeyLED.Green;
        }
        if (led == KeyLed.YELLOW) {
            return UserKeyLED.Yellow;
        }
        return led == KeyLed.RED ? UserKeyLED.Red : UserKeyLED.Grey;
    }

    static UserKeys publish(RoboticsAPIApplication application, final CabinetServer server, final Log log) {
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
        return new UserKeys(application, server, log);
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

    /** Run the action in a thread of its own: a cabinet does not accept slow listeners. */
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
