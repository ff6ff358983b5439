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

import heptarm.core.Insight;
import heptarm.core.Refusal;
import heptarm.wire.PoseState;
import heptarm.wire.Redundancy;
import heptarm.wire.WrenchState;

/** What the robot measures and is led by. */
final class Readings {
    private final LBR lbr;
    private final Tools tools;
    private final Insight insight;

    /** Insight: what only a simulator knows; null on a cabinet. */
    Readings(LBR lbr, Tools tools, Insight insight) {
        this.lbr = lbr;
        this.tools = tools;
        this.insight = insight;
    }

    void joints(double[] q, double[] commanded) {
        System.arraycopy(lbr.getCurrentJointPosition().getInternalArray(), 0, q, 0, q.length);
        System.arraycopy(lbr.getCommandedJointPosition().getInternalArray(), 0, commanded, 0, q.length);
    }

    void torques(double[] measured, double[] external, double[] commanded) {
        System.arraycopy(lbr.getMeasuredTorque().getTorqueValues(), 0, measured, 0, measured.length);
        System.arraycopy(lbr.getExternalTorque().getTorqueValues(), 0, external, 0, external.length);
        if (insight != null) {
            insight.readTorques(commanded);
        } else {
            Arrays.fill(commanded, Double.NaN);
        }
    }

    PoseState pose(long stamp) {
        // relative to the robot's own base: the world's axes are others when it hangs from a wall
        ObjectFrame moved = tools.moved();
        Frame measured = lbr.getCurrentCartesianPosition(moved, lbr.getRootFrame());
        Frame commanded = lbr.getCommandedCartesianPosition(moved, lbr.getRootFrame());
        IRedundancyCollection collection = measured.getRedundancyInformationForDevice(lbr);
        Redundancy redundancy = new Redundancy(Double.NaN, -1, -1);
        if (collection instanceof LBRE1Redundancy) {
            LBRE1Redundancy e1 = (LBRE1Redundancy) collection;
            redundancy = new Redundancy(e1.getE1(), e1.getStatus(), e1.getTurn());
        }
        Transformation pose = measured.getTransformationFromParent();
        Transformation wanted = commanded.getTransformationFromParent();
        return new PoseState(stamp, Convert.xyz(pose), Convert.quaternion(pose), Convert.xyz(wanted), Convert.quaternion(wanted),
                redundancy);
    }

    WrenchState wrench(long stamp) {
        ForceSensorData data = lbr.getExternalForceTorque(tools.moved(), lbr.getRootFrame());
        return wrench(data, stamp);
    }

    WrenchState wrench(String axes, long stamp) {
        AbstractFrame turned;
        try {
            turned = tools.reference(axes);
        } catch (Refusal e) {
            throw new IllegalArgumentException(e.getMessage());
        }
        ForceSensorData data = lbr.getExternalForceTorque(tools.moved(), turned == null ? tools.moved() : turned);
        return wrench(data, stamp);
    }

    void progress(double[] progressAndRemaining) {
        if (insight != null) {
            insight.readProgress(progressAndRemaining);
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
