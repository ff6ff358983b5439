package com.kuka.roboticsAPI.commandModel;

/** A command as the cabinet knows it; to be printed. */
public interface IControllerCommand {
}
