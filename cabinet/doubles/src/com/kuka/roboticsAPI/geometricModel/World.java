package com.kuka.roboticsAPI.geometricModel;

import com.kuka.roboticsAPI.geometricModel.math.Transformation;

/** The root of all frames. The robot is at its origin. */
public final class World {
    public static final World Current = new World();

    private final ObjectFrame root = new ObjectFrame("WorldOrigin", null, () -> null, () -> Transformation.IDENTITY);

    private World() {
    }

    public ObjectFrame getRootFrame() {
        return root;
    }
}
