package server;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.linRel;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import java.io.BufferedReader;
import java.io.IOException;
import java.io.InputStreamReader;
import java.io.PrintWriter;
import java.net.ServerSocket;
import java.net.Socket;
import java.net.SocketTimeoutException;
import java.util.StringTokenizer;

import com.kuka.common.ThreadUtil;
import com.kuka.connectivity.motionModel.smartServo.ISmartServoRuntime;
import com.kuka.connectivity.motionModel.smartServo.SmartServo;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplicationState;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.World;
import com.kuka.roboticsAPI.geometricModel.math.Vector;

/**
 * Obeys lines of a PC, tokens with blanks or underscores between them, and answers each of them with a line.
 *
 * joints | pose | force | ptp A1..A7 [speed] | rel X Y Z | servo on | servo A1..A7 | servo off | bye
 */
public class TokenServer extends RoboticsAPIApplication {
    private Controller kuka_Sunrise_Cabinet_1;
    private LBR lbr;
    private ServerSocket server = null;
    private Socket client = null;
    private ISmartServoRuntime servo = null;
    private static volatile boolean running;

    public void initialize() {
        kuka_Sunrise_Cabinet_1 = (Controller) getContext().getControllers().toArray()[0];
        lbr = (LBR) kuka_Sunrise_Cabinet_1.getDevices().toArray()[0];
        running = true;
    }

    public void run() {
        int port = getApplicationData().getProcessData("port").getValue();
        lbr.move(ptp(0., Math.toRadians(30), 0., -Math.PI / 2, 0., Math.toRadians(60), 0.).setJointVelocityRel(0.4));
        try {
            server = new ServerSocket(port);
            server.setSoTimeout(500);
            getLogger().info("waiting on port " + server.getLocalPort());
            while (running && client == null) {
                try {
                    client = server.accept();
                } catch (SocketTimeoutException e) {
                    // look again whether the operator has deselected this
                }
            }
            if (client != null) {
                serve();
            }
        } catch (IOException e) {
            getLogger().error("the connection is lost", e);
        } finally {
            servoOff();
            close();
        }
    }

    private void serve() throws IOException {
        client.setTcpNoDelay(true);
        BufferedReader in = new BufferedReader(new InputStreamReader(client.getInputStream(), "US-ASCII"));
        PrintWriter out = new PrintWriter(client.getOutputStream(), true);
        String line;
        while (running && (line = in.readLine()) != null) {
            String answer;
            try {
                answer = obey(new StringTokenizer(line.trim(), " _"));
            } catch (NumberFormatException e) {
                answer = "error no number: " + e.getMessage();
            } catch (RuntimeException e) {
                getLogger().warn(line, e);
                answer = "error " + e.getClass().getSimpleName() + " " + e.getMessage();
            }
            out.println(answer);
            if (answer.equals("bye")) {
                return;
            }
        }
    }

    private String obey(StringTokenizer tokens) {
        String what = tokens.hasMoreTokens() ? tokens.nextToken().toLowerCase() : "";
        if (what.equals("joints")) {
            return numbers("joints", lbr.getCurrentJointPosition().get());
        } else if (what.equals("pose")) {
            Frame f = lbr.getCurrentCartesianPosition(lbr.getFlange(), World.Current.getRootFrame());
            return numbers("pose", new double[] {f.getX(), f.getY(), f.getZ(), f.getAlphaRad(), f.getBetaRad(), f.getGammaRad()});
        } else if (what.equals("force")) {
            Vector f = lbr.getExternalForceTorque(lbr.getFlange(), World.Current.getRootFrame()).getForce();
            return numbers("force", new double[] {f.getX(), f.getY(), f.getZ()});
        } else if (what.equals("ptp")) {
            JointPosition goal = joints(tokens);
            double speed = tokens.hasMoreTokens() ? Double.parseDouble(tokens.nextToken()) : 0.25;
            lbr.move(ptp(goal).setJointVelocityRel(speed));
            return "done";
        } else if (what.equals("rel")) {
            double x = next(tokens);
            double y = next(tokens);
            double z = next(tokens);
            lbr.getFlange().move(linRel(x, y, z, World.Current.getRootFrame()).setCartVelocity(120));
            return "done";
        } else if (what.equals("servo")) {
            return servo(tokens);
        } else if (what.equals("bye")) {
            return "bye";
        }
        return "error unknown token " + what;
    }

    private String servo(StringTokenizer tokens) {
        if (tokens.countTokens() == 7) {
            if (servo == null) {
                return "error servo is off";
            }
            if (lbr.isReadyToMove()) {
                servo.setDestination(joints(tokens));
            }
            servo.updateWithRealtimeSystem();
            return numbers("servo", servo.getAxisQMsrOnController().get());
        }
        String how = tokens.nextToken();
        if (how.equals("on") && servo == null) {
            SmartServo motion = new SmartServo(lbr.getCurrentJointPosition());
            motion.setJointAccelerationRel(0.3).setJointVelocityRel(0.3).setMinimumTrajectoryExecutionTime(20e-3);
            motion.setTimeoutAfterGoalReach(300);
            lbr.getFlange().moveAsync(motion);
            servo = motion.getRuntime(true);
        } else if (how.equals("off")) {
            servoOff();
        } else {
            return "error servo is on";
        }
        return "done";
    }

    private void servoOff() {
        if (servo != null) {
            servo.stopMotion();
            servo = null;
            while (lbr.hasActiveMotionCommand()) {
                ThreadUtil.milliSleep(10);
            }
        }
    }

    private JointPosition joints(StringTokenizer tokens) {
        JointPosition goal = new JointPosition(lbr.getJointCount());
        for (int i = 0; i < lbr.getJointCount(); i++) {
            goal.set(i, next(tokens));
        }
        return goal;
    }

    private static double next(StringTokenizer tokens) {
        return Double.parseDouble(tokens.hasMoreTokens() ? tokens.nextToken() : "nothing");
    }

    private static String numbers(String name, double[] values) {
        String line = name;
        for (int i = 0; i < values.length; i++) {
            line = line.concat("_").concat(Double.toString(values[i]));
        }
        return line;
    }

    @Override
    public void onApplicationStateChanged(RoboticsAPIApplicationState state) {
        if (state == RoboticsAPIApplicationState.STOPPING) {
            running = false;
        }
        super.onApplicationStateChanged(state);
    }

    private void close() {
        try {
            if (client != null)
                client.close();
            if (server != null)
                server.close();
        } catch (IOException e) {
            getLogger().warn("a socket does not close", e);
        }
    }

    @Override
    public void dispose() {
        close();
        super.dispose();
    }

    /** Auto-generated method stub. Do not modify the contents of this method. */
    public static void main(String[] args) {
        TokenServer app = new TokenServer();
        app.runApplication();
    }
}
