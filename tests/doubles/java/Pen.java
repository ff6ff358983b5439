package sample;

import com.kuka.roboticsAPI.geometricModel.Tool;

/** The project's own class of a tool, named by its template. */
public class Pen extends Tool {
    public Pen(String name) {
        super(name);
    }
}
