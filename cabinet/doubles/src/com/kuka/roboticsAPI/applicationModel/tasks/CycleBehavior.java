package com.kuka.roboticsAPI.applicationModel.tasks;

/** What becomes of a cycle that is late: with {@code BestEffort} it is done as soon as it can be. */
public enum CycleBehavior {
    BestEffort
}
