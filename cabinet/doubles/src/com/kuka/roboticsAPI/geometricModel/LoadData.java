package com.kuka.roboticsAPI.geometricModel;

import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

/** Mass [kg], centre of mass with the principal axes (millimetres, in the object's root), principal moments. Mutable. */
public class LoadData {
    private double mass;
    private Transformation centre = Transformation.IDENTITY;
    private Inertia inertia = Inertia.of(0, 0, 0);

    public LoadData() {
    }

    public LoadData(double mass, ITransformation centreOfMass, Inertia inertia) {
        setMass(mass);
        setCenterOfMass(centreOfMass);
        this.inertia = inertia;
    }

    /** Copies another; for the simulation. */
    public void take(LoadData other) {
        mass = other.mass;
        centre = other.centre;
        inertia = other.inertia;
    }

    public double getMass() {
        return mass;
    }

    public void setMass(double kilograms) {
        if (!(kilograms >= 0)) {
            throw new IllegalArgumentException("the mass must not be negative, got " + kilograms + " kg");
        }
        mass = kilograms;
    }

    public void setCenterOfMass(double x, double y, double z) {
        setCenterOfMass(Transformation.ofTranslation(x, y, z));
    }

    public void setCenterOfMass(ITransformation transformation) {
        centre = Transformation.of(transformation);
    }

    /** For the simulation. */
    public Transformation centre() {
        return centre;
    }

    /** For the simulation. */
    public Inertia inertia() {
        return inertia;
    }
}
