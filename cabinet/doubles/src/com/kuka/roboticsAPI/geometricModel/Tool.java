package com.kuka.roboticsAPI.geometricModel;

/** A tool: frames, and load data that apply while it is attached to a robot. */
public class Tool extends PhysicalObject {
    public Tool(String name) {
        super(name);
    }

    public Tool(String name, LoadData load) {
        super(name, load);
    }
}
