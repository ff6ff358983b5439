package com.kuka.roboticsAPI.geometricModel;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.IMotionContainerListener;

/** An object with load data. Motions of the object refer to its default motion frame. */
public abstract class PhysicalObject extends SpatialObject {
    private final LoadData load;
    private volatile ObjectFrame moved;

    protected PhysicalObject(String name) {
        this(name, new LoadData());
    }

    protected PhysicalObject(String name, LoadData load) {
        super(name);
        this.load = load;
    }

    public LoadData getLoadData() {
        return load;
    }

    /** The motion frame of the object; default: its root. */
    public ObjectFrame getDefaultMotionFrame() {
        ObjectFrame chosen = moved;
        return chosen == null ? getRootFrame() : chosen;
    }

    public void setDefaultMotionFrame(ObjectFrame frame) {
        if (frame.owner() != this) {
            throw new IllegalArgumentException("the frame " + frame.getName() + " does not belong to " + getName());
        }
        moved = frame;
    }

    public ObjectFrame addDefaultMotionFrame(String name, ITransformation fromRoot) {
        ObjectFrame frame = addChildFrame(name, fromRoot);
        moved = frame;
        return frame;
    }

    /** The robot that carries it; null if none does. For the simulation. */
    public LBR carrier() {
        return getRootFrame().robot();
    }

    public IMotionContainer move(IMotion motion) {
        return getDefaultMotionFrame().move(motion);
    }

    public IMotionContainer moveAsync(IMotion motion) {
        return getDefaultMotionFrame().moveAsync(motion);
    }

    public IMotionContainer move(IMotion motion, IMotionContainerListener listener) {
        return getDefaultMotionFrame().move(motion, listener);
    }

    public IMotionContainer moveAsync(IMotion motion, IMotionContainerListener listener) {
        return getDefaultMotionFrame().moveAsync(motion, listener);
    }
}
