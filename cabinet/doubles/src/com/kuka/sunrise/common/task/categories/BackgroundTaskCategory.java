package com.kuka.sunrise.common.task.categories;

import java.lang.annotation.Retention;
import java.lang.annotation.RetentionPolicy;

/** Says whether the cabinet starts a background task by itself. */
@Retention(RetentionPolicy.RUNTIME)
public @interface BackgroundTaskCategory {
    boolean autoStart() default false;
}
