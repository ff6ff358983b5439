package heptarm.doubles.motion;

import java.util.Arrays;
import java.util.List;
import java.util.stream.Collectors;

import com.kuka.roboticsAPI.conditionModel.ICondition;
import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.doubles.seam.AllOf;
import heptarm.doubles.seam.AnyOf;
import heptarm.doubles.seam.Condition;
import heptarm.doubles.seam.Inverted;

/** Base of all conditions: logical combination and the checks of their parameters. */
public abstract class AbstractCondition implements ICondition {
    /** Logical operators. */
    enum Kind { ALL, ANY, NOT }

    /** A logical combination of conditions. */
    static final class Combined extends AbstractCondition {
        final Kind kind;
        final ICondition[] parts;

        Combined(Kind kind, ICondition... parts) {
            this.kind = kind;
            this.parts = parts;
        }

        @Override
        public String toString() {
            String all = Arrays.stream(parts).map(String::valueOf).collect(Collectors.joining(kind == Kind.ANY ? " or " : " and "));
            return kind == Kind.NOT ? "not " + all : "(" + all + ")";
        }

        @Override
        protected Condition forPlant(LBR robot) {
            Condition[] translated = translate(List.of(parts), robot);
            switch (kind) {
                case ALL:
                    AllOf all = new AllOf();
                    all.parts = translated;
                    return all;
                case ANY:
                    AnyOf any = new AnyOf();
                    any.parts = translated;
                    return any;
                default:
                    return not(translated[0]);
            }
        }
    }

    /** Its kind, for the log of an application. */
    @Override
    public String toString() {
        return getClass().getSimpleName();
    }

    /** The condition in the plant's terms, in SI. */
    protected abstract Condition forPlant(LBR robot);

    /** Translates a condition of the Sunrise API for the plant. */
    public static Condition translate(ICondition condition, LBR robot) {
        if (!(condition instanceof AbstractCondition)) {
            throw new IllegalArgumentException("the virtual cabinet cannot monitor a condition of class "
                    + condition.getClass().getName());
        }
        return ((AbstractCondition) condition).forPlant(robot);
    }

    /** Translates several conditions. */
    public static Condition[] translate(List<ICondition> conditions, LBR robot) {
        return conditions.stream().map(one -> translate(one, robot)).toArray(Condition[]::new);
    }

    protected static Condition not(Condition condition) {
        Inverted inverted = new Inverted();
        inverted.part = condition;
        return inverted;
    }

    private Combined with(Kind kind, ICondition other, ICondition... more) {
        ICondition[] all = new ICondition[more.length + 2];
        all[0] = this;
        all[1] = other;
        System.arraycopy(more, 0, all, 2, more.length);
        return new Combined(kind, all);
    }

    @Override
    public ICondition or(ICondition other, ICondition... more) {
        return with(Kind.ANY, other, more);
    }

    @Override
    public ICondition and(ICondition other, ICondition... more) {
        return with(Kind.ALL, other, more);
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
            throw new IllegalArgumentException("threshold must be finite and not negative, got " + value + " (N or Nm)");
        }
        return value;
    }

    protected static double tolerance(double value) {
        if (!(value > 0.0)) {
            throw new IllegalArgumentException("tolerance must be positive, got " + value);
        }
        return value;
    }

    protected static double[] band(double low, double high) {
        if (!(low < high)) {
            throw new IllegalArgumentException("the lower limit must be below the upper limit, got " + low + " and " + high);
        }
        return new double[] {low, high};
    }
}
