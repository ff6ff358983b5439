package com.kuka.roboticsAPI.ioModel;

/** An output is reserved by another client. */
public class OutputReservedException extends RuntimeException {
    private static final long serialVersionUID = 1L;

    public OutputReservedException(String text) {
        super(text);
    }
}
