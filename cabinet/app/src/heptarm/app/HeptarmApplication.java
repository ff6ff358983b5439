package heptarm.app;

import java.util.concurrent.CountDownLatch;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplicationState;
import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.core.Clocks;
import heptarm.core.Config;
import heptarm.core.Log;
import heptarm.core.Server;
import heptarm.wire.Protocol;

/** The application that a lab selects on the smartPAD: serves heptarm until it is deselected. */
public class HeptarmApplication extends RoboticsAPIApplication {
    @Inject
    private LBR lbr;

    private final CountDownLatch stopping = new CountDownLatch(1);
    private Server server;

    @Override
    public void initialize() {
        ProcessSettings settings = new ProcessSettings(getApplicationData(), new TaskLog(getLogger(), true));
        Log log = new TaskLog(getLogger(), settings.number("heptarm.verbosity", 1) < 1);
        Config config = new Config(settings.text("heptarm.bind", "0.0.0.0"),
                (int) settings.number("heptarm.port", Protocol.PORT), settings.text("heptarm.key", ""),
                settings.text("heptarm.allow", ""), settings.number("heptarm.heartbeat", 0.5),
                settings.number("heptarm.max_rate", 200.0));
        SunriseRobot robot = CabinetArm.robot(lbr, this, settings, log);
        server = new Server(robot, config, Clocks.find(), log);
        try {
            robot.panel().show(UserKeys.publish(this, server, log));
        } catch (LinkageError e) { // an old cabinet; everything else works without them
            log.warn("this cabinet has no user keys: " + e);
        } catch (RuntimeException e) {
            log.error("publishing the user keys", e);
        }
    }

    @Override
    public void run() throws Exception {
        System.setProperty("heptarm.port.bound", Integer.toString(server.start()));
        try {
            stopping.await();
        } catch (InterruptedException e) {
            getLogger().info("heptarm was deselected");
        }
    }

    @Override
    public void onApplicationStateChanged(RoboticsAPIApplicationState state) {
        if (state == RoboticsAPIApplicationState.STOPPING) {
            stopping.countDown();
        }
        super.onApplicationStateChanged(state);
    }

    @Override
    public void dispose() {
        try {
            if (server != null) {
                server.close();
            }
        } finally {
            super.dispose();
        }
    }
}
