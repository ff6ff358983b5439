package javax.inject;

import java.lang.annotation.Retention;
import java.lang.annotation.RetentionPolicy;

/** Says which template a tool or workpiece is made from. */
@Retention(RetentionPolicy.RUNTIME)
public @interface Named {
    String value() default "";
}
