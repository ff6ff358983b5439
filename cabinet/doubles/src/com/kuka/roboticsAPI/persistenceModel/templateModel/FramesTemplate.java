package com.kuka.roboticsAPI.persistenceModel.templateModel;

/** Frames; only the name is known. */
public abstract class FramesTemplate extends TemplateElement {
}
