package heptarm.core;

/** A request is refused; nothing has changed. Says what, why and what would be legal. */
public final class Refusal extends Exception {
    private static final long serialVersionUID = 1L;

    public final int code;
    public final String parameter;
    public final String value;
    public final String allowed;

    public Refusal(int code, String text) {
        this(code, "", "", "", text);
    }

    public Refusal(int code, String parameter, String value, String allowed, String text) {
        super(text);
        this.code = code;
        this.parameter = parameter;
        this.value = value;
        this.allowed = allowed;
    }
}
