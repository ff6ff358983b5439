package com.kuka.roboticsAPI.ioModel;

/** An input of the cabinet. */
public class Input extends AbstractIO {
    Input(String group, String name, IOTypes type, int bits) {
        super(group, name, type, bits, false);
    }
}
