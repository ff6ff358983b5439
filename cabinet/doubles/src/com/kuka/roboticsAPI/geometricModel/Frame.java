package com.kuka.roboticsAPI.geometricModel;

import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

/** A frame created by an application; without a parent it refers to the world. Mutable. */
public class Frame extends AbstractFrame {
    private AbstractFrame parent;
    private Transformation fromParent;

    public Frame() {
        this(World.Current.getRootFrame(), Transformation.IDENTITY);
    }

    public Frame(AbstractFrame parent) {
        this(parent, Transformation.IDENTITY);
    }

    public Frame(ITransformation transformation) {
        this(World.Current.getRootFrame(), transformation);
    }

    public Frame(AbstractFrame parent, ITransformation transformation) {
        this.parent = parent;
        this.fromParent = transformation(transformation);
    }

    public Frame(double x, double y, double z) {
        this(x, y, z, 0, 0, 0);
    }

    public Frame(double x, double y, double z, double a, double b, double c) {
        this(World.Current.getRootFrame(), x, y, z, a, b, c);
    }

    public Frame(AbstractFrame parent, double x, double y, double z, double a, double b, double c) {
        this(parent, Transformation.ofRad(x, y, z, a, b, c));
    }

    @Override
    public AbstractFrame getParent() {
        return parent;
    }

    @Override
    Transformation fromParent() {
        return fromParent;
    }

    /** Another frame as seen from this one, now. */
    public Transformation staticTransformationTo(Frame other) {
        return transformationTo(other);
    }

    /** Moves this frame by a transformation in its own axes. */
    public Frame transform(ITransformation by) {
        fromParent = fromParent.compose(by);
        return this;
    }

    /** Moves this frame by a transformation in the axes of another, about its own origin. */
    public Frame transform(AbstractFrame reference, ITransformation by) {
        Transformation to = transformationTo(reference);
        Transformation turn = Transformation.ofRad(0, 0, 0, to.getAlphaRad(), to.getBetaRad(), to.getGammaRad());
        return transform(turn.compose(by).compose(turn.invert()));
    }

    public Frame setParent(AbstractFrame newParent) {
        return setParent(newParent, true);
    }

    public Frame setParent(AbstractFrame newParent, boolean keepWorldPose) {
        if (keepWorldPose) {
            fromParent = newParent.transformationTo(this);
        }
        parent = newParent;
        return this;
    }

    /** As older applications call it, with the result of the forward kinematics: places it as another frame in its parent. */
    public Frame setTransformationFromParent(Frame other) {
        return setTransformationFromParent(other.fromParent());
    }

    public Frame setTransformationFromParent(ITransformation transformation) {
        fromParent = transformation(transformation);
        return this;
    }

    private Frame with(double x, double y, double z, double a, double b, double c) {
        fromParent = Transformation.ofRad(x, y, z, a, b, c);
        return this;
    }

    public Frame setX(double value) {
        return with(value, getY(), getZ(), getAlphaRad(), getBetaRad(), getGammaRad());
    }

    public Frame setY(double value) {
        return with(getX(), value, getZ(), getAlphaRad(), getBetaRad(), getGammaRad());
    }

    public Frame setZ(double value) {
        return with(getX(), getY(), value, getAlphaRad(), getBetaRad(), getGammaRad());
    }

    public Frame setAlphaRad(double value) {
        return with(getX(), getY(), getZ(), value, getBetaRad(), getGammaRad());
    }

    public Frame setBetaRad(double value) {
        return with(getX(), getY(), getZ(), getAlphaRad(), value, getGammaRad());
    }

    public Frame setGammaRad(double value) {
        return with(getX(), getY(), getZ(), getAlphaRad(), getBetaRad(), value);
    }

    @Override
    public String toString() {
        return fromParent.toString();
    }
}
