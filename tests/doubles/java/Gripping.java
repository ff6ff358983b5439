package sample;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.lin;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.linRel;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.positionHold;
import static com.kuka.roboticsAPI.motionModel.BasicMotions.ptp;

import java.io.PrintWriter;
import java.util.List;
import java.util.concurrent.TimeUnit;

import javax.inject.Inject;
import javax.inject.Named;

import com.kuka.connectivity.motionModel.smartServo.ServoMotion;
import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.Inertia;
import com.kuka.roboticsAPI.geometricModel.LoadData;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.SceneGraphObject;
import com.kuka.roboticsAPI.geometricModel.Tool;
import com.kuka.roboticsAPI.geometricModel.Workpiece;
import com.kuka.roboticsAPI.geometricModel.World;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.motionModel.controlModeModel.PositionControlMode;
import com.kuka.roboticsAPI.persistenceModel.PersistenceException;
import com.kuka.roboticsAPI.sensorModel.ForceSensorData;

/** Tools and workpieces, from templates and made by the application; 4 kg hang on the flange whatever is declared. */
public class Gripping extends RoboticsAPIApplication {
    @Inject
    private LBR lbr;
    @Inject
    @Named("Gripper")
    private Tool gripper;

    private PrintWriter out;

    @Override
    public void initialize() {
        try {
            String file = getApplicationData().getProcessData("sample.file").getValue();
            out = new PrintWriter(file, "UTF-8");
        } catch (java.io.IOException e) {
            throw new IllegalStateException(e);
        }
    }

    @Override
    public void run() throws Exception {
        lbr.move(ptp(0.0, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0).setJointVelocityRel(0.5));
        templates();
        loads();
        motions();
        workpieces();
        places();
    }

    private void templates() {
        say("an injected tool has the template's load", gripper.getLoadData().getMass() == 3.0);
        say("and its frames", gripper.getFrame("/Tip").getZ() == 120.0 && gripper.getFrame("Tip/Point").getX() == 5.0
                && gripper.getRootFrame().getChildren().size() == 1);
        say("and its default motion frame", gripper.getDefaultMotionFrame() == gripper.getFrame("/Tip"));
        Tool another = getApplicationData().createFromTemplate("Gripper");
        say("each call makes another one", another != gripper && "Gripper".equals(another.getName()));
        try {
            getApplicationData().createFromTemplate("Hammer");
            say("an unknown template throws", false);
        } catch (PersistenceException e) {
            say("an unknown template throws", true);
        }
        try {
            gripper.move(linRel(0, 0, 10));
            say("a tool that is nowhere cannot move", false);
        } catch (IllegalStateException e) {
            say("a tool that is nowhere cannot move", true);
        }
    }

    private void loads() {
        hold();
        double weight = -lbr.getExternalForceTorque(lbr.getFlange(), World.Current.getRootFrame()).getForce().getZ();
        say("what is not declared pulls", Math.abs(weight - 4 * 9.81) < 0.5);
        say("and impedance control may not begin", !ServoMotion.validateForImpedanceMode(lbr));
        gripper.attachTo(lbr.getFlange());
        hold();
        weight = -lbr.getExternalForceTorque(lbr.getFlange(), World.Current.getRootFrame()).getForce().getZ();
        say("a tool takes its part", Math.abs(weight - 9.81) < 0.3);
        LoadData rest = new LoadData();
        rest.setMass(1.0);
        rest.setCenterOfMass(0, 0, 100 - 120);
        Workpiece piece = new Workpiece("piece", rest);
        piece.attachTo(gripper.getFrame("/Tip"));
        hold();
        ForceSensorData data = lbr.getExternalForceTorque(lbr.getFlange());
        say("with the workpiece nothing is felt", Math.abs(data.getForce().getZ()) < 0.05
                && Math.abs(data.getTorque().getY()) < 0.05);
        say("and impedance control may begin", ServoMotion.validateForImpedanceMode(gripper));
        piece.detach();
        hold();
        weight = -lbr.getExternalForceTorque(gripper.getFrame("/Tip"), World.Current.getRootFrame()).getForce().getZ();
        double tilt = lbr.getExternalForceTorque(gripper.getFrame("/Tip")).getTorque().getY();
        double tilted = lbr.getExternalForceTorque(lbr.getFlange(), gripper.getFrame("/Tip")).getTorque().getY();
        say("the torque depends on where it is measured", Math.abs(weight - 9.81) < 0.3 && Math.abs(tilt - tilted) > 0.1);
    }

    private void motions() {
        ObjectFrame tip = gripper.getFrame("/Tip");
        Frame before = lbr.getCurrentCartesianPosition(tip);
        say("the tip is where it is", Math.abs(lbr.getFlange().transformationTo(tip).getZ() - 120) < 1e-9
                && Math.abs(lbr.getCurrentCartesianPosition(lbr.getFlange()).distanceTo(before) - 120) < 0.05);
        gripper.move(linRel(0, 0, 0, 0.2, 0, 0));
        Frame after = lbr.getCurrentCartesianPosition(tip);
        say("a tool moves its default motion frame", before.distanceTo(after) < 0.1
                && Math.abs(before.transformationTo(after).getAlphaRad() - 0.2) < 1e-3);
        gripper.getFrame("/Tip/Point").move(lin(before).setCartVelocity(100));
        say("a frame moves itself", lbr.getCurrentCartesianPosition(gripper.getFrame("/Tip/Point")).distanceTo(before) < 1.0
                && lbr.getCommandedCartesianPosition(gripper.getFrame("/Tip/Point"), lbr.getRootFrame()).distanceTo(before) < 1e-6); // undeclared 1 kg bends it
        lbr.move(lin(before).setCartVelocity(100));
        say("the robot moves its flange", lbr.getCurrentCartesianPosition(lbr.getFlange()).distanceTo(before) < 1.0);
        say("the commanded pose knows the tool",
                lbr.getCommandedCartesianPosition(tip).distanceTo(lbr.getCurrentCartesianPosition(tip)) < 1.0);
    }

    private void workpieces() {
        Workpiece first = getApplicationData().createFromTemplate("Cube");
        first.attachTo(gripper.getDefaultMotionFrame());
        say("children are what is attached", gripper.getChildren().size() == 1 && lbr.getChildren().size() == 1);
        List<SceneGraphObject> children = gripper.getChildren();
        for (SceneGraphObject child : children) {
            if (child instanceof Workpiece) {
                ((Workpiece) child).detach();
            }
        }
        lbr.setSafetyWorkpiece(null);
        say("and can be detached one by one", gripper.getChildren().isEmpty() && children.size() == 1);
        Tool pen = new Tool("pen", new LoadData(0.5, Transformation.ofTranslation(0, 0, 50), Inertia.of(0.001, 0.001, 0.0005)));
        ObjectFrame nib = pen.addDefaultMotionFrame("nib", Transformation.ofTranslation(0, 0, 150));
        gripper.detach();
        pen.attachTo(lbr.getFlange());
        say("tools are changed", lbr.getChildren().get(0) == pen && pen.getDefaultMotionFrame() == nib);
        try {
            gripper.attachTo(gripper.getFrame("/Tip"));
            say("a tool does not hold itself", false);
        } catch (IllegalArgumentException e) {
            say("a tool does not hold itself", true);
        }
        lbr.detachAll();
        say("detachAll leaves nothing", lbr.getChildren().isEmpty());
    }

    private void places() {
        ObjectFrame table = getApplicationData().getFrame("/Table");
        ObjectFrame corner = getApplicationData().getFrame("/Table/Corner");
        say("taught frames", table.getX() == 500.0 && corner.getParent() == table
                && Math.abs(corner.transformationFromWorld().getX() - 510.0) < 1e-9);
        try {
            getApplicationData().getFrame("/Nowhere");
            say("an unknown frame throws", false);
        } catch (PersistenceException e) {
            say("an unknown frame throws", true);
        }
    }

    private void hold() {
        lbr.move(positionHold(new PositionControlMode(), 600, TimeUnit.MILLISECONDS));
    }

    private void say(String what, Object value) {
        out.println(what + " = " + value);
        out.flush();
    }
}
