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

import heptarm.core.CommandRejected;
import heptarm.core.robot.FriSession;
import heptarm.core.robot.MotionJob;
import heptarm.wire.CartesianImpedance;
import heptarm.wire.Code;
import heptarm.wire.FriCommandMode;
import heptarm.wire.FriOpen;
import heptarm.wire.FriQuality;
import heptarm.wire.FriSessionState;
import heptarm.wire.JointImpedance;
import heptarm.wire.SineImpedance;

/** An FRI session of Sunrise. Only this class refers to the option's classes, so a cabinet without it still works. */
final class SunriseFri implements FriSession, IFRISessionListener {
    /** Longest answer period of a commanding client [s]; shorter with a torque overlay. */
    private static final double MAX_PERIOD = 0.01;
    private static final double MAX_PERIOD_TORQUE = 0.005;

    private final FriOpen open;
    private final ControlModes modes;
    private final Mover mover;
    private final FriSession.Listener listener;
    private final FRISession session;

    /** Starts motions of the robot. */
    interface Mover {
        MotionJob move(PositionHold hold, MotionJob.Listener listener) throws CommandRejected;
    }

    private SunriseFri(FriOpen open, LBR robot, ControlModes modes, SunriseSignals signals, Mover mover, FriSession.Listener listener)
            throws CommandRejected {
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

    private static void register(String[] names, SunriseSignals signals, FRIConfiguration configuration) throws CommandRejected {
        if (!carriesSignals()) {
            throw new CommandRejected(Code.UNSUPPORTED, "io", names[0], "none", "the FRI of this cabinet carries no signals; update it to 1.14 or later");
        }
        for (int i = 0; i < names.length; i++) {
            configuration.registerIO(signals.signal(names[i]));
        }
    }

    /** Whether this FRI carries signals; version 1.11 does not. */
    private static boolean carriesSignals() {
        try {
            FRIConfiguration.class.getMethod("registerIO", AbstractIO.class);
            return true;
        } catch (NoSuchMethodException e) {
            return false;
        }
    }

    static SunriseFri of(FriOpen open, LBR robot, ControlModes modes, SunriseSignals signals, Mover mover, FriSession.Listener listener)
            throws CommandRejected {
        SunriseFri fri = new SunriseFri(open, robot, modes, signals, mover, listener);
        FRIChannelInformation now = fri.session.getFRIChannelInformation(); // the state before the listener was added
        FRIChannelInformation reported;
        do {
            reported = now;
            fri.report(reported);
            now = fri.session.getFRIChannelInformation(); // the listener may have received a newer state meanwhile
        } while (now.getFRISessionState() != reported.getFRISessionState() || now.getQuality() != reported.getQuality());
        return fri;
    }

    /** Capabilities that the option adds. */
    static String[] capabilities() {
        List<String> all = new ArrayList<String>(
                Arrays.asList("fri", "fri_monitor", "fri_position", "fri_torque", "fri_wrench"));
        if (carriesSignals()) {
            all.add("fri_io");
        }
        return all.toArray(new String[0]);
    }

    /** Refuses settings that FRI does not support. */
    static void check(FriOpen open) throws CommandRejected {
        double answers = open.period * open.receive_multiplier;
        if (Math.abs(open.period * 1000 - milliseconds(open.period)) > 1e-6) {
            throw new CommandRejected(Code.OUT_OF_RANGE, "period", Double.toString(open.period), "whole milliseconds",
                    "period must be a whole number of milliseconds, got " + open.period * 1000 + " ms");
        }
        if (answers > 0.1) {
            throw new CommandRejected(Code.OUT_OF_RANGE, "receive_multiplier", Integer.toString(open.receive_multiplier), "",
                    "period * receive_multiplier must be at most 0.1 s, got " + answers + " s");
        }
        if (open.command == FriCommandMode.POSE) {
            throw new CommandRejected(Code.UNSUPPORTED, "command", "pose", "monitor, position, wrench, torque",
                    "pose overlays need Sunrise 2.x, this is 1.x; use position");
        }
        if (open.command != FriCommandMode.MONITOR && open.mode instanceof SineImpedance) {
            throw new CommandRejected(Code.MODE_CONFLICT, "mode", name(open), "PositionMode, JointImpedance, CartesianImpedance",
                    "an overlay cannot be combined with a superposed force; use another control mode");
        }
        if (open.command == FriCommandMode.TORQUE && !(open.mode instanceof JointImpedance)) {
            throw new CommandRejected(Code.MODE_CONFLICT, "mode", name(open), "JointImpedance",
                    "a torque overlay needs the control mode JointImpedance, got " + name(open));
        }
        if (open.command == FriCommandMode.WRENCH && !(open.mode instanceof CartesianImpedance)) {
            throw new CommandRejected(Code.MODE_CONFLICT, "mode", name(open), "CartesianImpedance",
                    "a wrench overlay needs the control mode CartesianImpedance, got " + name(open));
        }
        double longest = open.command == FriCommandMode.TORQUE ? MAX_PERIOD_TORQUE : MAX_PERIOD;
        if (open.command != FriCommandMode.MONITOR && answers > longest + 1e-9) {
            throw new CommandRejected(Code.OUT_OF_RANGE, "period", Double.toString(answers), "[0.001, " + longest + "] s",
                    "period * receive_multiplier of a commanding client must be at most " + longest + " s, got " + answers + " s");
        }
    }

    private static String name(FriOpen open) {
        return open.mode == null ? "PositionMode" : open.mode.getClass().getSimpleName();
    }

    private static int milliseconds(double seconds) {
        return (int) Math.round(seconds * 1000);
    }

    public MotionJob command(MotionJob.Listener jobListener) throws CommandRejected {
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
        report(information);
    }

    public void onFRIConnectionQualityChanged(FRIChannelInformation information) {
        report(information);
    }

    /** Convert by name: the order of the constants is undocumented. */
    private void report(FRIChannelInformation information) {
        listener.changed(FriSessionState.valueOf(information.getFRISessionState().name()),
                FriQuality.valueOf(information.getQuality().name()));
    }
}
