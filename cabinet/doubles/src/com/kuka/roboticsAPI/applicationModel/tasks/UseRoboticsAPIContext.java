package com.kuka.roboticsAPI.applicationModel.tasks;

import java.lang.annotation.Retention;
import java.lang.annotation.RetentionPolicy;

import com.kuka.roboticsAPI.RoboticsAPIContext;

/** Selects the context of a task; no effect, since the virtual cabinet has only one. */
@Retention(RetentionPolicy.RUNTIME)
public @interface UseRoboticsAPIContext {
    Class<? extends RoboticsAPIContext> value() default RoboticsAPIContext.class;
}
