package heptarm.doubles.jre;

/** In place of the annotation inside old Java runtimes. */
public @interface NotNull {
}
