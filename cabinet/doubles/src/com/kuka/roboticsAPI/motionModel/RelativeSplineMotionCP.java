package com.kuka.roboticsAPI.motionModel;

import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

/** A Cartesian motion whose destination is relative to the pose of the motion frame at its start. */
public abstract class RelativeSplineMotionCP<T extends RelativeSplineMotionCP<T>> extends SplineMotionCP<T> {
    private Transformation offset;
    private AbstractFrame reference;

    RelativeSplineMotionCP(ITransformation offset, AbstractFrame reference) {
        this.offset = Transformation.of(offset);
        this.reference = reference;
    }

    public Transformation getOffset() {
        return offset;
    }

    /** Frame whose axes the offset refers to; null: the motion frame. */
    public AbstractFrame getReference() {
        return reference;
    }

    public T setReferenceFrame(AbstractFrame frame) {
        reference = frame;
        return self();
    }

    /** [mm]; the other coordinates stay. */
    public T setXOffset(double value) {
        return with(value, offset.getY(), offset.getZ(), offset.getAlphaRad(), offset.getBetaRad(), offset.getGammaRad());
    }

    /** See {@link #setXOffset}. */
    public T setYOffset(double value) {
        return with(offset.getX(), value, offset.getZ(), offset.getAlphaRad(), offset.getBetaRad(), offset.getGammaRad());
    }

    /** See {@link #setXOffset}. */
    public T setZOffset(double value) {
        return with(offset.getX(), offset.getY(), value, offset.getAlphaRad(), offset.getBetaRad(), offset.getGammaRad());
    }

    /** [rad]; the other coordinates stay. */
    public T setAlphaOffset(double value) {
        return with(offset.getX(), offset.getY(), offset.getZ(), value, offset.getBetaRad(), offset.getGammaRad());
    }

    /** See {@link #setAlphaOffset}. */
    public T setBetaOffset(double value) {
        return with(offset.getX(), offset.getY(), offset.getZ(), offset.getAlphaRad(), value, offset.getGammaRad());
    }

    /** See {@link #setAlphaOffset}. */
    public T setGammaOffset(double value) {
        return with(offset.getX(), offset.getY(), offset.getZ(), offset.getAlphaRad(), offset.getBetaRad(), value);
    }

    private T with(double x, double y, double z, double a, double b, double c) {
        offset = Transformation.ofRad(x, y, z, a, b, c);
        return self();
    }
}
