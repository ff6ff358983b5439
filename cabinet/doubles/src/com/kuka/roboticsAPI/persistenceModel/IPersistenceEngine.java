package com.kuka.roboticsAPI.persistenceModel;

/** Access to the project's stored data. */
public interface IPersistenceEngine {
    XmlApplicationDataSource getDefaultDataSource();
}
