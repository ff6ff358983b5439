package heptarm.doubles.pad;

import java.util.ArrayList;
import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;

import com.kuka.roboticsAPI.uiModel.ApplicationDialogType;
import com.kuka.roboticsAPI.uiModel.IApplicationUI;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKey;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKeyBar;
import com.kuka.roboticsAPI.uiModel.userKeys.IUserKeyListener;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyAlignment;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyEvent;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyLED;
import com.kuka.roboticsAPI.uiModel.userKeys.UserKeyLEDSize;

/** User keys and dialogs of the smartPAD, operated by the simulated operator. */
public final class SmartPad implements IApplicationUI {
    private static final int SLOTS = 4;
    private static final UserKeyEvent[] SINGLE = {UserKeyEvent.KeyDown, UserKeyEvent.KeyUp};
    private static final UserKeyEvent[] FIRST = {UserKeyEvent.FirstKeyDown, UserKeyEvent.FirstKeyUp};
    private static final UserKeyEvent[] SECOND = {UserKeyEvent.SecondKeyDown, UserKeyEvent.SecondKeyUp};

    private final List<Bar> bars = new CopyOnWriteArrayList<>();

    public final DialogQueue dialogs = new DialogQueue();

    @Override
    public int displayModalDialog(ApplicationDialogType type, String text, String... buttons) {
        return dialogs.ask(type, text, buttons);
    }

    @Override
    public IUserKeyBar createUserKeyBar(String name) {
        return new Bar(name);
    }

    /** Presses and releases a key of a published bar; slots from 4 are second halves of double keys. False if the key is missing or disabled. */
    public boolean press(String bar, int slot) {
        for (Bar one : bars) {
            if (one.name.equals(bar)) {
                return one.press(slot);
            }
        }
        return false;
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

        boolean press(int slot) {
            boolean second = slot >= SLOTS;
            for (Key key : keys) {
                if (key.slot == slot % SLOTS && key.enabled && (key.isDouble || !second)) {
                    UserKeyEvent[] events = second ? SECOND : key.isDouble ? FIRST : SINGLE;
                    key.listener.onKeyEvent(key, events[0]);
                    key.listener.onKeyEvent(key, events[1]);
                    return true;
                }
            }
            return false;
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
