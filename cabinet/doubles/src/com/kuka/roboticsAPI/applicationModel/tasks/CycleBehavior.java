package com.kuka.roboticsAPI.applicationModel.tasks;

/** What happens to a late cycle: with {@code BestEffort} it runs as soon as possible. */
public enum CycleBehavior {
    BestEffort
}
