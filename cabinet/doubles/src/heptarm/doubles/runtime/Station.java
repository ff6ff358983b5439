package heptarm.doubles;

import java.nio.ByteBuffer;
import java.util.Map;
import java.util.concurrent.ConcurrentHashMap;
import java.util.concurrent.ExecutorService;
import java.util.concurrent.Executors;

import com.kuka.roboticsAPI.RoboticsAPIContext;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseController;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseLBR;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.deviceModel.LBRE1Redundancy;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.World;

/** The one simulated cabinet of this JVM: plant, ring, robot, process data, and the thread that calls listeners. */
public final class Station {
    private static volatile Station current;

    public final Plant plant;
    public final Ring ring;
    public final TickHub hub;
    public final Map<String, Object> processData = new ConcurrentHashMap<>();
    public final Map<String, Template> templates = new ConcurrentHashMap<>();
    public final ExecutorService dispatch;
    public final Controller controller;
    public final LBR robot;
    public final SafetyNews safety = new SafetyNews(this);
    public final RoboticsAPIContext context = new RoboticsAPIContext(this);
    public final Pad pad = new Pad();
    public final Tasks tasks = new Tasks(this);
    public final Resuming resuming = new Resuming(this);

    private Station(ByteBuffer memory, Plant plant) {
        this.plant = plant;
        this.ring = new Ring(memory);
        this.hub = new TickHub(ring);
        this.dispatch = Executors.newSingleThreadExecutor(task -> {
            Thread thread = new Thread(task, "sunrise-dispatch");
            thread.setDaemon(true);
            return thread;
        });
        this.controller = new SunriseController("KUKA_Sunrise_Cabinet_1", this);
        this.robot = new SunriseLBR(plant.title().replace(' ', '_') + "_1", controller, this);
    }

    /** Sets the cabinet up; called once, before anything else. */
    public static Station open(ByteBuffer memory, Plant plant) {
        current = new Station(memory, plant);
        return current;
    }

    public static Station current() {
        if (current == null) {
            throw new IllegalStateException("no virtual cabinet is open");
        }
        return current;
    }

    /** Sleeps for a time of the simulation [ns]. */
    public void sleep(long nanos) throws InterruptedException {
        hub.sleep(ring.newest() * Ring.TICK_NS + nanos);
    }

    /** Waits until what was just told to the plant counts in its states. */
    public void settle() {
        try {
            sleep(2 * Ring.TICK_NS);
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    /** A template of the project: frames by path, the transformation of each from its parent. */
    public void addTemplate(String name, Template template) {
        templates.put(name, template);
    }

    /** A taught frame of the project, by its path. */
    public void addFrame(String path, double[] fromParent) {
        ObjectFrame parent = World.Current.getRootFrame();
        String[] parts = path.split("/");
        for (int i = 0; i < parts.length - 1; i++) {
            if (parts[i].length() > 0) {
                parent = parent.getChild(parts[i]);
            }
        }
        parent.add(parts[parts.length - 1], Template.transformation(fromParent));
    }

    /** The arm that a taught frame was taught with. */
    public void setRedundancy(String path, double e1, int status, int turn) {
        ObjectFrame frame = World.Current.getRootFrame();
        for (String part : path.split("/")) {
            frame = frame.getChild(part);
        }
        frame.setRedundancyInformation(robot, new LBRE1Redundancy(e1, status, turn));
    }

    /** The safety state has changed; called by the plant's thread. */
    public void safetyChanged(long flags, long mode) {
        safety.changed(flags, mode);
    }

    public void setProcessData(String name, Object value) {
        processData.put(name, value);
    }
}
