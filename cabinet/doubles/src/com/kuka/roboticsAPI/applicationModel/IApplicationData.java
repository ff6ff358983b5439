package com.kuka.roboticsAPI.applicationModel;

import com.kuka.roboticsAPI.persistenceModel.processDataModel.IProcessData;

/** Data of the project. Unknown names throw a PersistenceException. */
public interface IApplicationData {
    IProcessData getProcessData(String id);
}
