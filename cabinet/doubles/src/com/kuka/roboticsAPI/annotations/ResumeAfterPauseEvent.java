package com.kuka.roboticsAPI.annotations;

import java.lang.annotation.Retention;
import java.lang.annotation.RetentionPolicy;

/** When an application resumes after a stop, if enabled: this many milliseconds after the end of the stop. */
@Retention(RetentionPolicy.RUNTIME)
public @interface ResumeAfterPauseEvent {
    int delay() default 0;

    /** Whether it also resumes if the arm has to return to its path; the virtual arm never leaves it. */
    boolean afterRepositioning() default false;
}
