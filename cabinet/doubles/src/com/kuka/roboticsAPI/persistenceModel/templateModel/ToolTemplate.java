package com.kuka.roboticsAPI.persistenceModel.templateModel;

/** A tool; only the name is known. */
public abstract class ToolTemplate extends GeometricObjectTemplate {
}
