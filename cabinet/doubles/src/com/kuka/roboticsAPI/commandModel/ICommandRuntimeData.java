package com.kuka.roboticsAPI.commandModel;

/** What is known of a command while it runs; to be printed. */
public interface ICommandRuntimeData {
}
