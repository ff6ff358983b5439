package com.kuka.roboticsAPI.persistenceModel;

/** No such template, frame or process data. */
public class PersistenceException extends RuntimeException {
    private static final long serialVersionUID = 1L;

    public PersistenceException(String text) {
        super(text);
    }
}
