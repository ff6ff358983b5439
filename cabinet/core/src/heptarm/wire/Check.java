package heptarm.wire;

/** The checks of ranges, lengths and norms. */
final class Check {
    private Check() {
    }

    static void number(double value, String path, double low, double high, boolean lowOpen, boolean nan)
            throws Violation {
        if (Double.isNaN(value)) {
            if (!nan) {
                throw new Violation(Code.NOT_FINITE, path, "NaN", "a finite number");
            }
            return;
        }
        if (Double.isInfinite(value)) {
            throw new Violation(Code.NOT_FINITE, path, value < 0 ? "-inf" : "inf", "a finite number");
        }
        if (!(lowOpen ? low < value : low <= value) || value > high) {
            throw new Violation(Code.OUT_OF_RANGE, path, Double.toString(value),
                    (lowOpen ? "(" : "[") + low + ", " + high + "]");
        }
    }

    static void array(double[] values, String path, double low, double high, boolean lowOpen, boolean nan)
            throws Violation {
        for (int i = 0; i < values.length; i++) {
            number(values[i], path + "[" + i + "]", low, high, lowOpen, nan);
        }
    }

    static void norm(double[] values, String path) throws Violation {
        double square = 0.0;
        for (int i = 0; i < values.length; i++) {
            square += values[i] * values[i];
        }
        double norm = Math.sqrt(square);
        if (Math.abs(norm - 1.0) > 1e-6) {
            throw new Violation(Code.NOT_NORMALISED, path, "of norm " + norm, "norm 1");
        }
    }

    static void length(int size, String path, int low, int high) throws Violation {
        if (size < low || size > high) {
            throw new Violation(Code.BAD_LENGTH, path, size + " long", low + " to " + high + " long");
        }
    }
}
