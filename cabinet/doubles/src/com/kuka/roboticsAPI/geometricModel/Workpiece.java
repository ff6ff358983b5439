package com.kuka.roboticsAPI.geometricModel;

/** A workpiece: like a tool, held by one. */
public class Workpiece extends PhysicalObject {
    public Workpiece(String name) {
        super(name);
    }

    public Workpiece(String name, LoadData load) {
        super(name, load);
    }
}
