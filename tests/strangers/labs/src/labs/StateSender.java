package labs;

import java.net.DatagramPacket;
import java.net.DatagramSocket;
import java.net.InetAddress;
import java.util.concurrent.TimeUnit;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.tasks.CycleBehavior;
import com.kuka.roboticsAPI.applicationModel.tasks.RoboticsAPICyclicBackgroundTask;
import com.kuka.roboticsAPI.deviceModel.LBR;

/** Sends the state in lines of text; a bridge on the PC turns them into messages. */
public class StateSender extends RoboticsAPICyclicBackgroundTask {
    static volatile int sent;
    @Inject
    private LBR lbr;
    private DatagramSocket socket;
    private int port;

    @Override
    public void initialize() {
        initializeCyclic(0, 50, TimeUnit.MILLISECONDS, CycleBehavior.BestEffort);
        port = (Integer) getApplicationData().getProcessData("lab.port").getValue();
        try {
            socket = new DatagramSocket();
        } catch (java.net.SocketException e) {
            getLogger().error("no socket", e);
        }
    }

    @Override
    protected void runCyclic() {
        StringBuilder text = new StringBuilder("joint_states");
        for (double one : lbr.getCurrentJointPosition().get()) {
            text.append(' ').append(one);
        }
        byte[] data = text.toString().getBytes();
        try {
            socket.send(new DatagramPacket(data, data.length, InetAddress.getByName("127.0.0.1"), port));
            sent++;
        } catch (java.io.IOException e) {
            getLogger().warn("not sent");
        }
    }

    @Override
    public void dispose() {
        socket.close();
        super.dispose();
    }
}
