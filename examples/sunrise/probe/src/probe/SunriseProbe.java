package probe;

import java.io.File;
import java.io.FileOutputStream;
import java.io.IOException;
import java.io.OutputStreamWriter;
import java.io.Writer;
import java.lang.reflect.Constructor;
import java.lang.reflect.Method;
import java.util.Arrays;
import java.util.LinkedHashMap;
import java.util.Map;
import java.util.concurrent.TimeUnit;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.motionModel.PositionHold;
import com.kuka.roboticsAPI.motionModel.controlModeModel.JointImpedanceControlMode;

/**
 * Writes down what heptarm assumes of Sunrise and only a program on the cabinet sees; the commissioning run reads it.
 *
 * Nothing moves: one motion holds its position for no time at all. Lines have the form "key = value".
 */
public class SunriseProbe extends RoboticsAPIApplication {
    private static final int CALLS = 50;
    private static final String SUNRISE = "com.kuka.roboticsAPI.";
    /** Classes and members whose names are guesses: class, and a method, constant or nested class of it. */
    private static final String[][] GUESSED = {
        {"conditionModel.ForceCondition", "getThreshold"},
        {"conditionModel.ConditionObserver", "getCondition"},
        {"motionModel.MotionBatch", "getMotions"},
        {"motionModel.HandGuidingMotion", "setAxisSpeedLimit"},
        {"executionModel.IFiredConditionInfo", "getFiredCondition"},
        {"sensorModel.TorqueStatistic", "getMaxAbsTorqueValues"},
        {"geometricModel.math.Transformation", "invert"},
        {"geometricModel.math.Transformation", "compose"},
        {"geometricModel.Frame", "staticTransformationTo"},
    };

    @Inject
    private LBR lbr;

    private final Map<String, String> facts = new LinkedHashMap<String, String>();

    @Override
    public void run() throws IOException {
        facts.put("probe", "1");
        facts.put("java", System.getProperty("java.version"));
        facts.put("device", lbr.getName());
        facts.put("controller", lbr.getController().getName());
        facts.put("IORangeCondition", constructors(SUNRISE + "conditionModel.IORangeCondition"));
        facts.put("CartSineImpBuilder", builder(SUNRISE + "motionModel.controlModeModel.CartesianSineImpedanceControlMode"));
        facts.put("missing", missing());
        facts.put("ExecutionState", constants(SUNRISE + "executionModel.ExecutionState"));
        time();
        holdForNoTime();
        write();
    }

    private static String constructors(String name) {
        try {
            StringBuilder all = new StringBuilder();
            for (Constructor<?> one : Class.forName(name).getConstructors()) {
                StringBuilder types = new StringBuilder();
                for (Class<?> type : one.getParameterTypes()) {
                    types.append(types.length() > 0 ? ", " : "").append(type.getSimpleName());
                }
                all.append(all.length() > 0 ? " " : "").append('(').append(types).append(')');
            }
            return all.toString();
        } catch (ClassNotFoundException e) {
            return "missing";
        }
    }

    private static String builder(String name) {
        try {
            for (Method one : Class.forName(name).getMethods()) {
                if (one.getName().equals("parametrize") && one.getDeclaringClass().getName().equals(name) && !one.isBridge()) {
                    String full = one.getReturnType().getName();
                    return full.substring(full.lastIndexOf('.') + 1);
                }
            }
        } catch (ClassNotFoundException e) {
            return "missing";
        }
        return "no parametrize";
    }

    private static String constants(String name) {
        try {
            return Arrays.toString(Class.forName(name).getEnumConstants());
        } catch (ClassNotFoundException e) {
            return "missing";
        }
    }

    private static String missing() {
        StringBuilder all = new StringBuilder();
        for (String[] guess : GUESSED) {
            if (!has(SUNRISE + guess[0], guess[1])) {
                all.append(all.length() > 0 ? ", " : "").append(guess[0]).append('.').append(guess[1]);
            }
        }
        return all.length() > 0 ? all.toString() : "none";
    }

    private static boolean has(String name, String member) {
        try {
            for (Method one : Class.forName(name).getMethods()) {
                if (one.getName().equals(member)) {
                    return true;
                }
            }
        } catch (ClassNotFoundException e) {
            return false;
        }
        return false;
    }

    private void time() {
        long[] joints = new long[CALLS];
        long[] forces = new long[CALLS];
        for (int i = 0; i < CALLS; i++) {
            long began = System.nanoTime();
            lbr.getCurrentJointPosition();
            long between = System.nanoTime();
            lbr.getExternalForceTorque(lbr.getFlange());
            joints[i] = between - began;
            forces[i] = System.nanoTime() - between;
        }
        facts.put("read_joints_ms", median(joints));
        facts.put("read_force_ms", median(forces));
    }

    private static String median(long[] nanos) {
        Arrays.sort(nanos);
        return milliseconds(nanos[nanos.length / 2]);
    }

    private void holdForNoTime() {
        try {
            JointImpedanceControlMode mode = new JointImpedanceControlMode(lbr.getJointCount());
            mode.setStiffnessForAllJoints(2000);
            lbr.move(new PositionHold(mode, 1, TimeUnit.MILLISECONDS)); // everything is loaded now
            long began = System.nanoTime();
            lbr.move(new PositionHold(mode, 0, TimeUnit.MILLISECONDS));
            facts.put("hold_zero_ms", milliseconds(System.nanoTime() - began));
        } catch (RuntimeException e) {
            facts.put("hold_zero_ms", e.toString());
        }
    }

    private static String milliseconds(long nanos) {
        return Double.toString(Math.round(nanos / 1e3) / 1e3);
    }

    private void write() throws IOException {
        String folder = getApplicationData().getProcessData("folder").getValue();
        File file = new File(folder, "sunrise-probe.txt");
        Writer writer = new OutputStreamWriter(new FileOutputStream(file), "UTF-8");
        try {
            for (Map.Entry<String, String> fact : facts.entrySet()) {
                writer.write(fact.getKey() + " = " + fact.getValue() + "\n");
                getLogger().info(fact.getKey() + " = " + fact.getValue());
            }
        } finally {
            writer.close();
        }
        getLogger().info("written to " + file.getAbsolutePath());
    }
}
