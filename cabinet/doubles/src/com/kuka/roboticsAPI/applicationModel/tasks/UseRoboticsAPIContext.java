package com.kuka.roboticsAPI.applicationModel.tasks;

import java.lang.annotation.Retention;
import java.lang.annotation.RetentionPolicy;

import com.kuka.roboticsAPI.RoboticsAPIContext;

/** Says which context a task wants; the virtual cabinet has one, so that nothing changes. */
@Retention(RetentionPolicy.RUNTIME)
public @interface UseRoboticsAPIContext {
    Class<? extends RoboticsAPIContext> value() default RoboticsAPIContext.class;
}
