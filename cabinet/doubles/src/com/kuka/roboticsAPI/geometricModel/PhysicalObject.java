package com.kuka.roboticsAPI.geometricModel;

/** An object with frames. */
public abstract class PhysicalObject extends SceneGraphObject {
    protected PhysicalObject(String name) {
        super(name);
    }
}
