package heptarm.app;

import com.kuka.roboticsAPI.applicationModel.IApplicationData;
import com.kuka.roboticsAPI.persistenceModel.PersistenceException;

import heptarm.core.Log;

/** Settings of heptarm in the process data of an application; a missing one has its default. */
final class ProcessSettings {
    private final IApplicationData data;
    private final Log log;

    ProcessSettings(IApplicationData data, Log log) {
        this.data = data;
        this.log = log;
    }

    String text(String name, String fallback) {
        try {
            Object value = data.getProcessData(name).getValue();
            return value == null ? fallback : value.toString();
        } catch (PersistenceException e) {
            return fallback;
        }
    }

    double number(String name, double fallback) {
        String value = text(name, "");
        try {
            return value.trim().length() == 0 ? fallback : Double.parseDouble(value.trim());
        } catch (NumberFormatException e) {
            log.warn("process data " + name + " must be a number, got " + value + "; using the default " + fallback);
            return fallback;
        }
    }
}
