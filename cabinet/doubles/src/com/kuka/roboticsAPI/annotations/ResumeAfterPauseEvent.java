package com.kuka.roboticsAPI.annotations;

import java.lang.annotation.Retention;
import java.lang.annotation.RetentionPolicy;

/** How an application goes on after a stop, if that was enabled: so many milliseconds after the stop's end. */
@Retention(RetentionPolicy.RUNTIME)
public @interface ResumeAfterPauseEvent {
    int delay() default 0;

    /** Whether it also goes on where it has to return to its path; the virtual arm never leaves it. */
    boolean afterRepositioning() default false;
}
