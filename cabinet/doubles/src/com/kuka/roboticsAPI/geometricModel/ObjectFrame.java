package com.kuka.roboticsAPI.geometricModel;

import java.util.ArrayList;
import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;
import java.util.function.Supplier;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.IMotionContainerListener;

/** A frame of an object, which moves with the object. */
public class ObjectFrame extends AbstractFrame {
    private volatile String name;
    private final SceneGraphObject owner;
    private volatile Supplier<? extends AbstractFrame> parent;
    private final Supplier<Transformation> fromParent; // null: placed by hand
    private volatile Transformation placed;
    private final List<ObjectFrame> children = new CopyOnWriteArrayList<>();

    /** Created by objects; the parent of an object's root is the frame to which the object is attached. */
    public ObjectFrame(String name, SceneGraphObject owner, Supplier<? extends AbstractFrame> parent,
            Supplier<Transformation> fromParent) {
        this.name = name;
        this.owner = owner;
        this.parent = parent;
        this.fromParent = fromParent;
    }

    /** A frame of the application's own; it is no child of its parent, and keeps the place that the provider gives now. */
    public ObjectFrame(String name, ObjectFrame parent, SceneGraphObject owner, ITransformationProvider place) {
        this(name, owner, () -> parent, null);
        placed = Transformation.of(place.getTransformation());
    }

    @Override
    public String getName() {
        return name;
    }

    @Override
    public AbstractFrame getParent() {
        return parent.get();
    }

    @Override
    Transformation fromParent() {
        return fromParent == null ? placed : fromParent.get();
    }

    /** Changes its pose relative to its parent; for the simulation. */
    public void place(ITransformation anew) {
        if (fromParent != null) {
            throw new IllegalArgumentException("the frame " + name + " cannot be moved by hand");
        }
        placed = Transformation.of(anew);
    }

    /** The child frame of a name; null if there is none. */
    public ObjectFrame getChild(String wanted) {
        for (ObjectFrame child : children) {
            if (child.name.equals(wanted)) {
                return child;
            }
        }
        return null;
    }

    public List<ObjectFrame> getChildren() {
        return new ArrayList<>(children);
    }

    public List<ObjectFrame> getChildrenSnapshot() {
        return getChildren();
    }

    /** Renames a frame of the project; for its data. */
    public void rename(String wanted) {
        ObjectFrame above = above();
        if (wanted.isEmpty() || wanted.contains("/") || above.getChild(wanted) != null) {
            throw new IllegalArgumentException("a frame of " + above.name + " cannot be named \"" + wanted + "\"");
        }
        name = wanted;
    }

    /** Removes a frame of the project; for its data. */
    public void remove() {
        above().children.remove(this);
    }

    /** Gives a frame of the project another parent, where it stays in its place; for its data. */
    public void moveTo(ObjectFrame newParent) {
        if (newParent.getChild(name) != null) {
            throw new IllegalArgumentException("a frame " + name + " of " + newParent.name + " exists already");
        }
        Transformation there = newParent.transformationTo(this);
        remove();
        parent = () -> newParent;
        place(there);
        newParent.children.add(this);
    }

    private ObjectFrame above() {
        AbstractFrame above = getParent();
        if (fromParent != null || !(above instanceof ObjectFrame)) {
            throw new IllegalArgumentException("the frame " + name + " is none of the project's frames");
        }
        return (ObjectFrame) above;
    }

    /** A new child frame; for the simulation. */
    public ObjectFrame add(String childName, ITransformation fromHere) {
        if (childName.length() == 0 || getChild(childName) != null) {
            throw new IllegalArgumentException("a frame " + childName + " of " + name + " exists already");
        }
        ObjectFrame child = new ObjectFrame(childName, owner, () -> this, null);
        child.place(fromHere);
        children.add(child);
        return child;
    }

    SceneGraphObject owner() {
        return owner;
    }

    /** The robot that carries it; null if none does. */
    LBR robot() {
        for (AbstractFrame frame = this; frame != null; frame = frame.getParent()) {
            if (frame instanceof ObjectFrame && ((ObjectFrame) frame).owner instanceof LBR) {
                return (LBR) ((ObjectFrame) frame).owner;
            }
        }
        return null;
    }

    @Override
    public String getPath() {
        AbstractFrame above = getParent();
        boolean isRoot = !(above instanceof ObjectFrame) || ((ObjectFrame) above).owner != owner;
        return isRoot ? "" : above.getPath() + "/" + name;
    }

    /** Attaches the object of this frame so that this frame coincides with another. */
    public void attachTo(AbstractFrame frame) {
        if (!(owner instanceof SpatialObject)) {
            throw new IllegalStateException("the frame " + name + " belongs to no object that could be attached");
        }
        SpatialObject object = (SpatialObject) owner;
        object.attachTo(frame, object.getRootFrame().transformationTo(this).invert());
    }

    private LBR mover() {
        LBR robot = robot();
        if (robot == null) {
            throw new IllegalStateException("the frame " + name + " is not attached to a robot");
        }
        return robot;
    }

    public IMotionContainer move(IMotion motion) {
        return mover().moveFrame(this, motion, null);
    }

    public IMotionContainer moveAsync(IMotion motion) {
        return mover().moveFrameAsync(this, motion, null);
    }

    public IMotionContainer move(IMotion motion, IMotionContainerListener listener) {
        return mover().moveFrame(this, motion, listener);
    }

    public IMotionContainer moveAsync(IMotion motion, IMotionContainerListener listener) {
        return mover().moveFrameAsync(this, motion, listener);
    }
}
