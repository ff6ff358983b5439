package heptarm.app2;

import java.util.concurrent.CountDownLatch;

import javax.inject.Inject;

import com.kuka.io.IIoDefinitionProvider;
import com.kuka.io.IIoValueProvider;
import com.kuka.roboticsAPI.applicationModel.IApplicationControl;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.sensitivity.LBR;
import com.kuka.servoing.api.common.IServoingCapability;

import heptarm.core.Clocks;
import heptarm.core.Log;
import heptarm.core.robot.Robot;
import heptarm.core.session.CabinetServer;
import heptarm.core.session.ServerSettings;

/**
 * A preview for Sunrise.OS 2.x: serves heptarm until it is deselected.
 *
 * <p>Written from facts in public programs, never compiled against KUKA's classes and never run on such a cabinet. It uses only
 * names that programs on such cabinets use; what else heptarm can do is refused, and the safety state is reported as unknown.
 */
public class HeptarmApplication extends RoboticsAPIApplication {
    private static final CountDownLatch FOREVER = new CountDownLatch(1);

    @Inject
    private LBR lbr;
    @Inject
    private IApplicationControl control;
    @Inject
    private IServoingCapability servoing;
    @Inject
    private IIoDefinitionProvider definitions;
    @Inject
    private IIoValueProvider values;

    private CabinetServer server;
    private String keyWeakness = "";

    @Override
    public void initialize() {
        Log log = new Sunrise2Log(getLogger());
        log.warn("heptarm for Sunrise 2.x is a preview: written from facts, never run on such a cabinet before");
        ServerSettings config = new ServerSettings(Settings.text("heptarm.bind"), (int) Settings.number("heptarm.port"),
                Settings.text("heptarm.key"), Settings.text("heptarm.allow"), Settings.number("heptarm.heartbeat"),
                Settings.number("heptarm.max_rate"), Settings.number("heptarm.datagrams") != 0, "");
        keyWeakness = config.keyWeakness();
        Robot robot = Sunrise2Robot.of(lbr, control, servoing, new Sunrise2Signals(lbr, definitions, values, log), log);
        server = new CabinetServer(robot, config, Clocks.find(), log);
    }

    @Override
    public void run() throws Exception {
        if (keyWeakness.length() > 0) {
            throw new IllegalStateException(keyWeakness);
        }
        System.setProperty("heptarm.port.bound", Integer.toString(server.start()));
        try {
            FOREVER.await(); // the state that ends an application is unknown; its thread is interrupted, as far as is known
        } catch (InterruptedException e) {
            getLogger().info("heptarm was deselected");
        }
    }

    /** Without the method of the superclass, which seems to throw checked exceptions in 2.x. */
    @Override
    public void dispose() {
        if (server != null) {
            server.close();
        }
    }
}
