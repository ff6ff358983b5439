package heptarm.app;

import java.util.concurrent.CountDownLatch;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplicationState;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.persistenceModel.PersistenceException;

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
        Log log = new TaskLog(getLogger(), number("heptarm.verbosity", 1) < 1);
        Config config = new Config(text("heptarm.bind", "0.0.0.0"), (int) number("heptarm.port", Protocol.PORT),
                text("heptarm.key", ""), text("heptarm.allow", ""), number("heptarm.heartbeat", 0.5),
                number("heptarm.max_rate", 200.0));
        Tools tools = new Tools(lbr, getApplicationData(), text("heptarm.tools", ""), text("heptarm.frames", ""), log);
        SunriseRobot robot = new SunriseRobot(lbr, tools, getApplicationControl(), log);
        robot.heed(getRecovery());
        CabinetPanel panel = new CabinetPanel(new IoSignals(lbr.getController(), text("heptarm.io", IoSignals.FLANGE), log),
                getApplicationData());
        robot.furnish(panel);
        server = new Server(robot, config, Clocks.find(), log);
        try {
            panel.show(UserKeys.publish(this, server, log));
        } catch (LinkageError e) { // an old cabinet; everything else works without them
            log.warn("this cabinet has no user keys: " + e);
        } catch (RuntimeException e) {
            log.error("publishing the user keys", e);
        }
    }

    private String text(String name, String otherwise) {
        try {
            Object value = getApplicationData().getProcessData(name).getValue();
            return value == null ? otherwise : value.toString();
        } catch (PersistenceException e) {
            return otherwise;
        }
    }

    private double number(String name, double otherwise) {
        String value = text(name, "");
        try {
            return value.trim().length() == 0 ? otherwise : Double.parseDouble(value.trim());
        } catch (NumberFormatException e) {
            getLogger().warn("process data " + name + " is " + value + ", which is no number; " + otherwise + " is used");
            return otherwise;
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
