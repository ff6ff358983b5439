package com.kuka.roboticsAPI.commandModel;

/** Runtime data of a command, to be printed. */
public interface ICommandRuntimeData {
}
