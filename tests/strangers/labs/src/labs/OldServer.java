package labs;

import java.io.BufferedReader;
import java.io.InputStreamReader;
import java.io.PrintWriter;
import java.net.InetAddress;
import java.net.ServerSocket;
import java.net.Socket;

import sun.misc.BASE64Decoder;
import sun.reflect.generics.reflectiveObjects.NotImplementedException;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.applicationModel.tasks.ITaskLogger;
import com.kuka.roboticsAPI.controllerModel.Controller;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.motionModel.*;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.*;

/** Written for Sunrise 1.5: servo motions in their old package, targets as Base64 in lines of text. */
public class OldServer extends RoboticsAPIApplication {
    private LBR lbr;
    private ITaskLogger logger;

    public void initialize() {
        Controller cabinet = (Controller) getContext().getControllers().toArray()[0];
        lbr = (LBR) cabinet.getDevices().toArray()[0];
        logger = getLogger();
    }

    public void run() throws Exception {
        lbr.move(ptp(0, 0.4, 0, -1.3, 0, 1.0, 0).setJointVelocityRel(0.8));
        ServerSocket server = new ServerSocket(0, 1, InetAddress.getByName("127.0.0.1"));
        Report.line(getApplicationData(), "OldServer port " + server.getLocalPort());
        Socket client = server.accept();
        server.close();
        BufferedReader in = new BufferedReader(new InputStreamReader(client.getInputStream(), "US-ASCII"));
        PrintWriter out = new PrintWriter(client.getOutputStream(), true);
        DirectServo motion = new DirectServo(lbr.getCurrentJointPosition());
        motion.setMinimumTrajectoryExecutionTime(20e-3).setTimeoutAfterGoalReach(3600.0);
        lbr.moveAsync(motion);
        IDirectServoRuntime runtime = motion.getRuntime();
        for (String line = in.readLine(); line != null; line = in.readLine()) {
            String[] words = new String(new BASE64Decoder().decodeBuffer(line), "US-ASCII").split(" ");
            if (words[0].equals("joints")) {
                JointPosition wanted = new JointPosition(7);
                for (int i = 0; i < 7; i++) {
                    wanted.set(i, Double.parseDouble(words[i + 1]));
                }
                runtime.setDestination(wanted);
                while (!lbr.getCurrentJointPosition().isNearlyEqual(wanted, 5e-4)) {
                    Thread.sleep(1);
                }
                out.println("ok");
            } else if (words[0].equals("end")) {
                break;
            } else {
                try {
                    throw new NotImplementedException();
                } catch (NotImplementedException e) {
                    logger.warn("unknown: " + words[0]);
                    out.println("unknown");
                }
            }
        }
        runtime.stopMotion();
        client.close();
        Report.joints(getApplicationData(), "OldServer", lbr);
    }
}
