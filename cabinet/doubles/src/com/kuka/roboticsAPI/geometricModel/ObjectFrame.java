package com.kuka.roboticsAPI.geometricModel;

import java.util.function.Supplier;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.motionModel.IMotion;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.roboticsAPI.motionModel.IMotionContainerListener;

/** A frame of an object. Where the object moves, so does the frame. */
public class ObjectFrame extends AbstractFrame {
    private final String name;
    private final AbstractFrame parent;
    private final Supplier<Transformation> fromParent;
    private final LBR robot;

    /** Made by the objects that have frames; the robot is the one that moves it, null if none does. */
    public ObjectFrame(String name, AbstractFrame parent, Supplier<Transformation> fromParent, LBR robot) {
        this.name = name;
        this.parent = parent;
        this.fromParent = fromParent;
        this.robot = robot;
    }

    public String getName() {
        return name;
    }

    @Override
    public AbstractFrame getParent() {
        return parent;
    }

    @Override
    Transformation fromParent() {
        return fromParent.get();
    }

    public Frame copyWithRedundancy() {
        Frame copy = new Frame(transformationFromWorld());
        copyRedundancyTo(copy);
        return copy;
    }

    private LBR mover() {
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
