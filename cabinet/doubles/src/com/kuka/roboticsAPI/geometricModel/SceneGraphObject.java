package com.kuka.roboticsAPI.geometricModel;

import java.util.ArrayList;
import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;

/** An object of the scene with a name, and the objects attached to it. */
public abstract class SceneGraphObject {
    private final String name;
    private final List<SceneGraphObject> children = new CopyOnWriteArrayList<>();

    /** An object of the application's own. */
    protected SceneGraphObject() {
        this("");
    }

    protected SceneGraphObject(String name) {
        this.name = name;
    }

    public String getName() {
        return name;
    }

    /** The attached objects; a copy, so that objects can be detached while it is iterated. */
    public List<SceneGraphObject> getChildren() {
        return new ArrayList<>(children);
    }

    /** An application's own object may have it; never called. */
    protected void changeParent(ObjectFrame parent) {
    }

    void adopt(SceneGraphObject child) {
        children.add(child);
    }

    void abandon(SceneGraphObject child) {
        children.remove(child);
    }
}
