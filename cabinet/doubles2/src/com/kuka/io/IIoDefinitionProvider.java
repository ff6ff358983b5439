package com.kuka.io;

/** Finds signals. */
public interface IIoDefinitionProvider {
    IIoDefinition getIoDefinition(String group, String name);
}
