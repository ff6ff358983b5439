package remote;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.lin;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import java.io.BufferedInputStream;
import java.io.DataInputStream;
import java.io.EOFException;
import java.io.IOException;
import java.io.OutputStream;
import java.net.InetSocketAddress;
import java.net.Socket;
import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.util.List;
import java.util.concurrent.atomic.AtomicInteger;

import javax.inject.Inject;
import javax.inject.Named;

import com.kuka.roboticsAPI.applicationModel.IApplicationData;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.conditionModel.ForceCondition;
import com.kuka.roboticsAPI.conditionModel.ICondition;
import com.kuka.roboticsAPI.conditionModel.JointTorqueCondition;
import com.kuka.roboticsAPI.deviceModel.Device;
import com.kuka.roboticsAPI.deviceModel.JointEnum;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.executionModel.CommandInvalidException;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.Tool;
import com.kuka.roboticsAPI.motionModel.ErrorHandlingAction;
import com.kuka.roboticsAPI.motionModel.IErrorHandler;
import com.kuka.roboticsAPI.motionModel.IMotionContainer;
import com.kuka.task.ITaskLogger;

/**
 * Dials the PC and obeys its frames: an int for the length, one for the command, and doubles, all big endian.
 *
 * 1 state, 2 PTP in rad, 3 LIN in mm and rad, 4 stop, 5 LIN until contact, 99 end. Every answer has the command, a
 * status (0 done, 1 refused, 2 failed) and a count of asynchronous errors before its doubles.
 */
public class DialOut extends RoboticsAPIApplication {
    private static final int STATE = 1, PTP = 2, LIN = 3, STOP = 4, TOUCH = 5, END = 99;
    private static final int[] LENGTHS = {0, 0, 7, 6, 0, 7};

    @Inject
    private LBR robot;
    @Inject
    private IApplicationData data;
    @Inject
    private ITaskLogger log;
    @Inject
    @Named("Probe")
    private Tool probe;

    private final AtomicInteger errors = new AtomicInteger();
    private Socket socket;
    private DataInputStream in;
    private OutputStream out;
    private IMotionContainer current;

    @Override
    public void initialize() {
        probe.attachTo(robot.getFlange());
        getApplicationControl().registerMoveAsyncErrorHandler(new IErrorHandler() {
            @Override
            public ErrorHandlingAction handleError(Device device, IMotionContainer failedContainer,
                    List<IMotionContainer> canceledContainers) {
                errors.incrementAndGet();
                log.warn("excluded: " + failedContainer.getCommand().toString() + " " + failedContainer.getErrorMessage()
                        + " and " + canceledContainers.size() + " more");
                return ErrorHandlingAction.Ignore;
            }
        });
    }

    @Override
    public void run() throws Exception {
        robot.move(ptp(0, Math.toRadians(30), 0, -Math.toRadians(90), 0, Math.toRadians(60), 0).setJointVelocityRel(0.5));
        connect();
        boolean goOn = true;
        while (goOn) {
            goOn = exchange();
        }
        log.info("the PC has ended it");
    }

    private void connect() throws IOException {
        String address = data.getProcessData("pc_address").getValue();
        int port = data.getProcessData("pc_port").getValue();
        IOException refused = null;
        for (int attempt = 0; attempt < 20; attempt++) {
            try {
                socket = new Socket();
                socket.setTcpNoDelay(true);
                socket.connect(new InetSocketAddress(address, port), 2000);
                in = new DataInputStream(new BufferedInputStream(socket.getInputStream()));
                out = socket.getOutputStream();
                return;
            } catch (IOException e) {
                refused = e;
                socket.close();
                try {
                    Thread.sleep(250);
                } catch (InterruptedException interrupted) {
                    Thread.currentThread().interrupt();
                    break;
                }
            }
        }
        throw refused;
    }

    private boolean exchange() throws IOException {
        byte[] frame;
        try {
            frame = new byte[in.readInt()];
            in.readFully(frame);
        } catch (EOFException e) {
            return false;
        }
        ByteBuffer buffer = ByteBuffer.wrap(frame).order(ByteOrder.BIG_ENDIAN);
        int command = buffer.getInt();
        double[] values = new double[buffer.remaining() / 8];
        buffer.asDoubleBuffer().get(values);
        int status;
        try {
            status = obey(command, values) ? 0 : 1;
        } catch (CommandInvalidException e) {
            log.error("not possible", e);
            status = 2;
        } catch (IllegalArgumentException e) {
            log.error("wrong values", e);
            status = 1;
        }
        answer(command, status);
        return command != END;
    }

    private boolean obey(int command, double[] v) {
        if (command > 0 && command < LENGTHS.length && v.length != LENGTHS[command]) {
            return false;
        }
        switch (command) {
            case STATE:
            case END:
                return true;
            case PTP:
                overwrite(robot.moveAsync(ptp(new JointPosition(v)).setJointVelocityRel(0.3).setJointAccelerationRel(0.5)));
                return true;
            case LIN:
                Frame goal = new Frame(v[0], v[1], v[2], v[3], v[4], v[5]);
                overwrite(probe.getFrame("/Tip").moveAsync(lin(goal).setCartVelocity(100).setCartAcceleration(500)));
                return true;
            case STOP:
                if (current != null) {
                    current.cancel();
                }
                return true;
            case TOUCH:
                ICondition contact = ForceCondition.createSpatialForceCondition(probe.getDefaultMotionFrame(), v[6])
                        .or(new JointTorqueCondition(JointEnum.J4, -60, 60));
                Frame below = new Frame(v[0], v[1], v[2], v[3], v[4], v[5]);
                IMotionContainer done = probe.move(lin(below).setCartVelocity(30).breakWhen(contact));
                return done.getFiredBreakConditionInfo() != null;
            default:
                return false;
        }
    }

    private void overwrite(IMotionContainer next) {
        if (current != null && !current.isFinished()) {
            current.cancel();
        }
        current = next;
    }

    private void answer(int command, int status) throws IOException {
        double[] joints = robot.getCurrentJointPosition().get();
        double[] torques = robot.getExternalTorque().getTorqueValues();
        Frame tip = robot.getCurrentCartesianPosition(probe.getDefaultMotionFrame());
        ByteBuffer buffer = ByteBuffer.allocate(16 + 8 * (7 + 7 + 6 + 1));
        buffer.putInt(buffer.capacity() - 4).putInt(command).putInt(status).putInt(errors.get());
        for (double one : joints) {
            buffer.putDouble(one);
        }
        for (double one : torques) {
            buffer.putDouble(one);
        }
        buffer.putDouble(tip.getX()).putDouble(tip.getY()).putDouble(tip.getZ());
        buffer.putDouble(tip.getAlphaRad()).putDouble(tip.getBetaRad()).putDouble(tip.getGammaRad());
        buffer.putDouble(robot.hasActiveMotionCommand() ? 1 : 0);
        out.write(buffer.array());
        out.flush();
    }

    @Override
    public void dispose() {
        if (socket != null) {
            try {
                socket.close();
            } catch (IOException e) {
                log.warn("the socket does not close");
            }
        }
        probe.detach();
        super.dispose();
    }
}
