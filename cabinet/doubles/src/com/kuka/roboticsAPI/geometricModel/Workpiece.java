package com.kuka.roboticsAPI.geometricModel;

/** A workpiece, attached to a tool. */
public class Workpiece extends PhysicalObject {
    public Workpiece(String name) {
        super(name);
    }

    public Workpiece(String name, LoadData load) {
        super(name, load);
    }
}
