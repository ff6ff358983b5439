package com.kuka.io;

/** A signal. */
public interface IIoDefinition {
}
