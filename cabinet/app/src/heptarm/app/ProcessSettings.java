package heptarm.app;

import com.kuka.roboticsAPI.applicationModel.IApplicationData;
import com.kuka.roboticsAPI.persistenceModel.PersistenceException;

import heptarm.core.Log;

/** Settings of heptarm in the process data of an application; a missing one has its default, see {@link ProcessDefaults}. */
final class ProcessSettings {
    private final IApplicationData data;
    private final Log log;

    ProcessSettings(IApplicationData data, Log log) {
        this.data = data;
        this.log = log;
    }

    String text(String name) {
        String fallback = ProcessDefaults.of(name);
        try {
            Object value = data.getProcessData(name).getValue();
            return value == null ? fallback : value.toString();
        } catch (PersistenceException e) {
            return fallback;
        }
    }

    double number(String name) {
        String value = text(name).trim();
        String fallback = ProcessDefaults.of(name);
        try {
            return Double.parseDouble(value.length() == 0 ? fallback : value);
        } catch (NumberFormatException e) {
            log.warn("process data " + name + " must be a number, got " + value + "; using the default " + fallback);
            return Double.parseDouble(fallback);
        }
    }
}
