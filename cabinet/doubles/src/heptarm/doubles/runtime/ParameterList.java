package heptarm.doubles.runtime;

import java.util.ArrayList;
import java.util.Iterator;
import java.util.List;

import com.kuka.common.params.IParameter;
import com.kuka.common.params.IParameterSet;

/** Parameters in a fixed order. */
public final class ParameterList implements IParameterSet {
    private final String name;
    private final List<IParameter<?>> parameters;

    private ParameterList(String name, List<IParameter<?>> parameters) {
        this.name = name;
        this.parameters = parameters;
    }

    /** Parameters with these values. */
    public static ParameterList of(String name, Object... values) {
        List<IParameter<?>> parameters = new ArrayList<>();
        for (Object value : values) {
            parameters.add(() -> value);
        }
        return new ParameterList(name, parameters);
    }

    @Override
    public IParameterSet combine(IParameterSet other) {
        List<IParameter<?>> all = new ArrayList<>();
        other.forEach(all::add);
        for (IParameter<?> one : parameters) {
            if (!other.contains(one.getClass())) {
                all.add(one);
            }
        }
        return new ParameterList(name, all);
    }

    @Override
    public <T extends IParameter<?>> boolean contains(Class<T> type) {
        return optionalParameter(type) != null;
    }

    @Override
    public boolean isEmpty() {
        return parameters.isEmpty();
    }

    @Override
    public String name() {
        return name;
    }

    @Override
    public <T extends IParameter<?>> T optionalParameter(Class<T> type) {
        for (IParameter<?> one : parameters) {
            if (type.isInstance(one)) {
                return type.cast(one);
            }
        }
        return null;
    }

    @Override
    public <V, W extends V, T extends IParameter<V>> V optionalValue(Class<T> type, W otherwise) {
        T found = optionalParameter(type);
        return found == null ? otherwise : found.value();
    }

    @Override
    public int paramCount() {
        return parameters.size();
    }

    @Override
    public <T extends IParameter<?>> T requiredParameter(Class<T> type) {
        T found = optionalParameter(type);
        if (found == null) {
            throw new IllegalArgumentException(name + " has no parameter " + type.getName());
        }
        return found;
    }

    @Override
    public <V, T extends IParameter<V>> V requiredValue(Class<T> type) {
        return requiredParameter(type).value();
    }

    @Override
    public Iterator<IParameter<?>> iterator() {
        return List.copyOf(parameters).iterator();
    }
}
