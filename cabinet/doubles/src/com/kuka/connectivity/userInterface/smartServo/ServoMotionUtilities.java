package com.kuka.connectivity.userInterface.smartServo;

import com.kuka.roboticsAPI.RoboticsAPIContext;
import com.kuka.roboticsAPI.controllerModel.sunrise.SunriseController;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.LoadData;
import com.kuka.roboticsAPI.geometricModel.PhysicalObject;
import com.kuka.roboticsAPI.geometricModel.Tool;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;

/** Helpers from KUKA's examples of servo motions. */
public final class ServoMotionUtilities {
    private ServoMotionUtilities() {
    }

    /** Creates a tool and attaches it to the flange: position of the tip [mm], mass [kg], centre of mass [mm]. */
    public static PhysicalObject createTool(LBR robot, String name, double[] tip, double mass, double[] centreOfMass) {
        LoadData load = new LoadData();
        load.setMass(mass);
        load.setCenterOfMass(centreOfMass[0], centreOfMass[1], centreOfMass[2]);
        Tool tool = new Tool(name, load);
        tool.addDefaultMotionFrame(name + "_TCP", Transformation.ofTranslation(tip[0], tip[1], tip[2]));
        tool.attachTo(robot.getFlange());
        return tool;
    }

    /** The robot of a context. */
    public static LBR locateLBR(RoboticsAPIContext context) {
        return context.getDeviceFromType(LBR.class);
    }

    /** Cancels all motions of the robot's cabinet and acknowledges its errors. */
    public static void resetControllerAndKILLALLMOTIONS(LBR robot) {
        robot.getController().getExecutionService().cancelAll();
        acknowledgeError(robot);
    }

    /** Acknowledges errors of the robot's cabinet. */
    public static void acknowledgeError(LBR robot) {
        ((SunriseController) robot.getController()).acknowledgeError();
    }
}
