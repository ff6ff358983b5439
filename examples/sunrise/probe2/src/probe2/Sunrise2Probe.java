package probe2;

import java.lang.reflect.Constructor;
import java.lang.reflect.Method;
import java.lang.reflect.Modifier;
import java.util.Arrays;
import java.util.TreeSet;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;

/**
 * Prints which classes and members a Sunrise 2.x cabinet has that no public program shows: heptarm needs them to do more there.
 *
 * Nothing moves, and no object of the cabinet is touched: it looks up classes by name. Copy the lines that begin with "probe2" from
 * the log of the application, or from this file's output, and report them. Written from facts, never run on such a cabinet.
 */
public class Sunrise2Probe extends RoboticsAPIApplication {
    /** Packages in which a class of 1.x may be found in 2.x. */
    private static final String[] PACKAGES = {"com.kuka.roboticsAPI.applicationModel", "com.kuka.roboticsAPI.conditionModel",
        "com.kuka.roboticsAPI.controllerModel", "com.kuka.roboticsAPI.controllerModel.sunrise", "com.kuka.roboticsAPI.deviceModel",
        "com.kuka.roboticsAPI.executionModel", "com.kuka.roboticsAPI.geometricModel", "com.kuka.roboticsAPI.motionModel",
        "com.kuka.roboticsAPI.motionModel.controlModeModel", "com.kuka.roboticsAPI.persistenceModel.processDataModel",
        "com.kuka.roboticsAPI.uiModel", "com.kuka.roboticsAPI.uiModel.userKeys", "com.kuka.condition", "com.kuka.controller",
        "com.kuka.device", "com.kuka.device.common", "com.kuka.geometry", "com.kuka.handguiding.motion", "com.kuka.math.geometry",
        "com.kuka.motion", "com.kuka.persistence", "com.kuka.processdata", "com.kuka.processdata.api", "com.kuka.safety",
        "com.kuka.safety.diagnosis", "com.kuka.safety.diagnosis.api", "com.kuka.sensitivity", "com.kuka.sensitivity.conditions",
        "com.kuka.sensitivity.controlmode", "com.kuka.statuscontroller", "com.kuka.statuscontroller.statusgroups"};
    /** Classes of 1.x whose place in 2.x is unknown. */
    private static final String[] UNKNOWN = {"IApplicationData", "LBRE1Redundancy", "IRedundancyCollection", "PhysicalObject", "Workpiece",
        "CartPlane", "CoordinateAxis", "Matrix", "LIN", "CIRC", "RelativeLIN", "SplineJP", "SplineMotionCP", "MotionBatch", "RobotMotion",
        "Spline", "HandGuidingMotion", "OrientationReferenceSystem", "SplineOrientationType", "BooleanIOCondition",
        "ForceComponentCondition", "TorqueComponentCondition", "MotionPathCondition", "ReferenceType", "ICallbackAction",
        "IFiredTriggerInfo", "CartesianSineImpedanceControlMode", "IProcessData", "PersistenceException", "Controller",
        "SunriseController", "SunriseExecutionService", "ResumeMode", "IRecovery", "ISafetyState", "SunriseSafetyState", "OperationMode",
        "UserKeyLED", "UserKeyLEDSize", "UserKeyEvent", "IUserKey"};
    /** Classes that are known, some of whose members are not. */
    private static final String[] KNOWN = {"com.kuka.sensitivity.LBR", "com.kuka.device.RoboticArm",
        "com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication", "com.kuka.roboticsAPI.applicationModel.IApplicationControl",
        "com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplicationState", "com.kuka.roboticsAPI.motionModel.BasicMotions",
        "com.kuka.roboticsAPI.conditionModel.ForceCondition", "com.kuka.motion.IMotionContainer",
        "com.kuka.motion.IMotionContainerListener", "com.kuka.motion.MotionContainerState", "com.kuka.condition.ICondition",
        "com.kuka.sensitivity.controlmode.JointImpedanceControlMode", "com.kuka.sensitivity.controlmode.CartesianImpedanceControlMode",
        "com.kuka.servoing.api.smartservo.ISmartServo", "com.kuka.servoing.api.smartservo.ISmartServoRuntime",
        "com.kuka.servoing.api.smartservolin.ISmartServoLin", "com.kuka.servoing.api.common.EServoRequestState",
        "com.kuka.geometry.Tool", "com.kuka.geometry.LoadData", "com.kuka.geometry.World", "com.kuka.io.IIoDefinition",
        "com.kuka.io.IIoValueProvider", "com.kuka.fri.FRIConfiguration", "com.kuka.fri.common.ClientCommandMode",
        "com.kuka.fri.api.monitoring.IFriConfiguration", "com.kuka.fri.api.commanding.EClientCommandMode",
        "com.kuka.fri.api.commanding.IFriCommanding"};

    @Override
    public void run() {
        print("java " + System.getProperty("java.version"));
        for (String name : UNKNOWN) {
            boolean found = false;
            for (String folder : PACKAGES) {
                found |= describe(folder + "." + name);
            }
            if (!found) {
                print("missing " + name);
            }
        }
        for (String name : KNOWN) {
            if (!describe(name)) {
                print("missing " + name);
            }
        }
    }

    /** Print the public members of a class; false: there is no such class. */
    private boolean describe(String name) {
        Class<?> type;
        try {
            type = Class.forName(name, false, getClass().getClassLoader());
        } catch (ClassNotFoundException e) {
            return false;
        } catch (LinkageError e) {
            print("class " + name + " cannot be loaded: " + e);
            return true;
        }
        print("class " + name + " extends " + type.getSuperclass() + " implements " + Arrays.toString(type.getInterfaces()));
        if (type.isEnum()) {
            print("  constants " + Arrays.toString(type.getEnumConstants()));
        }
        TreeSet<String> members = new TreeSet<String>();
        try {
            for (Constructor<?> made : type.getConstructors()) {
                members.add("new" + types(made.getParameterTypes()) + " throws " + types(made.getExceptionTypes()));
            }
            for (Method method : type.getMethods()) {
                if (method.getDeclaringClass() != Object.class && !method.isBridge()) {
                    members.add((Modifier.isStatic(method.getModifiers()) ? "static " : "") + method.getName()
                            + types(method.getParameterTypes()) + ": " + method.getReturnType().getName() + " throws "
                            + types(method.getExceptionTypes()));
                }
            }
        } catch (LinkageError e) {
            print("  its members cannot be listed: " + e);
        }
        for (String member : members) {
            print("  " + member);
        }
        return true;
    }

    private static String types(Class<?>[] all) {
        StringBuilder names = new StringBuilder();
        for (Class<?> type : all) {
            names.append(names.length() > 0 ? ", " : "").append(type.getName());
        }
        return "(" + names + ")";
    }

    private void print(String line) {
        getLogger().info("probe2 " + line);
    }
}
