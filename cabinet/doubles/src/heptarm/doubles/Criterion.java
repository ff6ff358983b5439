package heptarm.doubles;

import com.kuka.roboticsAPI.conditionModel.ICondition;

/** What all conditions share. */
public abstract class Criterion implements ICondition {
    /** How conditions are combined. */
    enum Kind { ALL, ANY, NOT }

    /** Conditions combined. */
    static final class Combined extends Criterion {
        final Kind kind;
        final ICondition[] parts;

        Combined(Kind kind, ICondition... parts) {
            this.kind = kind;
            this.parts = parts;
        }
    }

    private Combined with(Kind kind, ICondition... others) {
        ICondition[] all = new ICondition[others.length + 1];
        all[0] = this;
        System.arraycopy(others, 0, all, 1, others.length);
        return new Combined(kind, all);
    }

    @Override
    public ICondition or(ICondition... others) {
        return with(Kind.ANY, others);
    }

    @Override
    public ICondition and(ICondition... others) {
        return with(Kind.ALL, others);
    }

    @Override
    public ICondition xor(ICondition other) {
        return and(other.invert()).or(invert().and(other));
    }

    @Override
    public ICondition invert() {
        return new Combined(Kind.NOT, this);
    }

    protected static double threshold(double value) {
        if (!(value >= 0.0) || Double.isInfinite(value)) {
            throw new IllegalArgumentException("the threshold is " + value + "; it must not be negative");
        }
        return value;
    }

    protected static double tolerance(double value) {
        if (!(value > 0.0)) {
            throw new IllegalArgumentException("the tolerance is " + value + "; it has to be positive");
        }
        return value;
    }

    protected static double[] band(double low, double high) {
        if (!(low < high)) {
            throw new IllegalArgumentException("the lower limit " + low + " has to be below the upper one " + high);
        }
        return new double[] {low, high};
    }
}
