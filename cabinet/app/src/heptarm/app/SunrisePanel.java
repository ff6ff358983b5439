package heptarm.app;

import com.kuka.roboticsAPI.applicationModel.IApplicationData;
import com.kuka.roboticsAPI.persistenceModel.PersistenceException;
import com.kuka.roboticsAPI.persistenceModel.processDataModel.IProcessData;

import heptarm.core.Refusal;
import heptarm.wire.Code;
import heptarm.wire.SetKey;

/** What a cabinet offers besides its robot: signals, user keys, process data; as far as the application was given them. */
final class CabinetPanel {
    /** None: of an application that does without. */
    final IoSignals signals;
    private final IApplicationData data;
    private volatile UserKeys keys;

    CabinetPanel(IoSignals signals, IApplicationData data) {
        this.signals = signals;
        this.data = data;
    }

    void show(UserKeys published) {
        keys = published;
    }

    void setKey(SetKey key) throws Refusal {
        UserKeys published = keys;
        if (published == null) {
            throw new Refusal(Code.UNSUPPORTED, "this cabinet has no user keys");
        }
        published.set(key);
    }

    String processData(String name) throws Refusal {
        Object value = find(name).getValue();
        return value == null ? "" : value.toString();
    }

    void setProcessData(String name, String text) throws Refusal {
        IProcessData found = find(name);
        Object old = found.getValue();
        try {
            found.setValue(like(old, text));
        } catch (RuntimeException e) {
            String type = old == null ? "text" : old.getClass().getSimpleName();
            throw new Refusal(Code.OUT_OF_RANGE, "value", text, type, name + " cannot become " + text + ": " + e.getMessage());
        }
    }

    private IProcessData find(String name) throws Refusal {
        try {
            if (data != null) {
                return data.getProcessData(name);
            }
        } catch (PersistenceException e) {
            throw new Refusal(Code.UNKNOWN_NAME, "name", name, "", "the project has no process data " + name);
        }
        throw new Refusal(Code.UNSUPPORTED, "this application has no process data");
    }

    /** A text as a value of another's type. */
    private static Object like(Object old, String text) {
        if (old instanceof Integer) {
            return Integer.valueOf(text.trim());
        }
        if (old instanceof Double) {
            return Double.valueOf(text.trim());
        }
        if (old instanceof Boolean) {
            if (!"true".equals(text.trim()) && !"false".equals(text.trim())) {
                throw new IllegalArgumentException("true or false is wanted");
            }
            return Boolean.valueOf(text.trim());
        }
        return text;
    }
}
