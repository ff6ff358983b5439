package com.kuka.roboticsAPI.geometricModel;

import java.util.ArrayList;
import java.util.HashMap;
import java.util.List;
import java.util.Map;

import com.kuka.roboticsAPI.deviceModel.Device;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Matrix;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.geometricModel.redundancy.IRedundancyCollection;

/** A frame in the tree whose root is the world. Millimetres, radians. */
public abstract class AbstractFrame {
    private final Map<Device, IRedundancyCollection> redundancy = new HashMap<>();
    private final Map<String, Object> parameters = new HashMap<>();

    /** The parent frame; null for the world. */
    public abstract AbstractFrame getParent();

    abstract Transformation fromParent();

    public Transformation getTransformationFromParent() {
        return fromParent();
    }

    public Transformation transformationFromWorld() {
        AbstractFrame parent = getParent();
        return parent == null ? fromParent() : parent.transformationFromWorld().compose(fromParent());
    }

    /** The other frame relative to this one, by their nearest common ancestor, so that a moving robot adds no error. */
    public Transformation transformationTo(AbstractFrame other) {
        List<AbstractFrame> mine = new ArrayList<>();
        for (AbstractFrame frame = this; frame != null; frame = frame.getParent()) {
            mine.add(frame);
        }
        AbstractFrame common = other;
        while (common != null && !mine.contains(common)) {
            common = common.getParent();
        }
        return from(common).invert().compose(other.from(common));
    }

    /** This frame relative to one of its ancestors; null: to the world. */
    private Transformation from(AbstractFrame above) {
        if (this == above) {
            return Transformation.IDENTITY;
        }
        AbstractFrame parent = getParent();
        return parent == null || parent == above ? fromParent() : parent.from(above).compose(fromParent());
    }

    public double distanceTo(AbstractFrame other) {
        Transformation t = transformationTo(other);
        return Math.sqrt(t.getX() * t.getX() + t.getY() * t.getY() + t.getZ() * t.getZ());
    }

    /** Whether it is close to another frame: distance [mm], angle of the rotation between them [rad]. */
    public boolean isCloseTo(AbstractFrame other, double distance, double angle) {
        Matrix r = transformationTo(other).getRotationMatrix();
        double cosine = (r.get(0, 0) + r.get(1, 1) + r.get(2, 2) - 1.0) / 2.0;
        return distanceTo(other) <= distance && Math.acos(Math.max(-1.0, Math.min(1.0, cosine))) <= angle;
    }

    /** Whether it is in the same tree as another frame. */
    public boolean hasPathTo(AbstractFrame other) {
        return top(this) == top(other);
    }

    private static AbstractFrame top(AbstractFrame frame) {
        AbstractFrame found = frame;
        while (found.getParent() != null) {
            found = found.getParent();
        }
        return found;
    }

    /** Pose in the world. */
    public String toStringInWorld() {
        return transformationFromWorld().toString();
    }

    /** Pose in the parent frame. */
    public String toStringTrafo() {
        return fromParent().toString();
    }

    /** Name of the frame; empty for one that an application created. */
    public String getName() {
        return "";
    }

    /** Path from the root of its object, or from the world, as in "/Table/P1"; a frame of the application has that of its parent. */
    public String getPath() {
        AbstractFrame parent = getParent();
        return parent == null ? "" : parent.getPath();
    }

    /** A frame of the application at the present place, in the same parent. */
    public Frame copy() {
        return new Frame(getParent(), fromParent());
    }

    /** A frame of the application at the present place, in another one. */
    public Frame copy(AbstractFrame reference) {
        return new Frame(reference, reference.transformationTo(this));
    }

    /** The same with redundancy and additional parameters. */
    public Frame copyWithRedundancy() {
        return withRest(copy());
    }

    /** The same in another parent. */
    public Frame copyWithRedundancy(AbstractFrame reference) {
        return withRest(copy(reference));
    }

    private Frame withRest(Frame copy) {
        AbstractFrame other = copy; // whose private fields are visible here
        other.redundancy.putAll(redundancy);
        other.parameters.putAll(parameters);
        return copy;
    }

    public boolean hasAdditionalParameter(String name) {
        return parameters.containsKey(name);
    }

    /** An additional parameter, as set or as stored with a taught frame; null: there is none. */
    @SuppressWarnings("unchecked")
    public <T> T getAdditionalParameter(String name) {
        return (T) parameters.get(name);
    }

    public void setAdditionalParameter(String name, Object value) {
        parameters.put(name, value);
    }

    public double getX() {
        return fromParent().getX();
    }

    public double getY() {
        return fromParent().getY();
    }

    public double getZ() {
        return fromParent().getZ();
    }

    public double getAlphaRad() {
        return fromParent().getAlphaRad();
    }

    public double getBetaRad() {
        return fromParent().getBetaRad();
    }

    public double getGammaRad() {
        return fromParent().getGammaRad();
    }

    public IRedundancyCollection getRedundancyInformationForDevice(Device device) {
        return redundancy.get(device);
    }

    /** By the names of the devices. */
    public Map<String, IRedundancyCollection> getRedundancyInformation() {
        Map<String, IRedundancyCollection> found = new HashMap<>();
        redundancy.forEach((device, one) -> found.put(device.getName(), one));
        return found;
    }

    public void setRedundancyInformation(Device device, IRedundancyCollection value) {
        redundancy.put(device, value);
    }

    static Transformation transformation(ITransformation any) {
        return Transformation.of(any);
    }
}
