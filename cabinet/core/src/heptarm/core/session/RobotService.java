package heptarm.core.session;

import heptarm.core.Clock;
import heptarm.core.EventBus;
import heptarm.core.Log;
import heptarm.core.checks.ProgramChecks;
import heptarm.core.motion.ConditionWatcher;
import heptarm.core.motion.FriMonitors;
import heptarm.core.motion.MotionExecutor;
import heptarm.core.motion.MotionReporter;
import heptarm.core.motion.TriggerActions;
import heptarm.core.robot.Robot;
import heptarm.core.safety.SafetyMonitor;
import heptarm.core.safety.Watchdog;
import heptarm.core.state.SignalTable;
import heptarm.core.state.StateReader;
import heptarm.core.state.StateSampler;
import heptarm.core.tools.ToolTable;
import heptarm.wire.Cause;

/** The robot with everything that moves and monitors it; the network server and the Java API build on it. */
public final class RobotService {
    private static final int SAFETY_ROUNDS = 5;

    public final Robot robot;
    public final Clock clock;
    public final EventBus events = new EventBus();
    public final ToolTable tools;
    public final StateReader reader;
    public final SafetyMonitor safety;
    public final MotionExecutor executor;
    public final ControlAuthority authority;
    public final CommandHandler commands;
    private final OperatorDialogs dialogs;
    final StateSampler sampler;
    final Watchdog watchdog;
    private final FriMonitors monitors;
    private final Log log;

    public RobotService(Robot robot, Clock clock, Log log) {
        this.robot = robot;
        this.clock = clock;
        this.log = log;
        SignalTable signals = new SignalTable(robot.signals);
        safety = new SafetyMonitor(robot.safety, events, clock);
        tools = new ToolTable(robot.tools, events);
        reader = new StateReader(robot.sensors, clock);
        MotionReporter reporter = new MotionReporter(events, reader, clock, log);
        executor = new MotionExecutor(robot.motion, robot.sensors, new ConditionWatcher(robot.sensors, robot.signals, clock, log), reporter,
                new TriggerActions(signals, reporter, clock), safety, clock, log);
        safety.add(executor);
        monitors = new FriMonitors(robot.motion, reporter, clock, log);
        authority = new ControlAuthority(robot.motion, executor, monitors, safety, events, log);
        dialogs = new OperatorDialogs(robot.panel, events, log);
        sampler = new StateSampler(robot, reader, executor, signals, tools, clock, log);
        commands = new CommandHandler(robot, executor, monitors, safety, tools, new ProgramChecks(robot, tools, signals),
                new PanelRequests(signals, robot, dialogs), log);
        watchdog = new Watchdog(clock, log);
        watchdog.add("FRI sessions", 1, monitors);
        watchdog.add("the safety state", SAFETY_ROUNDS, safety);
    }

    /** Start the threads. */
    public void start() {
        executor.start();
        sampler.start();
        watchdog.start();
    }

    /** Stop whatever moves, for a reason that its clients receive. */
    public void stop(String why) {
        executor.stopAll(Cause.STOPPED, why);
    }

    /** End all motions and stop the robot; no motion starts after that. */
    void stopMotion() {
        executor.close();
        monitors.closeAll();
        try {
            robot.motion.stop();
        } catch (RuntimeException e) { // the threads end all the same
            log.error("stopping the robot", e);
        }
    }

    void endThreads() {
        dialogs.close();
        watchdog.close();
        sampler.close();
    }

    /** Stop motion and end all threads. */
    public void close() {
        stopMotion();
        endThreads();
    }
}
