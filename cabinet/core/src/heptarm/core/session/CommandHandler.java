package heptarm.core.session;

import heptarm.core.CommandRejected;
import heptarm.core.Log;
import heptarm.core.checks.ProgramChecks;
import heptarm.core.motion.FriMonitors;
import heptarm.core.motion.MotionExecutor;
import heptarm.core.motion.ServoStream;
import heptarm.core.robot.Robot;
import heptarm.core.safety.SafetyMonitor;
import heptarm.core.tools.ToolChange;
import heptarm.core.tools.ToolTable;
import heptarm.wire.Accepted;
import heptarm.wire.Cancel;
import heptarm.wire.Code;
import heptarm.wire.FriClose;
import heptarm.wire.FriCommandMode;
import heptarm.wire.FriOpen;
import heptarm.wire.Message;
import heptarm.wire.Pause;
import heptarm.wire.Recover;
import heptarm.wire.Resume;
import heptarm.wire.Run;
import heptarm.wire.ServoClose;
import heptarm.wire.ServoJoints;
import heptarm.wire.ServoJointsVelocity;
import heptarm.wire.ServoOpen;
import heptarm.wire.ServoPose;
import heptarm.wire.ServoSettings;
import heptarm.wire.SetOverride;
import heptarm.wire.Severity;
import heptarm.wire.Stop;
import heptarm.wire.StopKind;
import heptarm.wire.Violation;

/** Executes commands for the robot, wherever they come from: checks them, then hands them to the part that is responsible. */
public final class CommandHandler {
    private final Robot robot;
    private final MotionExecutor executor;
    private final FriMonitors monitors;
    private final SafetyMonitor safety;
    private final ToolTable tools;
    private final ProgramChecks checks;
    private final PanelRequests panel;
    private final Log log;

    CommandHandler(Robot robot, MotionExecutor executor, FriMonitors monitors, SafetyMonitor safety, ToolTable tools,
            ProgramChecks checks, PanelRequests panel, Log log) {
        this.robot = robot;
        this.executor = executor;
        this.monitors = monitors;
        this.safety = safety;
        this.tools = tools;
        this.checks = checks;
        this.panel = panel;
        this.log = log;
    }

    /** Check the ranges of a command's fields and execute it; returns its id, 0 if it has none. */
    public long execute(Message message) throws CommandRejected {
        validate(message);
        return ((Accepted) answer(message)).id;
    }

    /** Refuses a message with a field outside its range. */
    static void validate(Message message) throws CommandRejected {
        try {
            message.validate("");
        } catch (Violation e) {
            throw new CommandRejected(e.code, e.parameter, e.value, e.allowed, e.getMessage());
        }
    }

    /**
     * Stop the arm; who ended motions of others is named on the smartPAD, and in the log.
     *
     * @param author such as "by panel at 10.0.0.5"
     * @param isForeign it is another one than the controller
     */
    void stop(StopKind kind, String author, boolean isForeign) {
        if (!executor.stop(kind, author)) {
            return;
        }
        log.info("the arm was stopped " + author);
        if (isForeign) {
            robot.panel.show(Severity.WARNING.value(), "heptarm: the arm was stopped " + author);
        }
    }

    /** Execute a command whose fields are in range; returns its answer. */
    Message answer(Message message) throws CommandRejected {
        long id = 0;
        if (message instanceof Stop) {
            stop(((Stop) message).kind, "by the program in the cabinet", false);
        } else if (message instanceof Run) {
            checks.check((Run) message);
            safety.checkReady();
            id = executor.add((Run) message);
        } else if (message instanceof ServoOpen) {
            checks.check((ServoOpen) message);
            safety.checkReady();
            id = executor.open((ServoOpen) message);
        } else if (message instanceof ServoSettings) {
            checks.checkMode(((ServoSettings) message).mode, "mode.");
            runningServo(((ServoSettings) message).servo).changeMode(((ServoSettings) message).mode);
        } else if (message instanceof ServoClose) {
            runningServo(((ServoClose) message).servo);
            executor.cancel(((ServoClose) message).servo);
        } else if (message instanceof FriOpen) {
            id = open((FriOpen) message);
        } else if (message instanceof FriClose) {
            close((FriClose) message);
        } else if (message instanceof Cancel) {
            executor.cancel(((Cancel) message).id);
        } else if (message instanceof Pause) {
            robot.require("pause", "", "a pause");
            robot.motion.pause();
        } else if (message instanceof Resume) {
            robot.require("pause", "", "a pause");
            robot.motion.resume();
        } else if (message instanceof SetOverride) {
            robot.require("override", "", "a speed override");
            robot.motion.setOverride(((SetOverride) message).value);
        } else if (ToolChange.handles(message)) {
            robot.require("tools", "", "tools and workpieces");
            executor.whileIdle(new ToolChange(tools, message));
        } else if (message instanceof Recover) {
            safety.recover();
        } else if (PanelRequests.handles(message)) {
            return panel.execute(message);
        } else {
            throw new CommandRejected(Code.UNSUPPORTED, "this cabinet application does not support message " + message.type()
                    + "; update heptarm on the cabinet");
        }
        return new Accepted(id);
    }

    /** Whether a command begins something that goes on after its answer. */
    static boolean begins(Message message) {
        return message instanceof Run || message instanceof ServoOpen || message instanceof FriOpen;
    }

    /** End what a command has begun. */
    void withdraw(Message message, long id) {
        try {
            if (message instanceof FriOpen) {
                close(new FriClose(id));
            } else {
                executor.cancel(id);
            }
        } catch (CommandRejected e) { // it has ended already
        }
    }

    private ServoStream runningServo(long id) throws CommandRejected {
        ServoStream servo = executor.servo(id);
        if (servo == null) {
            throw new CommandRejected(Code.UNKNOWN_MOTION, "servo", Long.toString(id), "",
                    "servo motion " + id + " is not running; it has ended, or its id is wrong");
        }
        return servo;
    }

    private long open(FriOpen open) throws CommandRejected {
        checks.check(open);
        if (open.command != FriCommandMode.MONITOR) {
            safety.checkReady();
            return executor.open(open);
        }
        long id = executor.number();
        monitors.open(id, open);
        return id;
    }

    private void close(FriClose close) throws CommandRejected {
        if (executor.isFri(close.session)) {
            executor.cancel(close.session);
        } else if (!monitors.close(close.session)) {
            throw new CommandRejected(Code.UNKNOWN_MOTION, "session", Long.toString(close.session), "",
                    "FRI session " + close.session + " is not open; it has ended, or its id is wrong");
        }
    }

    // ------------------------------------------------------------------------------------------ servo targets

    /** Hand over a servo target from a program in the cabinet; refuses a bad one. */
    public void follow(Message target, long now) throws CommandRejected {
        validate(target);
        if (target instanceof ServoJoints) {
            checks.checkJoints(((ServoJoints) target).q, "q");
        }
        stream(target, now, 0);
    }

    static boolean isTarget(int type) {
        return type == ServoJoints.TYPE || type == ServoJointsVelocity.TYPE || type == ServoPose.TYPE;
    }

    /**
     * Hand over a servo target. There is no answer: the status of the stream reports a rejected one.
     *
     * @param number of the target in the session, 0: it has none; one that is not newer than all before is a copy
     */
    void stream(Message message, long sent, long number) {
        ServoStream stream;
        ServoStream.Target target;
        if (message instanceof ServoJoints) {
            ServoJoints one = (ServoJoints) message;
            stream = executor.servo(one.servo);
            target = new ServoStream.Target(one.q, null, null, null, one.watchdog, sent);
        } else if (message instanceof ServoJointsVelocity) {
            ServoJointsVelocity one = (ServoJointsVelocity) message;
            stream = executor.servo(one.servo);
            target = new ServoStream.Target(one.q, one.dq, null, null, one.watchdog, sent);
        } else {
            ServoPose one = (ServoPose) message;
            stream = executor.servo(one.servo);
            target = new ServoStream.Target(null, null, one.xyz, one.quat, one.watchdog, sent);
        }
        if (stream == null || !stream.isNewer(number)) {
            return; // it has just ended, and its client receives that event; or a newer target came by another path
        }
        try {
            validate(message);
            if (target.q != null) {
                checks.checkJoints(target.q, "q");
            }
            stream.offer(target);
        } catch (CommandRejected e) {
            stream.reject(e);
        }
    }
}
