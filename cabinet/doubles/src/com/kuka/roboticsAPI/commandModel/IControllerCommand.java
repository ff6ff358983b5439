package com.kuka.roboticsAPI.commandModel;

/** A command of the cabinet, to be printed. */
public interface IControllerCommand {
}
