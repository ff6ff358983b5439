package com.kuka.roboticsAPI.persistenceModel.processDataModel;

/** A value that the operator can set at the smartPAD. */
public interface IProcessData {
    <T> T getValue();

    void setValue(Object value);

    void setDefaultValue(Object value);
}
