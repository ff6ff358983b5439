package com.kuka.roboticsAPI.applicationModel;

import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.persistenceModel.processDataModel.IProcessData;

/** Data of the project. Unknown names throw a PersistenceException. */
public interface IApplicationData {
    IProcessData getProcessData(String id);

    /** The same; null: there are none of that name. */
    IProcessData tryGetProcessData(String id);

    /** A new tool or workpiece from the project's template of that name. */
    <T> T createFromTemplate(String name);

    /** A taught frame, by its path. */
    ObjectFrame getFrame(String path);
}
