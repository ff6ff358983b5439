package labs;

import java.net.DatagramPacket;
import java.net.DatagramSocket;
import java.net.InetAddress;
import java.nio.ByteBuffer;

import javax.inject.Inject;

import com.kuka.connectivity.motionModel.smartServo.ISmartServoRuntime;
import com.kuka.connectivity.motionModel.smartServo.SmartServo;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.sun.istack.internal.NotNull;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.*;

/** Joint targets in datagrams, big-endian behind a magic number and a fingerprint; an answer to each. */
public class LcmLikeBridge extends RoboticsAPIApplication {
    private static final int MAGIC = 0x4c433032;
    @Inject
    private LBR lbr;
    private DatagramSocket socket;

    @Override
    public void run() throws Exception {
        lbr.move(ptp(0, 0.4, 0, -1.3, 0, 1.0, 0).setJointVelocityRel(0.8));
        socket = new DatagramSocket(0, InetAddress.getByName("127.0.0.1"));
        SmartServo motion = new SmartServo(lbr.getCurrentJointPosition());
        motion.setJointVelocityRel(0.5).setJointAccelerationRel(0.5).setMinimumTrajectoryExecutionTime(5e-3).setTimeoutAfterGoalReach(3600.0);
        lbr.getFlange().moveAsync(motion);
        ISmartServoRuntime runtime = motion.getRuntime();
        Report.line(getApplicationData(), "LcmLikeBridge port " + socket.getLocalPort() + " " + motion.getJointVelocityRel());
        byte[] buffer = new byte[256];
        while (true) {
            DatagramPacket packet = new DatagramPacket(buffer, buffer.length);
            socket.receive(packet);
            ByteBuffer in = ByteBuffer.wrap(packet.getData(), 0, packet.getLength());
            if (in.getInt() != MAGIC) {
                continue;
            }
            int sequence = in.getInt();
            if (sequence < 0) {
                break;
            }
            JointPosition target = new JointPosition(lbr.getJointCount());
            for (int i = 0; i < target.getAxisCount(); i++) {
                target.set(i, in.getDouble());
            }
            runtime.setDestination(target);
            while (!near(lbr.getCurrentJointPosition(), target)) {
                Thread.sleep(1);
            }
            answer(packet, sequence);
        }
        runtime.stopMotion();
        Report.joints(getApplicationData(), "LcmLikeBridge", lbr);
    }

    private static boolean near(@NotNull JointPosition one, @NotNull JointPosition other) {
        return one.isNearlyEqual(other, 5e-4);
    }

    private void answer(DatagramPacket packet, int sequence) throws Exception {
        ByteBuffer out = ByteBuffer.allocate(8 + 7 * 8);
        out.putInt(MAGIC).putInt(sequence);
        for (double one : lbr.getCurrentJointPosition().get()) {
            out.putDouble(one);
        }
        socket.send(new DatagramPacket(out.array(), out.position(), packet.getSocketAddress()));
    }

    @Override
    public void dispose() {
        if (socket != null) {
            socket.close();
        }
        super.dispose();
    }
}
