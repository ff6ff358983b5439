package heptarm.doubles.runtime;

/** A member of Sunrise that applications name and that the virtual cabinet does not simulate. */
public final class NotModelled extends UnsupportedOperationException {
    private static final long serialVersionUID = 1L;

    /** @param what the member, and what to use in its place */
    public NotModelled(String what) {
        super("heptarm: not modelled: " + what);
    }
}
