package com.kuka.roboticsAPI.geometricModel;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.persistenceModel.PersistenceException;

/** An object with frames that can be attached to a frame of another one. */
public abstract class SpatialObject extends SceneGraphObject {
    private final ObjectFrame root;
    private volatile AbstractFrame attachedTo;
    private volatile Transformation offset = Transformation.IDENTITY;

    protected SpatialObject(String name) {
        super(name);
        root = new ObjectFrame(name, this, this::holder, () -> offset);
    }

    private AbstractFrame holder() {
        AbstractFrame held = attachedTo;
        return held == null ? World.Current.getRootFrame() : held;
    }

    public ObjectFrame getRootFrame() {
        return root;
    }

    /** A frame by its path, with or without a leading slash. */
    public ObjectFrame getFrame(String path) {
        ObjectFrame found = root;
        for (String part : path.split("/")) {
            if (part.length() > 0) {
                found = found.getChild(part);
                if (found == null) {
                    throw new PersistenceException("no frame " + path + " of " + getName());
                }
            }
        }
        return found;
    }

    public ObjectFrame addChildFrame(String name, ITransformation fromRoot) {
        return root.add(name, fromRoot);
    }

    /** Changes a frame of this object, or of one that is attached to it, relative to its parent. */
    public void changeFramePosition(ObjectFrame frame, ITransformation fromParent) {
        frame.place(fromParent);
    }

    /** Attaches the root of this object to a frame, and detaches it from its current one. */
    public void attachTo(AbstractFrame frame) {
        attachTo(frame, Transformation.IDENTITY);
    }

    /** The same, with an offset of the root from the origin of the frame. */
    void attachTo(AbstractFrame frame, Transformation rootInFrame) {
        for (AbstractFrame one = frame; one != null; one = one.getParent()) {
            if (owner(one) == this) {
                throw new IllegalArgumentException(getName() + " cannot be attached to itself");
            }
        }
        LBR before = release();
        attachedTo = frame;
        offset = rootInFrame;
        if (owner(frame) != null) {
            owner(frame).adopt(this);
        }
        LBR now = root.robot();
        if (before != null && before != now) {
            before.carries();
        }
        if (now != null) {
            now.carries();
        }
    }

    public void detach() {
        LBR before = release();
        if (before != null) {
            before.carries();
        }
    }

    /** Returns the robot to which it was attached; null if none. */
    private LBR release() {
        AbstractFrame held = attachedTo;
        if (held == null) {
            return null;
        }
        LBR robot = root.robot();
        if (owner(held) != null) {
            owner(held).abandon(this);
        }
        attachedTo = null;
        offset = Transformation.IDENTITY;
        return robot;
    }

    /** Detaches everything attached to this object. */
    public void detachAll() {
        for (SceneGraphObject child : getChildren()) {
            if (child instanceof SpatialObject) {
                ((SpatialObject) child).detach();
            }
        }
    }

    private static SceneGraphObject owner(AbstractFrame frame) {
        return frame instanceof ObjectFrame ? ((ObjectFrame) frame).owner() : null;
    }
}
