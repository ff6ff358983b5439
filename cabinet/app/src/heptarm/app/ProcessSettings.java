package heptarm.app;

import com.kuka.roboticsAPI.applicationModel.IApplicationData;
import com.kuka.roboticsAPI.persistenceModel.PersistenceException;

import heptarm.core.Log;

/** Settings of heptarm among the process data of an application; one that is missing has a usual value. */
final class ProcessSettings {
    private final IApplicationData data;
    private final Log log;

    ProcessSettings(IApplicationData data, Log log) {
        this.data = data;
        this.log = log;
    }

    String text(String name, String otherwise) {
        try {
            Object value = data.getProcessData(name).getValue();
            return value == null ? otherwise : value.toString();
        } catch (PersistenceException e) {
            return otherwise;
        }
    }

    double number(String name, double otherwise) {
        String value = text(name, "");
        try {
            return value.trim().length() == 0 ? otherwise : Double.parseDouble(value.trim());
        } catch (NumberFormatException e) {
            log.warn("process data " + name + " is " + value + ", which is no number; " + otherwise + " is used");
            return otherwise;
        }
    }
}
