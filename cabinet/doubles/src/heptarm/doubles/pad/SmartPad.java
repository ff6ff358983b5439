package heptarm.doubles.pad;

import java.util.ArrayList;
import java.util.List;
import java.util.Objects;
import java.util.concurrent.CopyOnWriteArrayList;
import java.util.concurrent.ExecutorService;
import java.util.concurrent.Executors;

import com.kuka.roboticsAPI.uiModel.ApplicationDialogType;
import com.kuka.roboticsAPI.uiModel.IApplicationUI;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKey;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKeyBar;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKeyListener;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyAlignment;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyEvent;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyLED;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyLEDSize;

import heptarm.doubles.runtime.ApplicationServices;

/** User keys and dialogs of the smartPAD, operated by the simulated operator. */
public final class SmartPad implements IApplicationUI {
    private static final int SLOTS = 4;
    /** Bar of the keys that heptarm's clients set. */
    private static final String CLIENT_BAR = "client";
    private static final UserKeyEvent[] SINGLE = {UserKeyEvent.KeyDown, UserKeyEvent.KeyUp};
    private static final UserKeyEvent[] FIRST = {UserKeyEvent.FirstKeyDown, UserKeyEvent.FirstKeyUp};
    private static final UserKeyEvent[] SECOND = {UserKeyEvent.SecondKeyDown, UserKeyEvent.SecondKeyUp};

    private final List<Bar> bars = new CopyOnWriteArrayList<>();
    private final ExecutorService presses = Executors.newSingleThreadExecutor(task -> {
        Thread thread = new Thread(task, "user-keys");
        thread.setDaemon(true);
        return thread;
    });

    public final DialogQueue dialogs = new DialogQueue();

    @Override
    public int displayModalDialog(ApplicationDialogType type, String text, String... buttons) {
        return dialogs.ask(type, text, buttons);
    }

    @Override
    public IUserKeyBar createUserKeyBar(String name) {
        return new Bar(name);
    }

    /**
     * Presses and releases a key of a published bar; slots from 4 are second halves of double keys. Without a name: of the bar for
     * heptarm's clients if there is one, otherwise of the only bar that has the key. Its listener is called by a thread of the smartPAD.
     *
     * @return false if the key is missing, disabled, or in several bars
     */
    public boolean press(String bar, int slot) {
        String named = bar.isEmpty() && bars.stream().anyMatch(one -> one.name.equals(CLIENT_BAR)) ? CLIENT_BAR : bar;
        List<Key> found = bars.stream().filter(one -> named.isEmpty() || one.name.equals(named)).map(one -> one.key(slot))
                .filter(Objects::nonNull).toList();
        if (found.isEmpty() || named.isEmpty() && found.size() > 1) {
            return false;
        }
        Key pressed = found.get(0);
        boolean second = slot >= SLOTS;
        UserKeyEvent[] events = second ? SECOND : pressed.isDouble ? FIRST : SINGLE;
        presses.execute(() -> {
            try {
                pressed.listener.onKeyEvent(pressed, events[0]);
                pressed.listener.onKeyEvent(pressed, events[1]);
            } catch (Throwable e) { // of the application: further keys work
                ApplicationServices.current().logger.error("the listener of a user key ended with an error", e);
            }
        });
        return true;
    }

    /** What can be pressed: slot, text and bar of each published key, separated by commas. */
    public String keys() {
        List<String> all = new ArrayList<>();
        for (Bar one : bars) {
            for (Key key : one.keys) {
                String text = key.text.isEmpty() ? "" : " (" + key.text + ")";
                all.add("press " + key.slot + " " + one.name + text + (key.enabled ? "" : ", disabled"));
            }
        }
        return String.join(", ", all);
    }

    /** Text on a key of a published bar; null if there is no such key. */
    public String text(String bar, int slot) {
        Key key = find(bar, slot);
        return key == null ? null : key.text;
    }

    /** LED of a key; null if it has none or there is no such key. */
    public UserKeyLED led(String bar, int slot) {
        Key key = find(bar, slot);
        return key == null ? null : key.led;
    }

    private Key find(String bar, int slot) {
        for (Bar one : bars) {
            for (Key key : one.keys) {
                if (one.name.equals(bar) && key.slot == slot) {
                    return key;
                }
            }
        }
        return null;
    }

    private final class Bar implements IUserKeyBar {
        private final String name;
        private final List<Key> keys = new ArrayList<>();

        Bar(String name) {
            this.name = name;
        }

        @Override
        public IUserKey addUserKey(int slot, IUserKeyListener listener, boolean ignoreEvents) {
            if (slot < 0 || slot >= SLOTS) {
                throw new IllegalArgumentException("slot must be in [0, " + (SLOTS - 1) + "], got " + slot);
            }
            if (bars.contains(this)) {
                throw new IllegalStateException("cannot add a key: bar " + name + " is already published; add keys before publish()");
            }
            Key key = new Key(slot, listener);
            keys.add(key);
            return key;
        }

        @Override
        public IUserKey addDoubleUserKey(int slot, IUserKeyListener listener, boolean ignoreEvents) {
            Key key = (Key) addUserKey(slot, listener, ignoreEvents);
            key.isDouble = true;
            return key;
        }

        @Override
        public void publish() {
            bars.add(this);
        }

        /** The enabled key of a slot, or with that second half; null: there is none. */
        Key key(int slot) {
            for (Key key : keys) {
                if (key.slot == slot % SLOTS && key.enabled && (key.isDouble || slot < SLOTS)) {
                    return key;
                }
            }
            return null;
        }
    }

    private static final class Key implements IUserKey {
        private final int slot;
        private final IUserKeyListener listener;
        private volatile String text = "";
        private volatile UserKeyLED led;
        private volatile boolean enabled = true;
        private volatile boolean isDouble;

        Key(int slot, IUserKeyListener listener) {
            this.slot = slot;
            this.listener = listener;
        }

        @Override
        public void setText(UserKeyAlignment alignment, String value) {
            text = value;
        }

        @Override
        public void setLED(UserKeyAlignment alignment, UserKeyLED value, UserKeyLEDSize size) {
            led = value;
        }

        @Override
        public void setEnabled(boolean value) {
            enabled = value;
        }

        @Override
        public int getSlot() {
            return slot;
        }
    }
}
