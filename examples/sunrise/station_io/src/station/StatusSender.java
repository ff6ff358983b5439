package station;

import java.io.IOException;
import java.net.DatagramPacket;
import java.net.DatagramSocket;
import java.net.InetAddress;
import java.util.Locale;
import java.util.concurrent.TimeUnit;

import javax.inject.Inject;

import com.kuka.generated.ioAccess.StationIOGroup;
import com.kuka.roboticsAPI.applicationModel.tasks.CycleBehavior;
import com.kuka.roboticsAPI.applicationModel.tasks.RoboticsAPICyclicBackgroundTask;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.controllerModel.sunrise.ISafetyState;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.sunrise.common.task.categories.BackgroundTaskCategory;

/** Mirrors signals and sends the state of the station to the PC, whether or not an application runs. */
@BackgroundTaskCategory(autoStart = true)
public class StatusSender extends RoboticsAPICyclicBackgroundTask {
    private static final double BAR_PER_VOLT = 0.6;

    @Inject
    private Controller kUKA_Sunrise_Cabinet_1;
    @Inject
    private LBR lbr;
    @Inject
    private StationIOGroup io;

    private DatagramSocket socket;
    private InetAddress pc;
    private int port;
    private long number = 0;
    private long lastError = 0;

    @Override
    public void initialize() {
        initializeCyclic(0, 50, TimeUnit.MILLISECONDS, CycleBehavior.BestEffort);
        try {
            String address = getApplicationData().getProcessData("status_address").getValue();
            pc = InetAddress.getByName(address);
            port = (Integer) getApplicationData().getProcessData("status_port").getValue();
            socket = new DatagramSocket();
        } catch (IOException e) {
            getLogger().error("no status is sent", e);
        }
    }

    @Override
    public void runCyclic() {
        io.setBusy(lbr.hasActiveMotionCommand());
        io.setValve(Math.max(0.0, Math.min(10.0, 5.0 - io.getPressure() * BAR_PER_VOLT)));
        if (socket == null) {
            return;
        }
        ISafetyState safety = lbr.getSafetyState();
        StringBuffer text = new StringBuffer();
        text.append(number++).append(';').append(kUKA_Sunrise_Cabinet_1.getName()).append(';');
        text.append(safety.getOperationMode()).append(';').append(safety.getEmergencyStopInt()).append(';');
        text.append(io.getBusy() ? 1 : 0).append(';').append(io.getDone()).append(';');
        text.append(String.format(Locale.US, "%.2f", io.getValve()));
        for (double q : lbr.getCurrentJointPosition().getInternalArray()) {
            text.append(';').append(String.format(Locale.US, "%.4f", Math.toDegrees(q)));
        }
        byte[] bytes = text.toString().getBytes();
        try {
            socket.send(new DatagramPacket(bytes, bytes.length, pc, port));
        } catch (IOException e) {
            if (System.currentTimeMillis() - lastError > 10000) {
                lastError = System.currentTimeMillis();
                getLogger().warn("status not sent: " + e.getMessage());
            }
        }
    }

    @Override
    public void dispose() {
        if (socket != null) {
            socket.close();
        }
        super.dispose();
    }
}
