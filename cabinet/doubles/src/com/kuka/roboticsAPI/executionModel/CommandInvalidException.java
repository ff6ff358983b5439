package com.kuka.roboticsAPI.executionModel;

/** A command could not be planned or executed. */
public class CommandInvalidException extends RuntimeException {
    private static final long serialVersionUID = 1L;

    public CommandInvalidException(String text) {
        super(text);
    }
}
