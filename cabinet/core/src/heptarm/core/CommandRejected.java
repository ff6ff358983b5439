package heptarm.core;

/** A refused request; nothing has changed. Names the parameter, its value, the allowed range and the remedy. */
public final class CommandRejected extends Exception {
    private static final long serialVersionUID = 1L;

    public final int code;
    public final String parameter;
    public final String value;
    public final String allowed;

    public CommandRejected(int code, String text) {
        this(code, "", "", "", text);
    }

    public CommandRejected(int code, String parameter, String value, String allowed, String text) {
        super(text);
        this.code = code;
        this.parameter = parameter;
        this.value = value;
        this.allowed = allowed;
    }
}
