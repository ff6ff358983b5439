package heptarm.app;

import java.util.Arrays;

import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.deviceModel.LBRE1Redundancy;
import com.kuka.roboticsAPI.geometricModel.AbstractFrame;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.geometricModel.math.Vector;
import com.kuka.roboticsAPI.geometricModel.redundancy.IRedundancyCollection;
import com.kuka.roboticsAPI.sensorModel.ForceSensorData;

import heptarm.core.CommandRejected;
import heptarm.core.robot.Sensors;
import heptarm.core.robot.SimulatorProbe;
import heptarm.wire.JointState;
import heptarm.wire.Pose;
import heptarm.wire.PoseState;
import heptarm.wire.Redundancy;
import heptarm.wire.TorqueState;
import heptarm.wire.WrenchState;

/** Sensors of Sunrise behind the core's port. */
final class SunriseSensors implements Sensors {
    private final LBR lbr;
    private final SunriseTools tools;
    private final SimulatorProbe probe;

    /** Probe: null on a real robot. */
    SunriseSensors(LBR lbr, SunriseTools tools, SimulatorProbe probe) {
        this.lbr = lbr;
        this.tools = tools;
        this.probe = probe;
    }

    public JointState readJoints(long stamp) {
        double[] measured = lbr.getCurrentJointPosition().getInternalArray().clone();
        return new JointState(stamp, measured, lbr.getCommandedJointPosition().getInternalArray().clone(), unknown());
    }

    public TorqueState readTorques(long stamp) {
        double[] commanded = unknown();
        if (probe != null) {
            probe.readTorques(commanded);
        }
        return new TorqueState(stamp, lbr.getMeasuredTorque().getTorqueValues().clone(),
                lbr.getExternalTorque().getTorqueValues().clone(), commanded);
    }

    private double[] unknown() {
        double[] values = new double[lbr.getJointCount()];
        Arrays.fill(values, Double.NaN);
        return values;
    }

    public PoseState readPose(long stamp) {
        Frame measured;
        Frame commanded;
        synchronized (tools) { // while a tool is changed, the frame of motions is attached to nothing
            // relative to the robot's own base: the axes of the world differ for a robot on a wall
            ObjectFrame frame = tools.motionFrame();
            measured = lbr.getCurrentCartesianPosition(frame, lbr.getRootFrame());
            commanded = lbr.getCommandedCartesianPosition(frame, lbr.getRootFrame());
        }
        IRedundancyCollection collection = measured.getRedundancyInformationForDevice(lbr);
        Redundancy redundancy = new Redundancy(Double.NaN, -1, -1);
        if (collection instanceof LBRE1Redundancy) {
            LBRE1Redundancy e1 = (LBRE1Redundancy) collection;
            redundancy = new Redundancy(e1.getE1(), e1.getStatus(), e1.getTurn());
        }
        Transformation pose = measured.getTransformationFromParent();
        Transformation target = commanded.getTransformationFromParent();
        return new PoseState(stamp, Convert.xyz(pose), Convert.quaternion(pose), Convert.xyz(target), Convert.quaternion(target),
                redundancy);
    }

    public WrenchState readWrench(long stamp) {
        synchronized (tools) {
            return wrench(lbr.getExternalForceTorque(tools.motionFrame(), lbr.getRootFrame()), stamp);
        }
    }

    public WrenchState readWrench(String frame, Pose axes, long stamp) {
        synchronized (tools) {
            AbstractFrame reference;
            try {
                reference = tools.reference(frame, axes);
            } catch (CommandRejected e) {
                throw new IllegalArgumentException(e.getMessage());
            }
            ForceSensorData data = lbr.getExternalForceTorque(tools.motionFrame(), reference == null ? tools.motionFrame() : reference);
            return wrench(data, stamp);
        }
    }

    public void readProgress(double[] progressAndRemaining) {
        if (probe != null) {
            probe.readProgress(progressAndRemaining);
        }
    }

    private static WrenchState wrench(ForceSensorData data, long stamp) {
        return new WrenchState(stamp, array(data.getForce()), array(data.getTorque()), array(data.getForceInaccuracy()),
                array(data.getTorqueInaccuracy()));
    }

    private static double[] array(Vector v) {
        return new double[] {v.getX(), v.getY(), v.getZ()};
    }
}
