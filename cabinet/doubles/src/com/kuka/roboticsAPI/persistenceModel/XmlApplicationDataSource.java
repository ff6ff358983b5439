package com.kuka.roboticsAPI.persistenceModel;

/** The project's stored frames; only the name is known, so that applications that name it compile. */
public class XmlApplicationDataSource {
    protected XmlApplicationDataSource() {
        throw new UnsupportedOperationException("the virtual cabinet does not write into the project's data.xml");
    }
}
