package heptarm.app;

import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;
import java.util.concurrent.TimeUnit;

import com.kuka.connectivity.fastRobotInterface.ClientCommandMode;
import com.kuka.connectivity.fastRobotInterface.FRIChannelInformation;
import com.kuka.connectivity.fastRobotInterface.FRIConfiguration;
import com.kuka.connectivity.fastRobotInterface.FRIJointOverlay;
import com.kuka.connectivity.fastRobotInterface.FRISession;
import com.kuka.connectivity.fastRobotInterface.IFRISessionListener;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.ioModel.AbstractIO;
import com.kuka.roboticsAPI.motionModel.PositionHold;

import heptarm.core.Fri;
import heptarm.core.Job;
import heptarm.core.Refusal;
import heptarm.wire.CartesianImpedance;
import heptarm.wire.Code;
import heptarm.wire.FriCommandMode;
import heptarm.wire.FriOpen;
import heptarm.wire.FriQuality;
import heptarm.wire.FriSessionState;
import heptarm.wire.JointImpedance;
import heptarm.wire.SineImpedance;

/** An FRI session of Sunrise. Only this class names the option's classes, so that a cabinet without it still runs. */
final class SunriseFri implements Fri, IFRISessionListener {
    /** A client that commands has to be asked at least this often [s]; torques more often still. */
    private static final double SLOWEST = 0.01;
    private static final double SLOWEST_TORQUE = 0.005;

    private final FriOpen open;
    private final Modes modes;
    private final Mover mover;
    private final Fri.Listener listener;
    private final FRISession session;

    /** Commands motions of the robot. */
    interface Mover {
        Job move(PositionHold hold, Job.Listener listener) throws Refusal;
    }

    private SunriseFri(FriOpen open, LBR robot, Modes modes, IoSignals signals, Mover mover, Fri.Listener listener)
            throws Refusal {
        this.open = open;
        this.modes = modes;
        this.mover = mover;
        this.listener = listener;
        FRIConfiguration configuration = FRIConfiguration.createRemoteConfiguration(robot, open.host);
        configuration.setPortOnRemote(open.port);
        configuration.setSendPeriodMilliSec(milliseconds(open.period));
        configuration.setReceiveMultiplier(open.receive_multiplier);
        if (open.io.length > 0) {
            register(open.io, signals, configuration);
        }
        session = new FRISession(configuration);
        session.addFRISessionListener(this);
    }

    private static void register(String[] names, IoSignals signals, FRIConfiguration configuration) throws Refusal {
        if (!carriesSignals()) {
            throw new Refusal(Code.UNSUPPORTED, "io", names[0], "none", "this cabinet's FRI carries no signals; they came with 1.14");
        }
        for (int i = 0; i < names.length; i++) {
            configuration.registerIO(signals.signal(names[i]));
        }
    }

    /** FRI 1.11 has none. */
    private static boolean carriesSignals() {
        try {
            FRIConfiguration.class.getMethod("registerIO", AbstractIO.class);
            return true;
        } catch (NoSuchMethodException e) {
            return false;
        }
    }

    static SunriseFri of(FriOpen open, LBR robot, Modes modes, IoSignals signals, Mover mover, Fri.Listener listener)
            throws Refusal {
        SunriseFri fri = new SunriseFri(open, robot, modes, signals, mover, listener);
        FRIChannelInformation now = fri.session.getFRIChannelInformation(); // from before the listener was there
        FRIChannelInformation told;
        do {
            told = now;
            fri.tell(told);
            now = fri.session.getFRIChannelInformation(); // the listener may have told newer things meanwhile
        } while (now.getFRISessionState() != told.getFRISessionState() || now.getQuality() != told.getQuality());
        return fri;
    }

    /** What the option adds to the cabinet's capabilities. */
    static String[] capabilities() {
        List<String> all = new ArrayList<String>(
                Arrays.asList("fri", "fri_monitor", "fri_position", "fri_torque", "fri_wrench"));
        if (carriesSignals()) {
            all.add("fri_io");
        }
        return all.toArray(new String[0]);
    }

    /** Refuses what FRI cannot do. */
    static void check(FriOpen open) throws Refusal {
        double answers = open.period * open.receive_multiplier;
        if (Math.abs(open.period * 1000 - milliseconds(open.period)) > 1e-6) {
            throw new Refusal(Code.OUT_OF_RANGE, "period", Double.toString(open.period), "whole milliseconds",
                    "FRI sends every whole number of milliseconds, not every " + open.period + " s");
        }
        if (answers > 0.1) {
            throw new Refusal(Code.OUT_OF_RANGE, "receive_multiplier", Integer.toString(open.receive_multiplier), "",
                    "the client would answer every " + answers + " s; at most 0.1 s are legal");
        }
        if (open.command == FriCommandMode.POSE) {
            throw new Refusal(Code.UNSUPPORTED, "command", "pose", "monitor, position, wrench, torque",
                    "Cartesian pose overlays came with Sunrise 2.x; this application runs on 1.x");
        }
        if (open.command != FriCommandMode.MONITOR && open.mode instanceof SineImpedance) {
            throw new Refusal(Code.MODE_CONFLICT, "mode", name(open), "PositionMode, JointImpedance, CartesianImpedance",
                    "no overlay goes with a superposed force");
        }
        if (open.command == FriCommandMode.TORQUE && !(open.mode instanceof JointImpedance)) {
            throw new Refusal(Code.MODE_CONFLICT, "mode", name(open), "JointImpedance",
                    "a torque overlay needs joint impedance under it");
        }
        if (open.command == FriCommandMode.WRENCH && !(open.mode instanceof CartesianImpedance)) {
            throw new Refusal(Code.MODE_CONFLICT, "mode", name(open), "CartesianImpedance",
                    "a wrench overlay needs Cartesian impedance under it");
        }
        double slowest = open.command == FriCommandMode.TORQUE ? SLOWEST_TORQUE : SLOWEST;
        if (open.command != FriCommandMode.MONITOR && answers > slowest + 1e-9) {
            throw new Refusal(Code.OUT_OF_RANGE, "period", Double.toString(answers), "[0.001, " + slowest + "] s",
                    "a client that commands has to answer at least every " + slowest + " s");
        }
    }

    private static String name(FriOpen open) {
        return open.mode == null ? "PositionMode" : open.mode.getClass().getSimpleName();
    }

    private static int milliseconds(double seconds) {
        return (int) Math.round(seconds * 1000);
    }

    public Job command(Job.Listener jobListener) throws Refusal {
        PositionHold hold = new PositionHold(modes.of(open.mode), -1, TimeUnit.SECONDS);
        hold.addMotionOverlay(new FRIJointOverlay(session, mode()));
        return mover.move(hold, jobListener);
    }

    private ClientCommandMode mode() {
        switch (open.command) {
            case TORQUE:
                return ClientCommandMode.TORQUE;
            case WRENCH:
                return ClientCommandMode.WRENCH;
            default:
                return ClientCommandMode.POSITION;
        }
    }

    public void close() {
        session.close();
    }

    public void onFRISessionStateChanged(FRIChannelInformation information) {
        tell(information);
    }

    public void onFRIConnectionQualityChanged(FRIChannelInformation information) {
        tell(information);
    }

    /** By their names: nothing is known of the constants' order. */
    private void tell(FRIChannelInformation information) {
        listener.changed(FriSessionState.valueOf(information.getFRISessionState().name()),
                FriQuality.valueOf(information.getQuality().name()));
    }
}
