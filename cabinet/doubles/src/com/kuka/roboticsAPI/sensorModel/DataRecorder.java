package com.kuka.roboticsAPI.sensorModel;

import java.io.File;
import java.io.IOException;
import java.io.PrintWriter;
import java.net.MalformedURLException;
import java.net.URL;
import java.util.ArrayList;
import java.util.List;
import java.util.Locale;
import java.util.concurrent.TimeUnit;
import java.util.function.Supplier;

import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.geometricModel.math.Vector;

import heptarm.doubles.plant.Occurrence;
import heptarm.doubles.plant.PeriodicSampler;
import heptarm.doubles.runtime.Station;

/**
 * Records data of the robot to a text file: a line of names, then a line of numbers for each sample, the time in seconds
 * first. A name without a folder is put into the folder in the process data {@code recordings}, otherwise into that for
 * temporary files.
 */
public class DataRecorder {
    private static final String FOLDER = "recordings";

    /** Unit of joint positions. */
    public enum AngleUnit { Degree, Radian }

    private final Station station = Station.current();
    private final List<String> names = new ArrayList<>();
    private final List<Supplier<double[]>> sources = new ArrayList<>();
    private final Occurrence written = new Occurrence();
    private String fileName = "recording.log";
    private long timeout = -1; // [ns]
    private int sampleInterval = 1; // [ms]
    private boolean enabled;
    private PeriodicSampler sampling;
    private boolean begun;
    private PrintWriter out;

    public DataRecorder() {
    }

    /** A duration of -1 records until stopped. */
    public DataRecorder(String fileName, long timeout, TimeUnit unit, int sampleIntervalMs) {
        setFileName(fileName);
        setTimeout(timeout, unit);
        setSampleInterval(sampleIntervalMs);
    }

    private void change() {
        if (enabled) {
            throw new IllegalStateException("the recorder cannot change after enable()");
        }
    }

    public void setFileName(String name) {
        change();
        if (name == null || name.isEmpty()) {
            throw new IllegalArgumentException("the name of the recording's file must not be empty");
        }
        fileName = name;
    }

    public void setTimeout(long time, TimeUnit unit) {
        change();
        if (time == 0 || time < -1) {
            throw new IllegalArgumentException("time must be positive, or -1 for no end, got " + time);
        }
        timeout = time < 0 ? -1 : unit.toNanos(time);
    }

    /** Time between two samples [ms]. */
    public void setSampleInterval(int milliseconds) {
        change();
        if (milliseconds < 1) {
            throw new IllegalArgumentException("the interval must be at least 1 ms, got " + milliseconds + " ms");
        }
        sampleInterval = milliseconds;
    }

    /** The same under another name. */
    public void setSampleRate(int milliseconds) {
        setSampleInterval(milliseconds);
    }

    // ------------------------------------------------------------------------------ data to record
    private DataRecorder add(String name, String[] parts, Supplier<double[]> source) {
        change();
        for (String part : parts) {
            names.add(name + "_" + part);
        }
        sources.add(source);
        return this;
    }

    private static String[] axes(LBR robot) {
        String[] parts = new String[robot.getJointCount()];
        for (int i = 0; i < parts.length; i++) {
            parts[i] = "A" + (i + 1);
        }
        return parts;
    }

    private static double[] numbers(Vector vector) {
        return new double[] {vector.getX(), vector.getY(), vector.getZ()};
    }

    public DataRecorder addInternalJointTorque(LBR robot) {
        return add("internalTorque", axes(robot), () -> robot.getMeasuredTorque().getTorqueValues());
    }

    public DataRecorder addExternalJointTorque(LBR robot) {
        return add("externalTorque", axes(robot), () -> robot.getExternalTorque().getTorqueValues());
    }

    public DataRecorder addCurrentJointPosition(LBR robot, AngleUnit unit) {
        return add("jointPosition", axes(robot), () -> angles(robot.getCurrentJointPosition(), unit));
    }

    public DataRecorder addCommandedJointPosition(LBR robot, AngleUnit unit) {
        return add("commandedJointPosition", axes(robot), () -> angles(robot.getCommandedJointPosition(), unit));
    }

    private static double[] angles(JointPosition position, AngleUnit unit) {
        double[] angles = position.get();
        for (int i = 0; unit == AngleUnit.Degree && i < angles.length; i++) {
            angles[i] = Math.toDegrees(angles[i]);
        }
        return angles;
    }

    /** External force at a frame [N], in the axes of another; null: in its own. */
    public DataRecorder addCartesianForce(AbstractFrame measured, AbstractFrame orientation) {
        return add("force", new String[] {"X", "Y", "Z"},
                () -> numbers(station.robot.getExternalForceTorque(measured, orientation).getForce()));
    }

    /** External torque about a frame's origin [Nm], in the axes of another; null: in its own. */
    public DataRecorder addCartesianTorque(AbstractFrame measured, AbstractFrame orientation) {
        return add("torque", new String[] {"X", "Y", "Z"},
                () -> numbers(station.robot.getExternalForceTorque(measured, orientation).getTorque()));
    }

    /** Position of a frame seen from another [mm]. */
    public DataRecorder addCurrentCartesianPositionXYZ(AbstractFrame measured, AbstractFrame reference) {
        return add("position", new String[] {"X", "Y", "Z"}, () -> place(reference.transformationTo(measured)));
    }

    /** The same of the set-point; the frame is one of the robot. */
    public DataRecorder addCommandedCartesianPositionXYZ(ObjectFrame measured, AbstractFrame reference) {
        return add("commandedPosition", new String[] {"X", "Y", "Z"}, () -> {
            Frame commanded = station.robot.getCommandedCartesianPosition(measured, reference);
            return place(commanded.getTransformationFromParent());
        });
    }

    private static double[] place(Transformation seen) {
        return new double[] {seen.getX(), seen.getY(), seen.getZ()};
    }

    // ------------------------------------------------------------------------------ recording
    /** Prepares the recording; settings cannot change afterwards. */
    public synchronized void enable() {
        if (sources.isEmpty()) {
            throw new IllegalStateException("add data to the recorder before enable()");
        }
        enabled = true;
    }

    private File file() {
        File file = new File(fileName);
        if (file.getParentFile() != null) {
            return file;
        }
        Object folder = station.processData.get(FOLDER);
        return new File(folder == null ? System.getProperty("java.io.tmpdir") : folder.toString(), fileName);
    }

    /** Starts the recording; only once. */
    public synchronized void startRecording() {
        if (!enabled || begun) {
            throw new IllegalStateException(begun ? "a recorder can record only once" : "call enable() before startRecording()");
        }
        begun = true;
        try {
            out = new PrintWriter(file(), "UTF-8");
        } catch (IOException e) {
            throw new IllegalStateException("cannot write " + file(), e);
        }
        out.println("time " + String.join(" ", names));
        sampling = new PeriodicSampler(TimeUnit.MILLISECONDS.toNanos(sampleInterval), this::sample);
        sampling.start();
    }

    private void sample(long nanos) {
        StringBuilder line = new StringBuilder(String.format(Locale.ROOT, "%.3f", nanos * 1e-9));
        for (Supplier<double[]> source : sources) {
            for (double number : source.get()) {
                line.append(String.format(Locale.ROOT, " %.6f", number));
            }
        }
        out.println(line);
        if (timeout > 0 && nanos >= timeout) {
            sampling.stop();
            finish();
        }
    }

    private void finish() {
        out.close();
        written.happen();
    }

    public synchronized void stopRecording() {
        if (sampling == null) {
            throw new IllegalStateException("no recording is running");
        }
        sampling.stop();
        finish();
    }

    public boolean isFileAvailable() {
        return written.hasHappened();
    }

    /** Waits for the end of the recording; false if it does not end within the time. */
    public boolean awaitFileAvailable(long time, TimeUnit unit) {
        try {
            return written.await(time, unit);
        } catch (InterruptedException e) {
            Thread.currentThread().interrupt();
            throw new IllegalStateException("interrupted while waiting for a recording", e);
        }
    }

    public URL getURL() {
        try {
            return file().toURI().toURL();
        } catch (MalformedURLException e) {
            throw new IllegalStateException("no URL for " + file(), e);
        }
    }

    public String getFileName() {
        return fileName;
    }
}
