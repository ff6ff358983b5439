package com.kuka.roboticsAPI.persistenceModel.templateModel;

/** An object with geometry; only the name is known. */
public abstract class GeometricObjectTemplate extends TemplateElement {
}
