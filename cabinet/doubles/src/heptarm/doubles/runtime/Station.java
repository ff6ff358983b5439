package heptarm.doubles.runtime;

import java.nio.ByteBuffer;
import java.util.Map;
import java.util.concurrent.ConcurrentHashMap;
import java.util.concurrent.ExecutorService;
import java.util.concurrent.Executors;
import java.util.concurrent.TimeUnit;

import com.kuka.med.deviceModel.LBRMed;
import com.kuka.roboticsAPI.RoboticsAPIContext;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseController;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseLBR;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.deviceModel.LBRE1Redundancy;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.World;

import heptarm.core.Clock;
import heptarm.doubles.pad.SmartPad;
import heptarm.doubles.plant.Plant;
import heptarm.doubles.plant.PlantCalls;
import heptarm.doubles.plant.PlantClock;
import heptarm.doubles.plant.SharedState;
import heptarm.doubles.plant.TimerQueue;
import heptarm.doubles.seam.RobotDescription;
import heptarm.doubles.seam.Seam;

/** The virtual cabinet of this JVM: plant, shared state, robot, project data, and the dispatch thread of listeners. */
public final class Station {
    private static volatile Station current;

    private final long opened = System.currentTimeMillis();

    public final Plant plant;
    public final RobotDescription description;
    public final SharedState sharedState;
    public final TimerQueue timers;
    public final Map<String, Object> processData = new ConcurrentHashMap<>();
    public final Map<String, String> unusable = new ConcurrentHashMap<>();
    public final Map<String, ObjectTemplate> templates = new ConcurrentHashMap<>();
    public final ExecutorService dispatch;
    public final Controller controller;
    public final LBR robot;
    public final SafetyEvents safetyEvents = new SafetyEvents(this);
    public final RoboticsAPIContext context = new RoboticsAPIContext(this);
    public final SmartPad pad = new SmartPad();
    public final TaskManager tasks = new TaskManager(this);
    public final AutomaticResume automaticResume = new AutomaticResume(this);

    private Station(ByteBuffer memory, Plant plant) {
        this.plant = plant;
        this.description = RobotDescription.decode(plant.describe());
        this.sharedState = new SharedState(memory);
        this.timers = new TimerQueue(sharedState);
        this.dispatch = Executors.newSingleThreadExecutor(task -> {
            Thread thread = new Thread(task, "sunrise-dispatch");
            thread.setDaemon(true);
            return thread;
        });
        this.controller = new SunriseController("KUKA_Sunrise_Cabinet_1", this);
        String name = description.title.replace(' ', '_') + "_1";
        this.robot = name.contains("_Med_") ? new LBRMed(name, controller, this) : new SunriseLBR(name, controller, this);
    }

    /** Creates the cabinet; called once, before anything else. */
    public static Station open(ByteBuffer memory, PlantCalls calls) {
        Station opened = new Station(memory, calls.plant());
        calls.onChange(opened.timers::rouse);
        current = opened;
        return current;
    }

    public static Station current() {
        if (current == null) {
            throw new IllegalStateException("no virtual cabinet is open; call Station.open first");
        }
        return current;
    }

    /** Simulation time. */
    public Clock clock() {
        return new PlantClock();
    }

    /** Simulation time after a duration from now [ns]; the longest durations never end. */
    public long after(long time, TimeUnit unit) {
        long now = clock().nanos();
        long duration = unit.toNanos(time);
        return duration > Long.MAX_VALUE - now ? Long.MAX_VALUE : now + duration;
    }

    /** Time stamp of the cabinet [ms]: the machine's time when it was switched on, and simulation time since. */
    public long stamp() {
        return opened + TimeUnit.NANOSECONDS.toMillis(clock().nanos());
    }

    /** Sleeps for a duration in simulation time [ns], from the present: the newest state may be older while the robot rests. */
    public void sleep(long nanos) throws InterruptedException {
        timers.sleep(clock().nanos() + nanos);
    }

    /** Waits until the last command to the plant shows in its published state. */
    public void settle() {
        try {
            sleep(2 * Seam.TICK_NS);
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
        }
    }

    /** Adds a template of a tool or workpiece. */
    public void addTemplate(String name, ObjectTemplate template) {
        templates.put(name, template);
    }

    /** Adds a taught frame by its path; placed in its parent: x y z [mm], a b c [rad]. */
    public void addFrame(String path, double[] fromParent) {
        ObjectFrame parent = World.Current.getRootFrame();
        String[] parts = path.split("/");
        for (int i = 0; i < parts.length - 1; i++) {
            if (parts[i].length() > 0) {
                parent = parent.getChild(parts[i]);
            }
        }
        parent.add(parts[parts.length - 1], ObjectTemplate.transformation(fromParent));
    }

    /** Sets the redundancy that a taught frame was taught with. */
    public void setRedundancy(String path, double e1, int status, int turn) {
        ObjectFrame frame = World.Current.getRootFrame();
        for (String part : path.split("/")) {
            frame = frame.getChild(part);
        }
        frame.setRedundancyInformation(robot, new LBRE1Redundancy(e1, status, turn));
    }

    /** Sets an additional parameter that a taught frame is stored with. */
    public void setParameter(String path, String name, Object value) {
        ObjectFrame frame = World.Current.getRootFrame();
        for (String part : path.split("/")) {
            frame = frame.getChild(part);
        }
        frame.setAdditionalParameter(name, value);
    }

    /** The safety state has changed; called on the realtime thread of the plant. */
    public void safetyChanged(long flags, long mode) {
        safetyEvents.changed(sharedState.computed(), flags, mode);
    }

    /** Process data whose value cannot be read: an application that asks for them gets this as error. */
    public void setUnusable(String name, String why) {
        unusable.put(name, why);
    }

    public void setProcessData(String name, Object value) {
        processData.put(name, value);
    }
}
