package com.kuka.roboticsAPI.geometricModel;

/** Anything with a name in the scene. */
public abstract class SceneGraphObject {
    private final String name;

    protected SceneGraphObject(String name) {
        this.name = name;
    }

    public String getName() {
        return name;
    }
}
