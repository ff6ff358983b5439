package com.kuka.roboticsAPI.persistenceModel;

import java.io.File;
import java.util.ArrayList;
import java.util.Collection;
import java.util.List;

import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.World;
import com.kuka.roboticsAPI.geometricModel.math.ITransformation;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.persistenceModel.templateModel.TemplateElement;

import heptarm.doubles.runtime.ApplicationServices;
import heptarm.doubles.runtime.NotModelled;

/** The project's frames, which an application may change while it runs. The changes last until the virtual cabinet ends. */
public class XmlApplicationDataSource {
    private static final String NAME = "RoboticsAPI.data.xml";

    public void open() {
    }

    public void close() {
    }

    public String getName() {
        return NAME;
    }

    public File getDataFile() {
        return new File(NAME);
    }

    /** All taught frames, parents first. */
    public Collection<ObjectFrame> loadAllFrames() {
        List<ObjectFrame> found = new ArrayList<>(World.Current.getRootFrame().getChildren());
        for (int i = 0; i < found.size(); i++) {
            found.addAll(found.get(i).getChildren());
        }
        return found;
    }

    /** A new frame in its parent, named P1, P2 ... */
    public ObjectFrame addFrame(ObjectFrame parent) {
        int number = 1;
        while (parent.getChild("P" + number) != null) {
            number++;
        }
        return parent.add("P" + number, Transformation.IDENTITY);
    }

    public void removeFrame(ObjectFrame frame) {
        frame.remove();
    }

    public void renameFrame(ObjectFrame frame, String name) {
        frame.rename(name);
    }

    /** The frame keeps its place in the world. */
    public void moveFrame(ObjectFrame frame, ObjectFrame newParent) {
        frame.moveTo(newParent);
    }

    /** Places a frame in its parent. */
    public void changeFrameTransformation(ObjectFrame frame, ITransformation fromParent) {
        frame.place(fromParent);
    }

    /** Not simulated. */
    public Collection<TemplateElement> loadAllTemplates() {
        throw new NotModelled("loadAllTemplates; create tools with createFromTemplate");
    }

    public void save() {
        saveFile();
    }

    public void saveFile() {
        saveFile(false);
    }

    /** Logs that the file on disk stays as it is. */
    public void saveFile(boolean anyway) {
        ApplicationServices.current().logger.info("changed frames last until the virtual cabinet ends; the project's " + NAME
                + " stays as it is");
    }
}
