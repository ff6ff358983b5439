package com.kuka.roboticsAPI.geometricModel;

import java.util.ArrayList;
import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;

/** Anything with a name in the scene, and what is attached to it. */
public abstract class SceneGraphObject {
    private final String name;
    private final List<SceneGraphObject> children = new CopyOnWriteArrayList<>();

    protected SceneGraphObject(String name) {
        this.name = name;
    }

    public String getName() {
        return name;
    }

    /** What is attached now; a copy, so that it can be gone through while objects are detached. */
    public List<SceneGraphObject> getChildren() {
        return new ArrayList<>(children);
    }

    void adopt(SceneGraphObject child) {
        children.add(child);
    }

    void abandon(SceneGraphObject child) {
        children.remove(child);
    }
}
