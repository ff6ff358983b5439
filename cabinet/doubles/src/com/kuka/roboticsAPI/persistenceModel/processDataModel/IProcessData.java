package com.kuka.roboticsAPI.persistenceModel.processDataModel;

/** A value that the operator can set at the smartPAD. */
public interface IProcessData {
    /**
     * The value, of the type that the caller expects. Process data are numbers, truth values and texts, which are comparable; without
     * that bound a compiler of today would read {@code String.valueOf(data.getValue())} as the text of a char[], as Java 6 never did.
     */
    <T extends Object & Comparable<?>> T getValue();

    void setValue(Object value);

    void setDefaultValue(Object value);
}
