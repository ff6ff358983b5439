package com.kuka.connectivity.fastRobotInterface;

import java.util.ArrayList;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;

import com.kuka.roboticsAPI.deviceModel.Device;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.ioModel.AbstractIO;

import heptarm.doubles.FriSignal;

/** Where an FRI session leads to and how often it sends. */
public class FRIConfiguration {
    private static final int SLOWEST = 100;
    private static final int ANY = -1;
    private static final int PORTS = 65535;

    private final Device device;
    private final String host;
    private final Map<String, AbstractFrame> transformations = new LinkedHashMap<>();
    private final List<FriSignal> signals = new ArrayList<>();
    private int sendPeriod = 10;
    private int receiveMultiplier = 1;
    private int portOnRemote = 30200;
    private int portOnController = ANY;

    private FRIConfiguration(Device device, String host) {
        this.device = device;
        this.host = host;
    }

    public static FRIConfiguration createRemoteConfiguration(Device device, String hostName) {
        if (hostName == null || hostName.isEmpty()) {
            throw new IllegalArgumentException("an FRI session needs the address of its client");
        }
        return new FRIConfiguration(device, hostName);
    }

    private static int within(String name, int value, int low, int high) {
        if (value < low || value > high) {
            throw new IllegalArgumentException(name + " is " + value + "; it has to be in [" + low + ", " + high + "]");
        }
        return value;
    }

    public void setSendPeriodMilliSec(int milliseconds) {
        sendPeriod = within("sendPeriodMilliSec", milliseconds, 1, SLOWEST);
    }

    public void setReceiveMultiplier(int multiplier) {
        receiveMultiplier = within("receiveMultiplier", multiplier, 1, SLOWEST);
    }

    public void setPortOnRemote(int port) {
        portOnRemote = within("portOnRemote", port, 1, PORTS);
    }

    public void setPortOnController(int port) {
        portOnController = within("portOnController", port, 1, PORTS);
    }

    /** An input that the client sees, or an output that it sees and writes; at most ten. */
    public void registerIO(AbstractIO io) {
        if (io == null) {
            throw new IllegalArgumentException("no signal is given");
        }
        signals.add(io.forFri());
    }

    /** A frame that the client leads; at most five. */
    public void registerTransformationProvider(String name, AbstractFrame frame) {
        transformations.put(name, frame);
    }

    public String getHostName() {
        return host;
    }

    public int getPortOnRemote() {
        return portOnRemote;
    }

    public int getSendPeriodMilliSec() {
        return sendPeriod;
    }

    public int getReceiveMultiplier() {
        return receiveMultiplier;
    }

    /** The device whose motions the client may overlay. */
    public Device getDevice() {
        return device;
    }

    /** Own port, -1: chosen by the cabinet; for the simulation. */
    public int portOnController() {
        return portOnController;
    }

    /** Signals that the client sees; for the simulation. */
    public FriSignal[] signals() {
        return signals.toArray(new FriSignal[0]);
    }

    /** Names of the frames that the client leads; for the simulation. */
    public String[] transformationNames() {
        return transformations.keySet().toArray(new String[0]);
    }
}
