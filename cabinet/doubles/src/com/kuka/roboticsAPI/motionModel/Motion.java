package com.kuka.roboticsAPI.motionModel;

/** Base of motions; {@code T} is the motion's own type, so that setters chain. */
public abstract class Motion<T extends Motion<T>> implements IMotion {
    @SuppressWarnings("unchecked")
    protected final T self() {
        return (T) this;
    }
}
