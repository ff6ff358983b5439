package com.kuka.sunrise.common.task.categories;

import java.lang.annotation.Retention;
import java.lang.annotation.RetentionPolicy;

/** Whether the cabinet starts a background task automatically. */
@Retention(RetentionPolicy.RUNTIME)
public @interface BackgroundTaskCategory {
    boolean autoStart() default false;
}
