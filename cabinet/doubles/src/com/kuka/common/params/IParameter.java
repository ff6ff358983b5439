package com.kuka.common.params;

/** A value of a set of parameters. */
public interface IParameter<V> {
    V value();
}
