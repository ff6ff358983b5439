package heptarm.app;

import com.kuka.roboticsAPI.applicationModel.IApplicationData;
import com.kuka.roboticsAPI.persistenceModel.PersistenceException;
import com.kuka.roboticsAPI.persistenceModel.processDataModel.IProcessData;
import com.kuka.roboticsAPI.uiModel.ApplicationDialogType;
import com.kuka.roboticsAPI.uiModel.IApplicationUI;

import heptarm.core.CommandRejected;
import heptarm.core.Log;
import heptarm.core.robot.PanelPort;
import heptarm.wire.AskOperator;
import heptarm.wire.Code;
import heptarm.wire.DialogKind;
import heptarm.wire.SetKey;

/** The smartPAD and the process data of the project. */
final class SunrisePanel implements PanelPort {
    private static final int INFO = 0;

    private final IApplicationData data;
    private final IApplicationUI pad;
    private final Log log;
    private volatile UserKeys keys;

    SunrisePanel(IApplicationData data, IApplicationUI pad, Log log) {
        this.data = data;
        this.pad = pad;
        this.log = log;
    }

    /** Use published user keys from now on. */
    void use(UserKeys published) {
        keys = published;
    }

    public void setKey(SetKey key) throws CommandRejected {
        UserKeys published = keys;
        if (published == null) {
            throw new CommandRejected(Code.UNSUPPORTED, "this cabinet has no user keys; its Sunrise version is too old");
        }
        published.set(key);
    }

    public String processData(String name) throws CommandRejected {
        Object value = find(name).getValue();
        return value == null ? "" : value.toString();
    }

    public void setProcessData(String name, String text) throws CommandRejected {
        IProcessData found = find(name);
        Object old = found.getValue();
        try {
            found.setValue(like(old, text));
        } catch (RuntimeException e) {
            String type = old == null ? "text" : old.getClass().getSimpleName();
            throw new CommandRejected(Code.OUT_OF_RANGE, "value", text, type, name + " must be of type " + type + ", got " + text + " (" + e.getMessage() + ")");
        }
    }

    public int ask(AskOperator dialog) {
        return pad.displayModalDialog(type(dialog.kind), dialog.text, dialog.buttons);
    }

    private static ApplicationDialogType type(DialogKind kind) {
        switch (kind) {
            case INFO:
                return ApplicationDialogType.INFORMATION;
            case WARNING:
                return ApplicationDialogType.WARNING;
            case ERROR:
                return ApplicationDialogType.ERROR;
            default:
                return ApplicationDialogType.QUESTION;
        }
    }

    public void show(int severity, String text) {
        if (severity == INFO) {
            log.info(text);
        } else {
            log.warn(text);
        }
    }

    private IProcessData find(String name) throws CommandRejected {
        try {
            return data.getProcessData(name);
        } catch (PersistenceException e) {
            throw new CommandRejected(Code.UNKNOWN_NAME, "name", name, "",
                    "the project has no process data " + name + "; add it in Sunrise Workbench");
        }
    }

    /** Parse a text as a value of the old value's type. */
    private static Object like(Object old, String text) {
        if (old instanceof Integer) {
            return Integer.valueOf(text.trim());
        }
        if (old instanceof Double) {
            return Double.valueOf(text.trim());
        }
        if (old instanceof Boolean) {
            if (!"true".equals(text.trim()) && !"false".equals(text.trim())) {
                throw new IllegalArgumentException("true or false expected");
            }
            return Boolean.valueOf(text.trim());
        }
        return text;
    }
}
