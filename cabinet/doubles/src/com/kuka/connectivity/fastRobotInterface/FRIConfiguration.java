package com.kuka.connectivity.fastRobotInterface;

import java.util.ArrayList;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;

import com.kuka.roboticsAPI.deviceModel.Device;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.ioModel.AbstractIO;

import heptarm.doubles.seam.FriSessionSettings;
import heptarm.doubles.seam.FriSignal;

/** Client, ports, rates, signals and frames of an FRI session. */
public class FRIConfiguration {
    private static final int SLOWEST = 100;
    private static final int ANY = 0;
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
            throw new IllegalArgumentException("the address of the FRI client must not be empty");
        }
        return new FRIConfiguration(device, hostName);
    }

    private static int within(String name, int value, int low, int high) {
        if (value < low || value > high) {
            throw new IllegalArgumentException(name + " must be in [" + low + ", " + high + "], got " + value);
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

    /** An input that the client reads, or an output that it reads and writes; at most ten. */
    public void registerIO(AbstractIO io) {
        if (io == null) {
            throw new IllegalArgumentException("signal must not be null");
        }
        signals.add(io.forFri());
    }

    /** A frame that the client provides; at most five. */
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

    /** The settings as the plant takes them; for the simulation. */
    public FriSessionSettings settings() {
        FriSessionSettings settings = new FriSessionSettings();
        settings.host = host;
        settings.sendPeriod = sendPeriod;
        settings.receiveMultiplier = receiveMultiplier;
        settings.remotePort = portOnRemote;
        settings.localPort = portOnController;
        settings.transformations = transformations.keySet().toArray(new String[0]);
        settings.signals = signals.toArray(new FriSignal[0]);
        return settings;
    }
}
