package com.kuka.common.params;

import java.util.Iterator;

/** Parameters, at most one of each class. */
public interface IParameterSet extends Iterable<IParameter<?>> {
    /** The parameters of both; the other's come first where both have one of a class. */
    IParameterSet combine(IParameterSet other);

    <T extends IParameter<?>> boolean contains(Class<T> type);

    boolean isEmpty();

    String name();

    /** The parameter of a class; null if there is none. */
    <T extends IParameter<?>> T optionalParameter(Class<T> type);

    <V, W extends V, T extends IParameter<V>> V optionalValue(Class<T> type, W otherwise);

    int paramCount();

    <T extends IParameter<?>> T requiredParameter(Class<T> type);

    <V, T extends IParameter<V>> V requiredValue(Class<T> type);

    @Override
    Iterator<IParameter<?>> iterator();
}
