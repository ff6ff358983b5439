package com.kuka.roboticsAPI.persistenceModel.templateModel;

/** An element of the project's data; only the name is known. */
public abstract class TemplateElement {
}
