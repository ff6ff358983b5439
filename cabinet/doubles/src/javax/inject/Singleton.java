package javax.inject;

import java.lang.annotation.Retention;
import java.lang.annotation.RetentionPolicy;

/** There is one object of the class for everybody who wants one injected. */
@Retention(RetentionPolicy.RUNTIME)
public @interface Singleton {
}
