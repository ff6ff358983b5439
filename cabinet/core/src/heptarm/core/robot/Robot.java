package heptarm.core.robot;

import java.util.Arrays;

import heptarm.core.CommandRejected;
import heptarm.wire.Code;
import heptarm.wire.RobotInfo;

/** A robot as the core sees it, in SI units: a description, and one port for each concern. */
public final class Robot {
    public final RobotInfo info;
    /** Display name of the cabinet. */
    public final String cabinet;
    /** Whether the robot is simulated. */
    public final boolean isVirtual;
    /** Names of the supported motions, control modes and functions. */
    public final String[] capabilities;
    public final MotionPort motion;
    public final Sensors sensors;
    public final SafetyPort safety;
    public final ToolPort tools;
    public final SignalPort signals;
    public final PanelPort panel;

    public Robot(RobotInfo info, String cabinet, boolean isVirtual, String[] capabilities, MotionPort motion, Sensors sensors,
            SafetyPort safety, ToolPort tools, SignalPort signals, PanelPort panel) {
        this.info = info;
        this.cabinet = cabinet;
        this.isVirtual = isVirtual;
        this.capabilities = capabilities;
        this.motion = motion;
        this.sensors = sensors;
        this.safety = safety;
        this.tools = tools;
        this.signals = signals;
        this.panel = panel;
    }

    /** Refuses what this robot cannot do, by the name of the capability and what a client has asked for. */
    public void require(String capability, String parameter, String request) throws CommandRejected {
        if (!Arrays.asList(capabilities).contains(capability)) {
            throw new CommandRejected(Code.UNSUPPORTED, parameter, request, "",
                    "this cabinet does not support " + request + " (capability " + capability + ")");
        }
    }
}
