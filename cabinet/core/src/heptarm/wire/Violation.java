package heptarm.wire;

/** A field outside what the schema allows. */
public final class Violation extends Exception {
    private static final long serialVersionUID = 1L;

    public final int code;
    public final String parameter;
    public final String value;
    public final String allowed;

    public Violation(int code, String parameter, String value, String allowed) {
        super(parameter + " is " + value + "; allowed is " + allowed);
        this.code = code;
        this.parameter = parameter;
        this.value = value;
        this.allowed = allowed;
    }
}
