package com.kuka.roboticsAPI.geometricModel;

import java.util.ArrayList;
import java.util.Collection;
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
    private final String name;
    private final SceneGraphObject owner;
    private final Supplier<? extends AbstractFrame> parent;
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

    public Collection<ObjectFrame> getChildren() {
        return new ArrayList<>(children);
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

    /** A frame of the application at the present place, in the same parent. */
    public Frame copy() {
        return new Frame(getParent(), fromParent());
    }

    /** A frame of the application at the present place, in another one. */
    public Frame copy(ObjectFrame reference) {
        return new Frame(reference, reference.transformationTo(this));
    }

    /** Not simulated: where projects store such parameters is not known. */
    public <T> T getAdditionalParameter(String parameter) {
        throw new UnsupportedOperationException("the virtual cabinet does not read additional parameters of frames, such as "
                + parameter + " of " + name + "; use process data");
    }

    public Frame copyWithRedundancy() {
        Frame copy = new Frame(transformationFromWorld());
        copyRedundancyTo(copy);
        return copy;
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
