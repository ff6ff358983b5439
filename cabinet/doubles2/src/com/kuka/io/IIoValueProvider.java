package com.kuka.io;

import heptarm.doubles2.Signals.Value;

/** Reads and writes signals. */
public interface IIoValueProvider {
    Value getIoValue(IIoDefinition signal);

    void setValue(IIoDefinition signal, Boolean value);

    void setValue(IIoDefinition signal, Long value);

    void setValue(IIoDefinition signal, double value);
}
