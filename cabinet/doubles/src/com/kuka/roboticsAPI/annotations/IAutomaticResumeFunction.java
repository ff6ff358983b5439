package com.kuka.roboticsAPI.annotations;

/** Lets an application go on by itself after a stop. */
public interface IAutomaticResumeFunction {
    void enableApplicationResuming(String application);

    void disableApplicationResuming(String application);
}
