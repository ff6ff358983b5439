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
import heptarm.wire.KeyLed;
import heptarm.wire.SetKey;

/**
 * Keys at the smartPAD for a person beside the robot: stop what moves, take control away from whoever has it; and a bar of four
 * for clients, who say what is on them and hear when they are pressed.
 */
final class UserKeys {
    private static final String BAR = "heptarm";
    private static final String CLIENT_BAR = "client";
    private static final int SLOTS = 4;

    private final IUserKey[] forClients = new IUserKey[SLOTS];

    private UserKeys(RoboticsAPIApplication application, final Server server, final Log log) {
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

    /** What a client wants on a key. */
    void set(SetKey wish) {
        IUserKey key = forClients[wish.slot];
        key.setText(UserKeyAlignment.TopMiddle, wish.text);
        key.setLED(UserKeyAlignment.BottomMiddle, led(wish.led), UserKeyLEDSize.Small);
        key.setEnabled(wish.enabled);
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

    static UserKeys publish(RoboticsAPIApplication application, final Server server, final Log log) {
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
