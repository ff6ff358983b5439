package heptarm.doubles;

/** A signal that an FRI session carries. */
public final class FriSignal {
    public final String name;
    /** 0 boolean, 1 unsigned, 2 integer, 3 analog. */
    public final int type;
    public final boolean output;
    /** In the IO image, see {@link Plant#signal}. */
    public final int place;
    public final double low;
    public final double high;

    public FriSignal(String name, int type, boolean output, int place, double low, double high) {
        this.name = name;
        this.type = type;
        this.output = output;
        this.place = place;
        this.low = low;
        this.high = high;
    }
}
