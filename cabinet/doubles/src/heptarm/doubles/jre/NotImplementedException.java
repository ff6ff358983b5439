package heptarm.doubles.jre;

/** In place of the one inside old Java runtimes. */
public class NotImplementedException extends RuntimeException {
    private static final long serialVersionUID = 1L;
}
