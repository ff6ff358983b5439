package heptarm.app2;

import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;

import com.kuka.roboticsAPI.applicationModel.IApplicationControl;
import com.kuka.sensitivity.LBR;
import com.kuka.servoing.api.common.IServoingCapability;

import heptarm.core.CommandRejected;
import heptarm.core.Log;
import heptarm.core.robot.PanelPort;
import heptarm.core.robot.Robot;
import heptarm.core.robot.RobotModels;
import heptarm.core.robot.SafetyPort;
import heptarm.core.robot.ToolPort;
import heptarm.wire.AskOperator;
import heptarm.wire.Code;
import heptarm.wire.FrameInfo;
import heptarm.wire.OperationMode;
import heptarm.wire.RobotInfo;
import heptarm.wire.SafetyBits;
import heptarm.wire.SafetyState;
import heptarm.wire.SetKey;
import heptarm.wire.ToolInfo;

/** Assembles the robot of a Sunrise 2.x cabinet for the core, with what is unknown of it reported as unknown or refused. */
final class Sunrise2Robot {
    private static final String[] CAPABILITIES = {"ptp", "ptp_pose", "lin_rel", "hold", "conditions", "io", "joint_impedance",
        "cartesian_impedance", "servo", "servo_pose", "sunrise2_preview"};

    private Sunrise2Robot() {
    }

    static Robot of(LBR lbr, IApplicationControl control, IServoingCapability servoing, Sunrise2Signals signals, Log log) {
        RobotInfo info = RobotModels.describe(Settings.text("heptarm.robot"), lbr.getJointLimits().getMinJointPosition().toArray(),
                lbr.getJointLimits().getMaxJointPosition().toArray());
        List<String> capabilities = new ArrayList<>(Arrays.asList(CAPABILITIES));
        capabilities.addAll(Arrays.asList(Sunrise2Fri.CAPABILITIES));
        return new Robot(info, "Sunrise 2.x (preview)", false, capabilities.toArray(new String[0]),
                new Sunrise2Motions(lbr, control, servoing, log), new Sunrise2Sensors(lbr), new UnknownSafety(lbr), new NoTools(),
                signals, new NoPanel(log));
    }

    /** No public 2.x program reads the safety state, the operation mode or the readiness, so they are unknown, never fine. */
    private static final class UnknownSafety implements SafetyPort {
        private final LBR lbr;

        UnknownSafety(LBR lbr) {
            this.lbr = lbr;
        }

        @Override
        public SafetyState read(long stamp) {
            int moving = lbr.hasActiveMotionCommand() ? SafetyBits.MOVING : 0;
            return new SafetyState(stamp, SafetyBits.UNKNOWN | moving, OperationMode.UNKNOWN);
        }

        @Override
        public void recover() throws CommandRejected {
            throw unsupported("", "recover");
        }
    }

    /** The flange is the only motion frame: workpieces, inertia and templates of 2.x are unknown. */
    private static final class NoTools implements ToolPort {
        @Override
        public ToolInfo[] templates() {
            return new ToolInfo[0];
        }

        @Override
        public ToolInfo template(String name) {
            return null;
        }

        @Override
        public FrameInfo[] frames() {
            return new FrameInfo[0];
        }

        @Override
        public void attach(ToolInfo tool, String motionFrame) throws CommandRejected {
            throw unsupported("", "tools");
        }

        @Override
        public void load(ToolInfo workpiece, boolean isSafety) throws CommandRejected {
            throw unsupported("", "workpieces");
        }

        @Override
        public ToolInfo loadTemplate(String name, boolean isSafety) throws CommandRejected {
            throw unsupported("", "workpieces");
        }

        @Override
        public void unload() throws CommandRejected {
            throw unsupported("", "workpieces");
        }
    }

    /** Messages go to the log. */
    private static final class NoPanel implements PanelPort {
        private final Log log;

        NoPanel(Log log) {
            this.log = log;
        }

        @Override
        public void setKey(SetKey key) throws CommandRejected {
            throw unsupported("", "user keys");
        }

        @Override
        public String processData(String name) throws CommandRejected {
            throw unsupported("name", "process data");
        }

        @Override
        public void setProcessData(String name, String value) throws CommandRejected {
            throw unsupported("name", "process data");
        }

        @Override
        public int ask(AskOperator dialog) {
            throw new IllegalStateException("the core asks only where the robot has dialogs");
        }

        @Override
        public void show(int severity, String text) {
            log.warn(text);
        }
    }

    /** What this preview refuses, since no public program shows how a 2.x cabinet does it. */
    static CommandRejected unsupported(String parameter, String what) {
        return new CommandRejected(Code.UNSUPPORTED, parameter, what, "",
                "heptarm's preview for Sunrise 2.x does not support " + what
                        + ": how such a cabinet does it is unknown; run examples/sunrise/probe2 on it and report the output");
    }
}
