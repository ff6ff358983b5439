package heptarm.app;

import java.util.concurrent.CountDownLatch;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplicationState;
import com.kuka.roboticsAPI.deviceModel.LBR;

import heptarm.core.Clocks;
import heptarm.core.Log;
import heptarm.core.session.CabinetServer;
import heptarm.core.session.ServerSettings;

/** The application to select on the smartPAD: serves heptarm until it is deselected. */
public class HeptarmApplication extends RoboticsAPIApplication {
    @Inject
    private LBR lbr;

    private final CountDownLatch stopping = new CountDownLatch(1);
    private CabinetServer server;
    private String keyWeakness = "";

    @Override
    public void initialize() {
        ProcessSettings settings = new ProcessSettings(getApplicationData(), new TaskLog(getLogger(), true));
        Log log = new TaskLog(getLogger(), settings.number("heptarm.verbosity") < 1);
        ServerSettings config = new ServerSettings(settings.text("heptarm.bind"),
                (int) settings.number("heptarm.port"), settings.text("heptarm.key"),
                settings.text("heptarm.allow"), settings.number("heptarm.heartbeat"),
                settings.number("heptarm.max_rate"), settings.number("heptarm.datagrams") != 0,
                settings.text("heptarm.reserved_for"));
        keyWeakness = config.keyWeakness();
        SunrisePanel panel = new SunrisePanel(getApplicationData(), getApplicationUI(), log);
        server = new CabinetServer(SunriseRobot.of(lbr, this, panel, settings, log), config, Clocks.find(), log);
        if (config.reservedFor.length() > 0) { // the keys belong to that application
            return;
        }
        try {
            panel.use(UserKeys.publish(this, server, log));
        } catch (LinkageError e) { // an old cabinet; everything else works without user keys
            log.warn("this cabinet has no user keys: " + e);
        } catch (RuntimeException e) {
            log.error("publishing the user keys", e);
        }
    }

    @Override
    public void run() throws Exception {
        if (keyWeakness.length() > 0) {
            throw new IllegalStateException(keyWeakness);
        }
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
