package com.kuka.roboticsAPI.annotations;

/** Lets an application resume automatically after a stop. */
public interface IAutomaticResumeFunction {
    void enableApplicationResuming(String application);

    void disableApplicationResuming(String application);
}
