package com.kuka.roboticsAPI.ioModel;

/** An output of the cabinet. */
public class Output extends AbstractIO {
    private final double low;
    private final double high;

    Output(String group, String name, IOTypes type, int bits, double low, double high) {
        super(group, name, type, bits, true);
        this.low = low;
        this.high = high;
    }

    @Override
    double low() {
        return low;
    }

    @Override
    double high() {
        return high;
    }

    void check(double value) {
        if (!(value >= low && value <= high)) {
            throw new IllegalArgumentException("output " + getIOName() + " must be in [" + low + ", " + high + "], got " + value);
        }
    }
}
